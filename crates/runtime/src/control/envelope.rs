//! JSON-RPC 2.0: what is around the parameters and the result.

use std::fmt;
use std::io;

use isochrone_ipc::MAX_MESSAGE_BYTES;
use serde::de::{DeserializeSeed, Error, IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::value::RawValue;

use super::members::shown;
use super::{Call, Code, Failure, Finding, Method, Params};

/// Longest `id` of a request, in bytes.
pub const MAX_ID_BYTES: usize = 128;
/// What findings leave to the rest of an answer.
const AROUND_FINDINGS: usize = 4096;
const VERSION: &str = "2.0";

/// A request that is one.
#[derive(Debug, Clone, PartialEq)]
pub struct Parsed {
    /// By which the client recognises the answer.
    pub id: String,
    /// What it asks for.
    pub call: Call,
}

/// Why a text is no request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unparsed {
    /// The request's `id`, if it can be known.
    pub id: Option<String>,
    /// The answer to it.
    pub failure: Failure,
}

/// Reads a request. Never panics, whatever the bytes are.
///
/// # Errors
/// With what to answer: the bytes are too long, no JSON, no request of JSON-RPC 2.0 with an `id` that is a
/// string, or name a method or parameters that do not exist. Parameters are checked whole, so that all
/// findings are there.
pub fn parse(bytes: &[u8]) -> Result<Parsed, Unparsed> {
    let mut found = Found::default();
    let refused = |found: &Found<'_>, failure| Unparsed { id: found.id.clone(), failure };
    let length = bytes.len();
    if length > MAX_MESSAGE_BYTES {
        // What stands at the beginning may still tell whom to answer.
        let _ = found.read(valid(bytes.get(..MAX_MESSAGE_BYTES).unwrap_or_default()).0);
        let message = format!(
            "a request of {length} bytes; at most {MAX_MESSAGE_BYTES} are possible: divide it"
        );
        return Err(refused(&found, Failure::new(Code::InvalidRequest, message)));
    }
    let (text, is_whole) = valid(bytes);
    let read = found.read(text);
    if !is_whole {
        let message = format!("byte {} is no UTF-8 text", text.len());
        return Err(refused(&found, Failure::new(Code::Parse, message)));
    }
    if let Err(error) = read {
        let failure = match text.trim_start().as_bytes().first() {
            Some(b'[') => Failure::new(
                Code::InvalidRequest,
                "batches are not taken; send one request after the other",
            ),
            _ if error.is_data() => Failure::new(
                Code::InvalidRequest,
                "a request is an object, such as {\"jsonrpc\": \"2.0\", \"id\": \"1\", \"method\": \"describe\"}",
            ),
            _ => Failure::new(Code::Parse, format!("this is no JSON: {error}")),
        };
        return Err(refused(&found, failure));
    }
    let call = found.check().and_then(|method| Call::read(method, found.params));
    match (call, found.id.clone()) {
        (Ok(call), Some(id)) => Ok(Parsed { id, call }),
        (Ok(_), None) => Err(refused(&found, Failure::new(Code::InvalidRequest, NO_ID))),
        (Err(failure), _) => Err(refused(&found, failure)),
    }
}

const NO_ID: &str =
    "the \"id\" must be a string of 1 to 128 bytes; without one nobody could be answered";

/// The beginning of the bytes that is text, and whether that is all.
fn valid(bytes: &[u8]) -> (&str, bool) {
    match std::str::from_utf8(bytes) {
        Ok(text) => (text, true),
        Err(error) => {
            let valid = bytes.get(..error.valid_up_to()).unwrap_or_default();
            (std::str::from_utf8(valid).unwrap_or_default(), false)
        }
    }
}

/// What a text says at its top level, as far as it could be read.
#[derive(Default)]
struct Found<'a> {
    id: Option<String>,
    version: Option<String>,
    method: Option<String>,
    params: Option<&'a RawValue>,
    /// What is wrong with members; the first one decides.
    faults: Vec<Finding>,
}

impl<'a> Found<'a> {
    /// Reads as much as there is; what was found before an error stays.
    fn read(&mut self, text: &'a str) -> serde_json::Result<()> {
        let mut deserializer = serde_json::Deserializer::from_str(text);
        self.deserialize(&mut deserializer)?;
        deserializer.end()
    }

    fn check(&self) -> Result<Method, Failure> {
        let invalid = |message: &str| Err(Failure::new(Code::InvalidRequest, message));
        if !self.faults.is_empty() {
            return Err(Failure::of(Code::InvalidRequest, self.faults.clone()));
        }
        if self.version.as_deref() != Some(VERSION) {
            return invalid("\"jsonrpc\" must be \"2.0\"");
        }
        if self.id.is_none() {
            return invalid(NO_ID);
        }
        match &self.method {
            Some(method) => Method::of(method),
            None => invalid("\"method\" must be the name of one, such as \"describe\""),
        }
    }

    fn take(&mut self, name: &str, raw: &'a RawValue) {
        let text = || serde_json::from_str::<String>(raw.get()).ok();
        let is_twice = match name {
            "jsonrpc" => self.version.replace(text().unwrap_or_default()).is_some(),
            "id" => {
                let id = text().filter(|id| (1..=MAX_ID_BYTES).contains(&id.len()));
                // The first one stays: whoever sent it knows it.
                let is_twice = self.id.is_some();
                self.id = self.id.take().or(id);
                is_twice
            }
            "method" => match text() {
                Some(method) => self.method.replace(method).is_some(),
                None => false,
            },
            "params" => self.params.replace(raw).is_some(),
            _ => {
                let shown = shown(name);
                let message = format!("a request has no member \"{shown}\"");
                let help = "there is: jsonrpc, id, method, params";
                self.faults.push(Finding::new(shown, message).with_help(help));
                false
            }
        };
        if is_twice {
            let message = format!("\"{name}\" is given twice");
            self.faults.push(Finding::new(name, message).with_help("leave one of them out"));
        }
    }
}

impl<'de> DeserializeSeed<'de> for &mut Found<'de> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for &mut Found<'de> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a request")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(name) = map.next_key::<String>()? {
            let raw = map.next_value()?;
            self.take(&name, raw);
        }
        Ok(())
    }
}

/// The text of a request.
///
/// # Errors
/// It is longer than a message can be.
pub fn request<P: Params>(id: &str, params: &P) -> Result<Vec<u8>, Failure> {
    #[derive(Serialize)]
    struct Request<'a, P> {
        jsonrpc: &'static str,
        id: &'a str,
        method: &'static str,
        params: &'a P,
    }
    let request = Request { jsonrpc: VERSION, id, method: P::METHOD.as_str(), params };
    let internal = |error| Failure::new(Code::Internal, format!("the request: {error}"));
    let text = serde_json::to_vec(&request).map_err(internal)?;
    if text.len() > MAX_MESSAGE_BYTES {
        let message = format!(
            "the request has {} bytes; at most {MAX_MESSAGE_BYTES} are possible: divide it",
            text.len()
        );
        return Err(Failure::new(Code::InvalidRequest, message));
    }
    Ok(text)
}

/// The text of an answer, which always fits into a message: of more findings than that holds the first
/// ones are in it, and a result that does not fit is a failure that says so.
pub fn answer<T: Serialize>(id: Option<&str>, outcome: Result<&T, &Failure>) -> Vec<u8> {
    #[derive(Serialize)]
    struct Success<'a, T> {
        jsonrpc: &'static str,
        id: Option<&'a str>,
        result: &'a T,
    }
    let failure = match outcome {
        Ok(result) => match serde_json::to_vec(&Success { jsonrpc: VERSION, id, result }) {
            Ok(text) if text.len() <= MAX_MESSAGE_BYTES => return text,
            Ok(text) => Failure::new(
                Code::Internal,
                format!(
                    "the answer would have {} bytes, and at most {MAX_MESSAGE_BYTES} are possible; ask for less at a time (\"limit\")",
                    text.len()
                ),
            ),
            Err(error) => Failure::new(Code::Internal, format!("the answer: {error}")),
        },
        Err(failure) => fitting(failure),
    };
    let text = refusal(id, &failure);
    if text.len() <= MAX_MESSAGE_BYTES {
        return text;
    }
    // Only the message can still be too long.
    let message: String = failure.message.chars().take(1000).collect();
    refusal(id, &Failure::new(failure.code, message))
}

fn refusal(id: Option<&str>, error: &Failure) -> Vec<u8> {
    #[derive(Serialize)]
    struct Refusal<'a> {
        jsonrpc: &'static str,
        id: Option<&'a str>,
        error: &'a Failure,
    }
    // Strings and numbers can always be written.
    serde_json::to_vec(&Refusal { jsonrpc: VERSION, id, error }).unwrap_or_default()
}

/// The failure with as many of its findings as an answer holds.
fn fitting(failure: &Failure) -> Failure {
    let mut room = Room::new(MAX_MESSAGE_BYTES - AROUND_FINDINGS);
    let findings = failure.findings.iter().take_while(|finding| room.takes(finding));
    let findings: Vec<_> = findings.cloned().collect();
    let mut message = failure.message.clone();
    if findings.len() < failure.findings.len() {
        message += &format!(
            "; of {} findings the first {} are in this answer",
            failure.findings.len(),
            findings.len()
        );
    }
    Failure { code: failure.code, message, findings }
}

/// How much room a page of results still has in an answer.
#[derive(Debug, Clone, Copy)]
pub struct Room {
    left: usize,
}

impl Room {
    /// That of an answer's lists and maps, all together.
    pub fn of_answer() -> Self {
        Self::new(MAX_MESSAGE_BYTES - AROUND_FINDINGS)
    }

    fn new(left: usize) -> Self {
        Self { left }
    }

    /// Takes room for an item as JSON, if there is enough. A page ends with the last that was taken.
    pub fn takes<T: Serialize + ?Sized>(&mut self, item: &T) -> bool {
        let mut counted = Counted(0);
        if serde_json::to_writer(&mut counted, item).is_err() {
            return false;
        }
        // And a comma.
        match self.left.checked_sub(counted.0 + 1) {
            Some(left) => {
                self.left = left;
                true
            }
            None => false,
        }
    }

    /// As [`takes`](Self::takes), for an entry of a map.
    pub fn takes_entry<T: Serialize + ?Sized>(&mut self, name: &str, item: &T) -> bool {
        let before = *self;
        let takes = self.takes(name) && self.takes(item);
        if !takes {
            *self = before;
        }
        takes
    }
}

/// Counts what is written to it.
struct Counted(usize);

impl io::Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// An answer as a client reads it.
#[derive(Debug)]
pub(super) struct Answer<'a> {
    pub(super) id: Option<String>,
    pub(super) outcome: Result<&'a RawValue, Failure>,
}

impl<'a> Answer<'a> {
    /// Reads an answer; an error says what it is instead.
    pub(super) fn read(text: &'a [u8]) -> Result<Self, serde_json::Error> {
        #[derive(Deserialize)]
        struct Raw<'a> {
            #[serde(rename = "jsonrpc")]
            _jsonrpc: IgnoredAny,
            id: Option<String>,
            #[serde(borrow)]
            result: Option<&'a RawValue>,
            error: Option<Failure>,
        }
        let raw: Raw<'_> = serde_json::from_slice(text)?;
        let outcome = match (raw.result, raw.error) {
            (Some(result), None) => Ok(result),
            (None, Some(failure)) => Err(failure),
            _ => return Err(serde_json::Error::custom("neither a result nor an error")),
        };
        Ok(Self { id: raw.id, outcome })
    }
}

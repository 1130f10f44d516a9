//! Parsing requests: the JSON-RPC 2.0 object around the parameters.

use std::fmt;

use isochrone_ipc::MAX_MESSAGE_BYTES;
use serde::Deserializer;
use serde::de::{DeserializeSeed, MapAccess, Visitor};
use serde_json::value::RawValue;

use super::members::shown;
use super::{Call, Code, Finding, Method, Refusal};

/// Longest `id` of a request, in bytes.
pub const MAX_ID_BYTES: usize = 128;
/// Of JSON-RPC.
pub(super) const VERSION: &str = "2.0";

/// A parsed request.
#[derive(Debug, Clone, PartialEq)]
pub struct Parsed {
    /// The id with which the client recognises the answer.
    pub id: String,
    /// The call.
    pub call: Call,
}

/// Why a text is not a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unparsed {
    /// The request's `id`, if it could be read.
    pub id: Option<String>,
    /// The answer to it.
    pub failure: Refusal,
}

/// Reads a request. Never panics, whatever the bytes are.
///
/// # Errors
/// The bytes are too long, not JSON, not a request of JSON-RPC 2.0 with a string `id`, or name a method or parameters
/// that do not exist. The error has the answer, with all findings about the parameters.
pub fn parse(bytes: &[u8]) -> Result<Parsed, Unparsed> {
    let mut found = TopLevel::default();
    let refused = |found: &TopLevel<'_>, failure| Unparsed { id: found.id.clone(), failure };
    let length = bytes.len();
    if length > MAX_MESSAGE_BYTES {
        // The beginning may still have the id to answer to.
        let _ = found.read(valid(bytes.get(..MAX_MESSAGE_BYTES).unwrap_or_default()).0);
        let message = format!(
            "a request of {length} bytes; at most {MAX_MESSAGE_BYTES} are possible: divide it"
        );
        return Err(refused(&found, Refusal::new(Code::InvalidRequest, message)));
    }
    let (text, is_whole) = valid(bytes);
    let read = found.read(text);
    if !is_whole {
        let message = format!("byte {} is no UTF-8 text", text.len());
        return Err(refused(&found, Refusal::new(Code::Parse, message)));
    }
    if let Err(error) = read {
        let failure = match text.trim_start().as_bytes().first() {
            Some(b'[') => Refusal::new(
                Code::InvalidRequest,
                "batches are not taken; send one request after the other",
            ),
            _ if error.is_data() => Refusal::new(
                Code::InvalidRequest,
                "a request is an object, such as {\"jsonrpc\": \"2.0\", \"id\": \"1\", \"method\": \"describe\"}",
            ),
            _ => Refusal::new(Code::Parse, format!("this is no JSON: {error}")),
        };
        return Err(refused(&found, failure));
    }
    let call = found.check().and_then(|method| Call::read(method, found.params));
    match (call, found.id.clone()) {
        (Ok(call), Some(id)) => Ok(Parsed { id, call }),
        (Ok(_), None) => Err(refused(&found, Refusal::new(Code::InvalidRequest, NO_ID))),
        (Err(failure), _) => Err(refused(&found, failure)),
    }
}

const NO_ID: &str =
    "the \"id\" must be a string of 1 to 128 bytes; without one nobody could be answered";

/// The leading part of the bytes that is UTF-8, and whether that is all.
fn valid(bytes: &[u8]) -> (&str, bool) {
    match std::str::from_utf8(bytes) {
        Ok(text) => (text, true),
        Err(error) => {
            let valid = bytes.get(..error.valid_up_to()).unwrap_or_default();
            (std::str::from_utf8(valid).unwrap_or_default(), false)
        }
    }
}

/// The members at the top level of a text, as far as it could be read.
#[derive(Default)]
struct TopLevel<'a> {
    id: Option<String>,
    version: Option<String>,
    method: Option<String>,
    params: Option<&'a RawValue>,
    /// What is wrong with members; the first one decides.
    faults: Vec<Finding>,
}

impl<'a> TopLevel<'a> {
    /// Reads as much as possible; members before an error are kept.
    fn read(&mut self, text: &'a str) -> serde_json::Result<()> {
        let mut deserializer = serde_json::Deserializer::from_str(text);
        self.deserialize(&mut deserializer)?;
        deserializer.end()
    }

    fn check(&self) -> Result<Method, Refusal> {
        let invalid = |message: &str| Err(Refusal::new(Code::InvalidRequest, message));
        if !self.faults.is_empty() {
            return Err(Refusal::of(Code::InvalidRequest, self.faults.clone()));
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
                // The first one counts: its sender knows it.
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

impl<'de> DeserializeSeed<'de> for &mut TopLevel<'de> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for &mut TopLevel<'de> {
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

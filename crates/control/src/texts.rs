//! Writing requests and answers, so that they fit into a message, and reading answers.

use std::io;

use isochrone_ipc::MAX_MESSAGE_BYTES;
use serde::de::{Error, IgnoredAny};
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use super::envelope::VERSION;
use super::{Code, Params, Refusal};

/// What the lists of an answer leave to the rest of it, in bytes.
const AROUND: usize = 4096;

/// The text of a request.
///
/// # Errors
/// It is longer than a message can be.
pub fn request<P: Params>(id: &str, params: &P) -> Result<Vec<u8>, Refusal> {
    #[derive(Serialize)]
    struct Request<'a, P> {
        jsonrpc: &'static str,
        id: &'a str,
        method: &'static str,
        params: &'a P,
    }
    let request = Request { jsonrpc: VERSION, id, method: P::METHOD.as_str(), params };
    let internal = |error| Refusal::new(Code::Internal, format!("the request: {error}"));
    let text = serde_json::to_vec(&request).map_err(internal)?;
    if text.len() > MAX_MESSAGE_BYTES {
        let message = format!(
            "the request has {} bytes; at most {MAX_MESSAGE_BYTES} are possible: divide it",
            text.len()
        );
        return Err(Refusal::new(Code::InvalidRequest, message));
    }
    Ok(text)
}

/// The text of an answer, which always fits into a message: of more findings than that holds the first
/// ones are in it, and a result that does not fit is a failure that says so.
pub fn answer<T: Serialize>(id: Option<&str>, outcome: Result<&T, &Refusal>) -> Vec<u8> {
    #[derive(Serialize)]
    struct Success<'a, T> {
        jsonrpc: &'static str,
        id: Option<&'a str>,
        result: &'a T,
    }
    let failure = match outcome {
        Ok(result) => match serde_json::to_vec(&Success { jsonrpc: VERSION, id, result }) {
            Ok(text) if text.len() <= MAX_MESSAGE_BYTES => return text,
            Ok(text) => Refusal::new(
                Code::Internal,
                format!(
                    "the answer would have {} bytes, and at most {MAX_MESSAGE_BYTES} are possible; ask for less at a time (\"limit\")",
                    text.len()
                ),
            ),
            Err(error) => Refusal::new(Code::Internal, format!("the answer: {error}")),
        },
        Err(failure) => fitting(failure),
    };
    let text = refusal(id, &failure);
    if text.len() <= MAX_MESSAGE_BYTES {
        return text;
    }
    // Only the message can still be too long.
    let message: String = failure.message.chars().take(1000).collect();
    refusal(id, &Refusal::new(failure.code, message))
}

fn refusal(id: Option<&str>, error: &Refusal) -> Vec<u8> {
    #[derive(Serialize)]
    struct Refused<'a> {
        jsonrpc: &'static str,
        id: Option<&'a str>,
        error: &'a Refusal,
    }
    // Strings and numbers can always be written.
    serde_json::to_vec(&Refused { jsonrpc: VERSION, id, error }).unwrap_or_default()
}

/// The failure with as many of its findings as an answer holds.
fn fitting(failure: &Refusal) -> Refusal {
    let mut room = Room::new(MAX_MESSAGE_BYTES - AROUND);
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
    Refusal { code: failure.code, message, findings }
}

/// How much room a page of results still has in an answer.
#[derive(Debug, Clone, Copy)]
pub struct Room {
    left: usize,
}

impl Room {
    /// That of an answer's lists and maps, all together.
    pub fn of_answer() -> Self {
        Self::new(MAX_MESSAGE_BYTES - AROUND)
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
    pub(super) outcome: Result<&'a RawValue, Refusal>,
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
            error: Option<Refusal>,
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

//! The texts that `save` hands out: made one after the other, and kept for their clients until all pieces were taken.

use std::collections::VecDeque;

use isochrone_control::desk::SaveError;
use isochrone_control::{CallResult, Code, Refusal, Reply, SaveResult, Ticket};
use isochrone_ipc::{MAX_CLIENTS, MAX_MESSAGE_BYTES};

use super::jobs::Job;

/// The space that a piece leaves for the rest of its answer, in bytes.
const AROUND: usize = 4096;

/// Texts that are being written or sent.
#[derive(Default)]
pub(super) struct Saving {
    /// In the order in which they are written.
    making: VecDeque<Making>,
    made: Vec<Text>,
}

struct Making {
    ticket: Ticket,
    process: Option<u32>,
    job: Job<Result<String, SaveError>>,
}

/// A text for one client.
struct Text {
    process: Option<u32>,
    text: String,
}

impl Saving {
    /// Whether as many are being made as there may be clients.
    pub(super) fn is_full(&self) -> bool {
        self.making.len() >= MAX_CLIENTS
    }

    /// Takes the text that a job makes for a client.
    pub(super) fn begin(
        &mut self,
        ticket: Ticket,
        process: Option<u32>,
        job: Job<Result<String, SaveError>>,
    ) {
        self.making.push_back(Making { ticket, process, job });
    }

    /// The first pieces of the texts that were written since the last call.
    pub(super) fn made(&mut self) -> Vec<(Ticket, CallResult)> {
        let mut made = Vec::new();
        while let Some(text) = self.making.front().and_then(|making| making.job.result())
            && let Some(Making { ticket, process, .. }) = self.making.pop_front()
        {
            let internal = |error: SaveError| Refusal::new(Code::Internal, error.to_string());
            let text = text.and_then(|text| text.map_err(internal));
            let piece = text.and_then(|text| self.first_piece(process, text));
            made.push((ticket, piece.map(Reply::Save)));
        }
        made
    }

    /// Stops writing; returns the tickets that wait.
    pub(super) fn end(&mut self) -> impl Iterator<Item = Ticket> {
        self.making.drain(..).map(|making| making.ticket)
    }

    fn first_piece(&mut self, process: Option<u32>, text: String) -> Result<SaveResult, Refusal> {
        self.made.retain(|other| other.process != process);
        // Drops the texts of clients that gave up half-way.
        if self.made.len() >= MAX_CLIENTS {
            self.made.remove(0);
        }
        self.made.push(Text { process, text });
        self.piece(process, 0)
    }

    /// What stands behind the first `offset` bytes of the text of a client.
    pub(super) fn piece(
        &mut self,
        process: Option<u32>,
        offset: u64,
    ) -> Result<SaveResult, Refusal> {
        let invalid = |message: &str| Refusal::new(Code::InvalidParams, message);
        let index = self.made.iter().position(|text| text.process == process);
        let found = index.and_then(|index| Some((index, self.made.get(index)?)));
        let (index, Text { text, .. }) =
            found.ok_or_else(|| invalid("ask for the text from its beginning (offset 0) first"))?;
        let rest = usize::try_from(offset).ok().and_then(|offset| text.get(offset..));
        let rest = rest.ok_or_else(|| {
            invalid("\"offset\" must be the length of what has come so far, in bytes of UTF-8")
        })?;
        let piece = rest.get(..fitting(rest)).unwrap_or_default();
        let result = SaveResult { total: text.len() as u64, configuration: piece.to_owned() };
        if piece.len() == rest.len() {
            self.made.remove(index);
        }
        Ok(result)
    }
}

/// How much of a text fits into an answer, escaped as JSON.
fn fitting(text: &str) -> usize {
    let mut left = MAX_MESSAGE_BYTES - AROUND;
    for (offset, c) in text.char_indices() {
        let bytes = match c {
            '"' | '\\' | '\n' | '\r' | '\t' => 2,
            '\0'..='\u{1f}' => 6,
            c => c.len_utf8(),
        };
        let Some(rest) = left.checked_sub(bytes) else { return offset };
        left = rest;
    }
    text.len()
}

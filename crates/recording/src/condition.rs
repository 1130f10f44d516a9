//! In what state a file is.

use mcap::records::Statistics;

/// The metadata of a file that is a copy of what could be read of another one.
pub(crate) const PART: &str = "isochrone.part";

/// In what state a file is, once it was read to its end.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FileCondition {
    /// Whether its writer closed it. One that was killed did not.
    pub is_closed: bool,
    /// Whether it is a closed copy of what could be read of another file.
    pub is_of_part: bool,
    /// Records and chunks that were passed over because they are damaged.
    pub damaged: u64,
    /// The first of them.
    pub first_damage: Option<Damage>,
    /// Bytes that were passed over: what is damaged, and a record at the end that was cut off. Where a chunk is
    /// damaged within, they are those of its rest, as unpacked.
    pub unread_bytes: u64,
    /// Messages that a closed file had by what its end says, and that were not read.
    pub unread_messages: u64,
}

/// Damage of a part of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// Where it begins, in bytes from the beginning of the file.
    pub at: u64,
    /// What is wrong.
    pub what: String,
}

impl FileCondition {
    /// Whether it has everything that its writer wrote, and all of it was read.
    pub fn is_whole(&self) -> bool {
        self.is_closed && !self.is_of_part && self.damaged == 0
    }

    pub(crate) fn note(&mut self, at: u64, what: impl Into<String>) {
        self.damaged += 1;
        self.first_damage.get_or_insert_with(|| Damage { at, what: what.into() });
    }

    /// Takes note of what nothing tells yet that was found before.
    pub(crate) fn note_if_first(&mut self, at: u64, what: impl Into<String>) {
        if self.damaged == 0 {
            self.note(at, what);
        }
    }
}

/// What was read of a file, to be compared with what its end says.
#[derive(Default)]
pub(crate) struct Tally {
    pub(crate) messages: u64,
    pub(crate) chunks: u64,
    /// Of the data or the summary.
    pub(crate) is_checksum_wrong: bool,
}

impl Tally {
    /// What is wrong, if something is.
    pub(crate) fn compare(&self, said: Option<&Statistics>) -> Option<String> {
        let differs = |thing: &str, said: u64, there: u64| {
            let what = format!("its end says that it has {said} {thing}, and {there} are there");
            (said != there).then_some(what)
        };
        let by_count = said.and_then(|said| {
            let messages = differs("messages", said.message_count, self.messages);
            messages.or_else(|| differs("chunks", said.chunk_count.into(), self.chunks))
        });
        let by_sum = self.is_checksum_wrong;
        by_count.or_else(|| {
            by_sum.then(|| "a checksum is wrong, though every message can be read".into())
        })
    }
}

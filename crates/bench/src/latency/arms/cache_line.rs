//! Shared memory with a sequence counter and nothing else: the floor. A small message is one cache
//! line that one CPU writes and the other reads.

use std::fs::OpenOptions;
use std::os::unix::fs::symlink;
use std::sync::atomic::{AtomicU64, Ordering, fence};

use isochrone_ipc::ForRealTime;

use crate::latency::arm::Transport;
use crate::latency::end::{End, EndError, Opening, Rendezvous, Side, without_ports};
use crate::latency::message::{self, Header, Message};
use crate::latency::shared_words::SharedWords;

/// Where shared memory has its files.
const FOLDER: &str = "/dev/shm";
/// Tells the peer which file it is.
const LINK: &str = "cache-line";
/// CPUs fetch lines in pairs; messages that go forth and back shall not share one.
const PAIR_OF_LINES: usize = 16;

pub(super) struct CacheLine;

impl Transport for CacheLine {
    fn name(&self) -> &'static str {
        "cache_line"
    }

    fn help(&self) -> &'static str {
        "Shared memory with a sequence counter: the floor. Has room for one message; one that is \
         overwritten before it was read is lost, and no sample"
    }

    fn open(&self, place: &Rendezvous<'_>) -> Result<ForRealTime<Opening>, EndError> {
        let failed = EndError::system("share memory");
        let values = place.values;
        let words = (Slot::HEAD + values).next_multiple_of(PAIR_OF_LINES);
        let link = place.folder.join(LINK);
        let (file, name) = match place.side {
            Side::Measuring => {
                let made = tempfile::Builder::new().prefix(place.prefix).tempfile_in(FOLDER);
                let (file, name) = made.map_err(&failed)?.into_parts();
                file.set_len((2 * words * size_of::<u64>()) as u64).map_err(&failed)?;
                symlink(&name, link).map_err(&failed)?;
                (file, Some(name))
            }
            Side::Peer => {
                let file = OpenOptions::new().read(true).write(true).open(link);
                (file.map_err(&failed)?, None)
            }
        };
        let memory = SharedWords::map(&file, 2 * words).map_err(&failed)?;
        let (out_at, in_at) = match place.side {
            Side::Measuring => (0, words),
            Side::Peer => (words, 0),
        };
        Ok(without_ports(Box::new(move || {
            // Both have mapped it: the name may go.
            drop(name);
            Ok(Box::new(Slots { memory, values, out_at, in_at, sent: 0, seen: 0 }) as Box<dyn End>)
        })))
    }
}

/// Where one message stands, for one writer and one reader (a seqlock): the counter is odd while the
/// message is written, and even otherwise.
struct Slot<'a> {
    counter: &'a AtomicU64,
    sequence: &'a AtomicU64,
    sent_ns: &'a AtomicU64,
    values: &'a [AtomicU64],
}

impl<'a> Slot<'a> {
    const HEAD: usize = 1 + Header::WORDS;

    fn at(memory: &'a [AtomicU64], first: usize, values: usize) -> Option<Self> {
        match memory.get(first..first + Self::HEAD + values)? {
            [counter, sequence, sent_ns, values @ ..] => {
                Some(Self { counter, sequence, sent_ns, values })
            }
            _ => None,
        }
    }

    /// Writes a message; `before` is the counter of the one before. Returns its own.
    fn write(&self, before: u64, header: Header) -> u64 {
        self.counter.store(before + 1, Ordering::Relaxed);
        // Whoever sees a word of the message sees that it is being written.
        fence(Ordering::Release);
        self.sequence.store(header.sequence, Ordering::Relaxed);
        self.sent_ns.store(header.sent_ns, Ordering::Relaxed);
        let bits = header.value().to_bits();
        self.values.iter().for_each(|value| value.store(bits, Ordering::Relaxed));
        self.counter.store(before + 2, Ordering::Release);
        before + 2
    }

    /// Reads the message if it is whole and not the one with the counter `seen`.
    fn read(&self, seen: u64) -> Option<(u64, Message)> {
        let counter = self.counter.load(Ordering::Acquire);
        if counter == seen || counter % 2 == 1 {
            return None;
        }
        let header = Header {
            sequence: self.sequence.load(Ordering::Relaxed),
            sent_ns: self.sent_ns.load(Ordering::Relaxed),
        };
        let sum = message::sum(self.values, |value| f64::from_bits(value.load(Ordering::Relaxed)));
        fence(Ordering::Acquire);
        let unchanged = self.counter.load(Ordering::Relaxed) == counter;
        unchanged.then_some((counter, Message { header, sum }))
    }
}

struct Slots {
    memory: SharedWords,
    values: usize,
    out_at: usize,
    in_at: usize,
    /// Counter of the message that was sent last.
    sent: u64,
    /// Counter of the message that was received last.
    seen: u64,
}

impl End for Slots {
    fn send(&mut self, header: Header) -> Result<(), EndError> {
        let slot = Slot::at(&self.memory, self.out_at, self.values).ok_or(EndError::Gone)?;
        self.sent = slot.write(self.sent, header);
        Ok(())
    }

    fn receive(&mut self) -> Result<Option<Message>, EndError> {
        let slot = Slot::at(&self.memory, self.in_at, self.values).ok_or(EndError::Gone)?;
        let Some((counter, message)) = slot.read(self.seen) else { return Ok(None) };
        self.seen = counter;
        Ok(Some(message))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory(words: usize) -> Vec<AtomicU64> {
        (0..words).map(|_| AtomicU64::new(0)).collect()
    }

    #[test]
    fn a_message_is_read_once_and_only_when_it_is_whole() {
        let memory = memory(Slot::HEAD + 5);
        let slot = Slot::at(&memory, 0, 5).unwrap();
        assert!(slot.read(0).is_none(), "nothing was sent");
        let counter = slot.write(0, Header { sequence: 8, sent_ns: 9 });
        let (seen, message) = slot.read(0).unwrap();
        assert_eq!((seen, message.header.sequence), (counter, 8));
        assert!(message.is_whole(5));
        assert!(slot.read(seen).is_none(), "it was seen");
        slot.counter.store(seen + 1, Ordering::Release);
        assert!(slot.read(seen).is_none(), "the next one is being written");
    }

    #[test]
    fn memory_that_is_too_short_holds_no_message() {
        assert!(Slot::at(&memory(Slot::HEAD + 4), 0, 5).is_none());
    }

    #[test]
    fn a_message_that_is_overwritten_while_it_is_read_is_not_taken() {
        const LAST: u64 = 200_000;
        let memory = memory(Slot::HEAD + 64);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let slot = Slot::at(&memory, 0, 64).unwrap();
                let write =
                    |counter, sequence| slot.write(counter, Header { sequence, sent_ns: sequence });
                (0..=LAST).fold(0, write);
            });
            let slot = Slot::at(&memory, 0, 64).unwrap();
            let (mut seen, mut last) = (0, 0);
            while last < LAST {
                if let Some((counter, message)) = slot.read(seen) {
                    assert!(message.is_whole(64), "{message:?}");
                    assert_eq!(message.header.sequence, message.header.sent_ns);
                    assert!(message.header.sequence >= last);
                    (seen, last) = (counter, message.header.sequence);
                }
            }
        });
    }
}

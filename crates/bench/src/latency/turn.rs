//! One turn of an arm, as each of the two processes sees it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use isochrone_cyclic::{
    Clock, Cyclic, Margin, Monotonic, Schedule, ThreadUsage, Wake, thread_usage,
};
use isochrone_timing::Distribution;
use serde::{Deserialize, Serialize};

use super::end::{End, EndError, PATIENCE};
use super::message::{END, Header, Message};
use super::pace::Wait;

/// Messages that may be lost in a row before the other end counts as silent.
const MOST_SILENCES: u32 = 3;

/// When a turn begins to count, and when it is over; all `CLOCK_MONOTONIC` nanoseconds.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Span {
    pub(super) start_ns: u64,
    /// What was sent before is warm-up.
    pub(super) from_ns: u64,
    pub(super) end_ns: u64,
    /// The sequence of the first message: higher than any before, so that what a turn left over is
    /// recognised.
    pub(super) first: u64,
}

/// What both ends have agreed on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Terms {
    pub(super) values: usize,
    pub(super) wait: Wait,
}

/// Ends a wait that takes too long. Looking for a message is not to be slowed down by the clock, so
/// that is read once in many looks; a look that blocks is long enough.
struct Limit {
    give_up_ns: u64,
    looks: u32,
    looks_per_reading: u32,
}

impl Limit {
    fn after(ns: u64, wait: Wait) -> Self {
        let looks_per_reading = match wait {
            Wait::Poll => 256,
            Wait::Block => 1,
        };
        let give_up_ns = ns.saturating_add(PATIENCE.as_nanos() as u64);
        Self { give_up_ns, looks: 0, looks_per_reading }
    }

    /// Called after a look that found nothing.
    fn is_reached(&mut self) -> bool {
        self.looks = self.looks.wrapping_add(1);
        self.looks.is_multiple_of(self.looks_per_reading) && Monotonic.now_ns() > self.give_up_ns
    }
}

/// What the measuring side received after the warm-up.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Received {
    pub(super) messages: u64,
    pub(super) lost: u64,
}

/// What the other side says of its turn.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct SenderCounts {
    pub(super) messages: u64,
    /// Instants of the grid at which it could not send.
    pub(super) missed: u64,
    /// Page faults of its thread after the warm-up; `None` if the turn ended before.
    pub(super) faults: Option<u64>,
    /// Times after the warm-up that its CPU was taken away; `None` if the turn ended before.
    pub(super) preemptions: Option<u64>,
}

/// Finds gaps in the sequence.
struct Sequence {
    next: u64,
    lost: u64,
}

impl Sequence {
    /// Whether this is a message of the turn, and how many before it were lost.
    fn take(&mut self, header: Header, from_ns: u64) -> bool {
        if header.sequence < self.next {
            return false;
        }
        if header.sent_ns >= from_ns {
            self.lost += header.sequence - self.next;
        }
        self.next = header.sequence + 1;
        true
    }
}

/// Receives what the other end sends at its own pace. A sample is the time from just before the
/// sender wrote the values until they all were read.
pub(super) fn receive_paced(
    end: &mut dyn End,
    span: &Span,
    terms: Terms,
    stop: &AtomicBool,
    samples: &mut Distribution,
) -> Result<Received, EndError> {
    let mut limit = Limit::after(span.end_ns, terms.wait);
    let mut sequence = Sequence { next: span.first, lost: 0 };
    let mut messages = 0;
    while !stop.load(Ordering::Relaxed) {
        let Some(message) = end.receive()? else {
            if limit.is_reached() {
                return Err(EndError::Silent);
            }
            continue;
        };
        let received_ns = Monotonic.now_ns();
        let header = message.header;
        if header.sequence == END {
            sequence.lost += (span.first + header.sent_ns).saturating_sub(sequence.next);
            break;
        }
        check(&message, terms)?;
        if sequence.take(header, span.from_ns) && header.sent_ns >= span.from_ns {
            messages += 1;
            samples.record(received_ns.saturating_sub(header.sent_ns));
        }
    }
    Ok(Received { messages, lost: sequence.lost })
}

/// Sends at absolute instants until the turn is over.
pub(super) fn send_paced(
    end: &mut dyn End,
    span: &Span,
    period_ns: u64,
    stop: &Arc<AtomicBool>,
) -> Result<SenderCounts, EndError> {
    let schedule = Schedule::every(period_ns, Wake::Hybrid(Margin::default()));
    let mut cyclic = Cyclic::new(Monotonic, schedule, span.start_ns, stop.clone());
    let mut account = Account::default();
    let mut messages = 0;
    while let Some(release) = cyclic.wait() {
        if release.release_ns >= span.end_ns {
            break;
        }
        let header = Header { sequence: span.first + messages, sent_ns: Monotonic.now_ns() };
        end.send(header)?;
        messages += 1;
        end.prepare();
        account.note(header, span);
    }
    let missed = missed(&cyclic, span, period_ns, messages);
    let sent = account.close(SenderCounts { messages, missed, ..SenderCounts::default() });
    end.send(Header { sequence: END, sent_ns: messages })?;
    end.prepare();
    Ok(sent)
}

/// Instants of a turn at which a sender could not send that has sent so many messages.
pub(super) fn missed(
    cyclic: &Cyclic<Monotonic>,
    span: &Span,
    period_ns: u64,
    messages: u64,
) -> u64 {
    // Of the releases that a late thread skips, those after the end were not due.
    let due = span.end_ns.saturating_sub(span.start_ns).div_ceil(period_ns.max(1));
    cyclic.missed().min(due.saturating_sub(messages))
}

/// Sends a message as soon as the one before has come back. A sample is half of the time there and
/// back, as iceoryx2's own benchmark takes it; here the values are written and read in both
/// directions.
pub(super) fn ping(
    end: &mut dyn End,
    span: &Span,
    terms: Terms,
    stop: &AtomicBool,
    samples: &mut Distribution,
) -> Result<Received, EndError> {
    let mut received = Received::default();
    let mut silences = 0;
    let mut messages = 0;
    let mut now_ns = Monotonic.now_ns();
    while now_ns < span.end_ns && !stop.load(Ordering::Relaxed) {
        let header = Header { sequence: span.first + messages, sent_ns: Monotonic.now_ns() };
        end.send(header)?;
        messages += 1;
        end.prepare();
        let Some(returned_ns) = await_echo(end, header, terms)? else {
            received.lost += 1;
            silences += 1;
            if silences == MOST_SILENCES {
                return Err(EndError::Silent);
            }
            now_ns = Monotonic.now_ns();
            continue;
        };
        (silences, now_ns) = (0, returned_ns);
        if header.sent_ns >= span.from_ns {
            received.messages += 1;
            samples.record(returned_ns.saturating_sub(header.sent_ns) / 2);
        }
    }
    end.send(Header { sequence: END, sent_ns: messages })?;
    end.prepare();
    Ok(received)
}

/// When a message had come back and was read; `None` if it did not.
fn await_echo(end: &mut dyn End, sent: Header, terms: Terms) -> Result<Option<u64>, EndError> {
    let mut limit = Limit::after(sent.sent_ns, terms.wait);
    loop {
        let Some(message) = end.receive()? else {
            if limit.is_reached() {
                return Ok(None);
            }
            continue;
        };
        let now_ns = Monotonic.now_ns();
        check(&message, terms)?;
        // Another one was given up before.
        if message.header.sequence == sent.sequence {
            return Ok(Some(now_ns));
        }
    }
}

/// Sends every message back, until the other end says that the turn is over.
pub(super) fn echo(
    end: &mut dyn End,
    span: &Span,
    terms: Terms,
    stop: &AtomicBool,
) -> Result<SenderCounts, EndError> {
    let mut sent = SenderCounts::default();
    let mut account = Account::default();
    while !stop.load(Ordering::Relaxed) {
        let Some(message) = end.receive()? else { continue };
        if message.header.sequence == END {
            break;
        }
        check(&message, terms)?;
        end.send(message.header)?;
        sent.messages += 1;
        end.prepare();
        account.note(message.header, span);
    }
    Ok(account.close(sent))
}

fn check(message: &Message, terms: Terms) -> Result<(), EndError> {
    if message.is_whole(terms.values) {
        Ok(())
    } else {
        Err(EndError::Damaged {
            sequence: message.header.sequence,
            sum: message.sum,
            expected: message.expected_sum(terms.values),
        })
    }
}

/// What the thread has used since the end of the warm-up.
#[derive(Default)]
pub(super) struct Account(Option<ThreadUsage>);

impl Account {
    /// The kernel is asked so long before the end of the warm-up that no sample feels it.
    const AHEAD_NS: u64 = 1_000_000;

    pub(super) fn note(&mut self, header: Header, span: &Span) {
        if self.0.is_none() && header.sent_ns + Self::AHEAD_NS >= span.from_ns {
            self.0 = Some(thread_usage());
        }
    }

    pub(super) fn close(self, sent: SenderCounts) -> SenderCounts {
        let used = self.0.map(|before| thread_usage().since(before));
        SenderCounts {
            faults: used.map(|used| used.minor_faults + used.major_faults),
            preemptions: used.map(|used| used.involuntary_switches),
            ..sent
        }
    }
}

#[cfg(test)]
#[path = "turn_tests.rs"]
mod tests;

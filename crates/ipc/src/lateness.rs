//! How late a sleeping reader is woken, and by how much earlier it is to ask. No clock.

/// Wake-ups that it is learned from.
const REMEMBERED: usize = 8;
/// With so many, the margin is set.
const ENOUGH: usize = 4;
/// What follows a shorter sleep says nothing of longer ones: the CPU has not gone to sleep with the reader.
const SHORT_NAP_NS: u64 = 100_000;
/// By so much a reader still looks after the frame was due, for one that is a little late itself.
const BEHIND_NS: u64 = 10_000;
/// A machine that is busy wakes nobody in time; to ask earlier would cost naps and gain nothing.
const MOST_NS: u64 = 200_000;

/// Learns by how much sleeps end after the instant that was asked for. Never allocates.
#[derive(Debug, Default)]
pub(crate) struct Lateness {
    /// When the reader asked to be woken, after a nap that tells.
    asked_ns: Option<u64>,
    late_ns: [u64; REMEMBERED],
    count: usize,
    next: usize,
}

impl Lateness {
    /// Takes note of a nap that begins now.
    pub(crate) fn asked(&mut self, now_ns: u64, look_ns: u64) {
        let is_long = look_ns.saturating_sub(now_ns) >= SHORT_NAP_NS;
        self.asked_ns = is_long.then_some(look_ns);
    }

    /// Takes note of the first look after it.
    pub(crate) fn woke(&mut self, now_ns: u64) {
        let late_ns = self.asked_ns.take().and_then(|asked_ns| now_ns.checked_sub(asked_ns));
        if let (Some(late_ns), Some(oldest)) = (late_ns, self.late_ns.get_mut(self.next)) {
            *oldest = late_ns;
            self.next = (self.next + 1) % REMEMBERED;
            self.count = (self.count + 1).min(REMEMBERED);
        }
    }

    /// By how much earlier than a frame is due to ask, after a long nap: so much that three of four looks
    /// still come after it.
    pub(crate) fn margin_ns(&self) -> u64 {
        if self.count < ENOUGH {
            return 0;
        }
        let mut sorted_ns = self.late_ns;
        let known = &mut sorted_ns[..self.count];
        known.sort_unstable();
        known[self.count / 4].saturating_sub(BEHIND_NS).min(MOST_NS)
    }
}

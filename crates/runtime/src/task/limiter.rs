//! Limits repeated messages to one a second.

use std::fmt::{self, Display};
use std::time::{Duration, Instant};

const PAUSE: Duration = Duration::from_secs(1);
/// How many messages may follow each other without a pause.
const AT_ONCE: u32 = 10;

/// Lets a few messages about one thing through at once, and then one a second. The newest message that it left out is
/// not lost: it is [held](Self::held) until the pause is over.
#[derive(Debug)]
pub struct Limiter<T = String> {
    at_once: u32,
    said: u32,
    since: Option<Instant>,
    left_out: u64,
    held: Option<T>,
}

/// A message to be logged now. `Display` adds how many were left out before it.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Allowed<T = String> {
    /// The message.
    pub message: T,
    /// How many were left out before it.
    pub left_out: u64,
}

impl<T> Limiter<T> {
    /// Lets not even a few messages through at once.
    pub fn one_a_second() -> Self {
        Self { at_once: 1, ..Self::default() }
    }

    /// Returns the message if it may be logged now; otherwise holds it, in place of an earlier one.
    pub fn pass(&mut self, message: T) -> Option<Allowed<T>> {
        self.pass_at(Instant::now(), message)
    }

    /// The message that is held, if its pause is over.
    pub fn held(&mut self) -> Option<Allowed<T>> {
        self.held_at(Instant::now())
    }

    /// As [`held`](Self::held), without waiting for the end of the pause.
    pub fn take_held(&mut self) -> Option<Allowed<T>> {
        let message = self.held.take()?;
        self.left_out -= 1;
        Some(Allowed { message, left_out: std::mem::take(&mut self.left_out) })
    }

    /// The message that is held.
    pub fn holding(&self) -> Option<&T> {
        self.held.as_ref()
    }

    /// Counts a message as left out.
    pub fn leave_out(&mut self) {
        self.left_out += 1;
    }

    fn pass_at(&mut self, now: Instant, message: T) -> Option<Allowed<T>> {
        if !self.has_room(now) {
            self.left_out += 1;
            self.held = Some(message);
            return None;
        }
        self.said += 1;
        self.held = None;
        Some(Allowed { message, left_out: std::mem::take(&mut self.left_out) })
    }

    fn held_at(&mut self, now: Instant) -> Option<Allowed<T>> {
        if self.held.is_none() || !self.has_room(now) {
            return None;
        }
        self.said += 1;
        self.take_held()
    }

    fn has_room(&mut self, now: Instant) -> bool {
        let rested = self.since.map(|since| now.duration_since(since));
        if rested.is_none_or(|rested| rested >= PAUSE) {
            // After a second of quiet one more message is allowed, and a few after a longer while.
            let rested =
                rested.map_or(u32::MAX, |it| u32::try_from(it.as_secs()).unwrap_or(u32::MAX));
            self.said = self.said.saturating_sub(rested);
            self.since = Some(now);
        }
        self.said < self.at_once
    }
}

impl<T> Default for Limiter<T> {
    fn default() -> Self {
        Self { at_once: AT_ONCE, said: 0, since: None, left_out: 0, held: None }
    }
}

impl<T: Display> Display for Allowed<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { message, left_out } = self;
        match left_out {
            0 => write!(f, "{message}"),
            1 => write!(f, "{message} (1 such message was left out)"),
            _ => write!(f, "{message} ({left_out} such messages were left out)"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn a_few_messages_pass_at_once_and_then_one_a_second() {
        let (mut limiter, begin) = (Limiter::default(), Instant::now());
        let mut said = Vec::new();
        for at_ms in 0..5_000 {
            said.extend(limiter.pass_at(begin + ms(at_ms), "x").map(|it| it.to_string()));
        }
        assert_eq!(said.len(), AT_ONCE as usize + 4, "{said:?}");
        assert_eq!(said[9], "x");
        assert_eq!(said[10], "x (990 such messages were left out)");
        let later = begin + Duration::from_secs(60);
        let burst = (0..20).filter_map(|_| limiter.pass_at(later, "x")).count();
        assert_eq!(burst, AT_ONCE as usize);
    }

    #[test]
    fn the_last_message_that_was_left_out_is_said_once_after_its_pause() {
        let (mut limiter, begin) = (Limiter::default(), Instant::now());
        for number in 0..15 {
            limiter.pass_at(begin + ms(number), number);
        }
        assert_eq!(limiter.held_at(begin + ms(999)), None, "the pause is not over");
        let last = Allowed { message: 14, left_out: 4 };
        assert_eq!(limiter.held_at(begin + ms(1_000)), Some(last));
        assert_eq!(limiter.held_at(begin + ms(9_000)), None, "it was said");
        assert_eq!(
            limiter.pass_at(begin + ms(9_000), 15),
            Some(Allowed { message: 15, left_out: 0 })
        );
    }

    #[test]
    fn what_is_said_takes_the_place_of_what_was_held() {
        let (mut limiter, begin) = (Limiter::default(), Instant::now());
        for number in 0..11 {
            limiter.pass_at(begin, number);
        }
        assert_eq!(limiter.holding(), Some(&10));
        let newer = Some(Allowed { message: 11, left_out: 1 });
        assert_eq!(limiter.pass_at(begin + PAUSE, 11), newer);
        assert_eq!(limiter.take_held(), None);
    }
}

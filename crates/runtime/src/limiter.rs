//! Saying what happens again and again once a second at most.

use std::time::{Duration, Instant};

const PAUSE: Duration = Duration::from_secs(1);
/// What may be said at once, before it becomes too much.
const AT_ONCE: u32 = 10;

/// Lets a few messages through at once, and then one a second.
#[derive(Debug, Default)]
pub struct Limiter {
    said: u32,
    since: Option<Instant>,
    left_out: u64,
}

impl Limiter {
    /// The message as it is to be said, with how many were left out before it; `None`: not now.
    pub fn pass(&mut self, message: &str) -> Option<String> {
        self.pass_at(Instant::now(), message)
    }

    fn pass_at(&mut self, now: Instant, message: &str) -> Option<String> {
        let is_new = self.since.is_none_or(|since| now.duration_since(since) >= PAUSE);
        if is_new {
            // Whoever was quiet for a second may say one thing, and a few after a longer while.
            let rested = self.since.map_or(PAUSE * AT_ONCE, |since| now.duration_since(since));
            let rested = u32::try_from(rested.as_secs()).unwrap_or(u32::MAX);
            self.said = self.said.saturating_sub(rested);
            self.since = Some(now);
        }
        if self.said >= AT_ONCE {
            self.left_out += 1;
            return None;
        }
        self.said += 1;
        match std::mem::take(&mut self.left_out) {
            0 => Some(message.to_owned()),
            left_out => Some(format!("{message} ({left_out} such messages were left out)")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_messages_pass_at_once_and_then_one_a_second() {
        let (mut limiter, begin) = (Limiter::default(), Instant::now());
        let mut said = Vec::new();
        for ms in 0..5_000 {
            said.extend(limiter.pass_at(begin + Duration::from_millis(ms), "x"));
        }
        assert_eq!(said.len(), AT_ONCE as usize + 4, "{said:?}");
        assert_eq!(said[9], "x");
        assert_eq!(said[10], "x (990 such messages were left out)");
        let later = begin + Duration::from_secs(60);
        let burst = (0..20).filter_map(|_| limiter.pass_at(later, "x")).count();
        assert_eq!(burst, AT_ONCE as usize);
    }
}

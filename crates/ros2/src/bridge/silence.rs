//! When a service falls silent, or nobody publishes it at all.

use isochrone_ipc::longest_silence_ns;

use super::counts::Hearing;

/// The shortest silence that is told, in ns.
const PATIENCE_NS: u64 = 5_000_000_000;
/// Between two looks at who publishes a silent service, in ns.
const LOOK_NS: u64 = 1_000_000_000;

/// Listens whether frames come.
#[derive(Debug, Clone, Copy)]
pub(super) struct Listener {
    /// When the newest frame came, or the service was opened.
    heard_ns: u64,
    has_heard: bool,
    /// Between the two newest frames.
    gap_ns: u64,
    look_ns: u64,
}

impl Listener {
    pub(super) fn new(now_ns: u64) -> Self {
        Self { heard_ns: now_ns, has_heard: false, gap_ns: 0, look_ns: 0 }
    }

    /// A frame came.
    pub(super) fn hear(&mut self, now_ns: u64) {
        self.gap_ns = if self.has_heard { now_ns.saturating_sub(self.heard_ns) } else { 0 };
        (self.heard_ns, self.has_heard, self.look_ns) = (now_ns, true, 0);
    }

    /// What is heard now, if that is known; of a publisher that announces no period, the newest gap counts.
    pub(super) fn look(
        &mut self,
        now_ns: u64,
        period_ns: Option<u64>,
        publishers: impl FnOnce() -> usize,
    ) -> Option<Hearing> {
        if now_ns < self.look_ns {
            return None;
        }
        let patience_ns = longest_silence_ns(period_ns.unwrap_or(self.gap_ns)).max(PATIENCE_NS);
        if now_ns.saturating_sub(self.heard_ns) < patience_ns {
            return self.has_heard.then_some(Hearing::Well);
        }
        self.look_ns = now_ns + LOOK_NS;
        Some(if publishers() == 0 { Hearing::Nobody } else { Hearing::Silence })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;

    #[test]
    fn a_service_is_silent_after_some_seconds_or_three_of_its_periods() {
        let mut listener = Listener::new(0);
        assert_eq!(listener.look(4 * S, None, || 0), None);
        assert_eq!(listener.look(5 * S, None, || 0), Some(Hearing::Nobody));
        // Who publishes it is looked up once a second.
        assert_eq!(listener.look(5 * S + 1, None, || 1), None);
        assert_eq!(listener.look(6 * S, None, || 1), Some(Hearing::Silence));
        listener.hear(7 * S);
        assert_eq!(listener.look(7 * S, None, || 1), Some(Hearing::Well));
        assert_eq!(listener.look(13 * S, Some(4 * S), || 1), Some(Hearing::Well));
        assert_eq!(listener.look(19 * S, Some(4 * S), || 1), Some(Hearing::Silence));
        // Without a period, 20 s between two frames make a minute nothing to tell.
        listener.hear(27 * S);
        assert_eq!(listener.look(86 * S, None, || 1), Some(Hearing::Well));
        assert_eq!(listener.look(87 * S, None, || 1), Some(Hearing::Silence));
    }
}

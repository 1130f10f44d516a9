//! Detects that the node does not answer, long before a request gives up after seconds.

use std::sync::atomic::{AtomicU64, Ordering};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::is_stopped;

/// A node that answers is heard from at least once a second, whatever the periods of its tasks, as `describe` is
/// called that often.
const PATIENCE_NS: u64 = 1_300_000_000;

/// When the node was last heard from.
pub(super) struct Silence {
    heard_ns: AtomicU64,
    looked_ns: AtomicU64,
}

impl Silence {
    pub(super) fn new() -> Self {
        let now_ns = Monotonic.now_ns();
        Self { heard_ns: now_ns.into(), looked_ns: now_ns.into() }
    }

    /// Records an answer of the node.
    pub(super) fn end(&self) {
        self.heard_ns.store(Monotonic.now_ns(), Ordering::Relaxed);
    }

    /// Whether it lasts: longer than a second, and than `longest_wait_ns`, for which the node may let an answer wait.
    pub(super) fn lasts(&self, now_ns: u64, longest_wait_ns: u64) -> bool {
        let looked_ns = self.looked_ns.swap(now_ns, Ordering::Relaxed);
        if now_ns.saturating_sub(looked_ns) > PATIENCE_NS / 2 {
            // This program itself had no time to listen.
            self.heard_ns.store(now_ns, Ordering::Relaxed);
        }
        let silent_ns = now_ns.saturating_sub(self.heard_ns.load(Ordering::Relaxed));
        silent_ns > PATIENCE_NS.saturating_add(longest_wait_ns)
    }
}

/// The message about a node that does not answer.
pub(super) fn why(node: &str, process: Option<u32>) -> String {
    let state = isochrone_control::silence(process, process.is_some_and(is_stopped));
    format!("node \"{node}\" has said nothing for more than a second; {state}")
}

#[cfg(test)]
mod tests {
    use super::*;

    const TURN_NS: u64 = 20_000_000;

    /// When a silence that begins at 0 is noticed by who looks as often as `turn_ns`.
    fn noticed_ns(turn_ns: u64, longest_wait_ns: u64) -> Option<u64> {
        let silence = Silence { heard_ns: 0.into(), looked_ns: 0.into() };
        (1..1_000).map(|turn| turn * turn_ns).find(|now_ns| silence.lasts(*now_ns, longest_wait_ns))
    }

    #[test]
    fn a_silence_is_noticed_after_a_second_unless_an_answer_may_take_longer() {
        assert_eq!(noticed_ns(TURN_NS, 0), Some(PATIENCE_NS + TURN_NS));
        let slow = noticed_ns(TURN_NS, 3_000_000_000);
        assert!(slow > Some(3_000_000_000 + PATIENCE_NS), "{slow:?}");
    }

    #[test]
    fn who_was_stopped_itself_does_not_say_that_the_node_is_silent() {
        assert_eq!(noticed_ns(PATIENCE_NS, 0), None);
    }
}

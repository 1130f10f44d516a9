//! When no message came for too long.

/// How long a topic is silent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gap {
    longest_ns: Option<u64>,
    /// When the last message came; `None` before the first, and once the gap was told.
    since_ns: Option<u64>,
}

impl Gap {
    pub(super) fn new(longest_ns: Option<u64>) -> Self {
        Self { longest_ns, since_ns: None }
    }

    /// A message came.
    pub(super) fn message(&mut self, now_ns: u64) {
        self.since_ns = Some(now_ns);
    }

    /// When to look for a gap.
    pub(super) fn due_ns(&self) -> Option<u64> {
        Some(self.since_ns?.saturating_add(self.longest_ns?))
    }

    /// Whether it is too long since the last message: once for each gap.
    pub(super) fn begins(&mut self, now_ns: u64) -> bool {
        let begins = self.due_ns().is_some_and(|due_ns| now_ns >= due_ns);
        if begins {
            self.since_ns = None;
        }
        begins
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_is_told_once_and_not_before_the_first_message() {
        let mut gap = Gap::new(Some(100));
        assert!(!gap.begins(1_000));
        gap.message(1_000);
        assert_eq!((gap.due_ns(), gap.begins(1_099)), (Some(1_100), false));
        assert_eq!([1_100, 1_500].map(|now_ns| gap.begins(now_ns)), [true, false]);
        gap.message(2_000);
        assert!(gap.begins(2_100));
        let mut any = Gap::new(None);
        any.message(0);
        assert!(!any.begins(u64::MAX));
    }
}

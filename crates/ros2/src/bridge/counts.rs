//! What became of frames and messages.

use std::sync::atomic::{AtomicU64, Ordering};

/// The counts of a link, for whoever looks at them.
#[derive(Debug, Default)]
pub(crate) struct LinkCounts {
    /// What it links: `plant/level -> /plant/level`.
    pub(crate) name: String,
    counts: [AtomicU64; Count::ALL.len()],
}

/// What is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Count {
    /// Sent on the other side.
    Sent,
    /// Not sent because a value is NaN.
    NotANumber,
    /// Not sent because it does not fit: a value into its field, or a message to its type.
    Misfit,
    /// Not sent because of its flags.
    Bad,
    /// Refused by the other side.
    Unsent,
    /// Lost before it was received.
    Lost,
    /// Messages whose time stamps are not used: of the future, or from before the machine started.
    Stamps,
    /// How often nothing came for too long.
    Gaps,
}

impl Count {
    /// All, in the order in which they are shown.
    pub(crate) const ALL: [Self; 8] = [
        Self::Sent,
        Self::NotANumber,
        Self::Misfit,
        Self::Bad,
        Self::Unsent,
        Self::Lost,
        Self::Stamps,
        Self::Gaps,
    ];

    /// Its name.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Sent => "sent",
            Self::NotANumber => "not_a_number",
            Self::Misfit => "misfit",
            Self::Bad => "bad",
            Self::Unsent => "unsent",
            Self::Lost => "lost",
            Self::Stamps => "unused_stamps",
            Self::Gaps => "gaps",
        }
    }
}

impl LinkCounts {
    pub(crate) fn new(name: String) -> Self {
        Self { name, ..Self::default() }
    }

    /// Counts, and says whether it is the first.
    pub(crate) fn add(&self, count: Count, number: u64) -> bool {
        self.counts[count as usize].fetch_add(number, Ordering::Relaxed) == 0 && number > 0
    }

    pub(crate) fn get(&self, count: Count) -> u64 {
        self.counts[count as usize].load(Ordering::Relaxed)
    }

    /// Everything that was counted, in a line.
    pub(crate) fn text(&self) -> String {
        let others = Count::ALL.iter().skip(1).filter(|count| self.get(**count) > 0);
        let mut text = format!("{}: {} sent", self.name, self.get(Count::Sent));
        for count in others {
            text += &format!(", {} {}", self.get(*count), count.name());
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_happened_is_in_a_line_and_the_first_time_is_told() {
        let counts = LinkCounts::new("a -> /a".into());
        assert_eq!(counts.text(), "a -> /a: 0 sent");
        assert!(!counts.add(Count::Lost, 0));
        assert!(counts.add(Count::Misfit, 2));
        assert!(!counts.add(Count::Misfit, 1));
        counts.add(Count::Sent, 5);
        assert_eq!(counts.text(), "a -> /a: 5 sent, 3 misfit");
        assert_eq!(Count::ALL.map(|count| count as usize), [0, 1, 2, 3, 4, 5, 6, 7]);
    }
}

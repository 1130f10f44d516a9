//! What became of frames and messages.

use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

/// The counts of a link, for whoever looks at them.
#[derive(Debug, Default)]
pub(crate) struct LinkCounts {
    /// What it links: `plant/level -> /plant/level`.
    pub(crate) name: String,
    /// The side that it listens to.
    pub(crate) from: String,
    counts: [AtomicU64; Count::ALL.len()],
    hearing: AtomicU8,
}

/// What a link hears.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Hearing {
    /// Frames or messages, or nothing for a short time only.
    Well,
    /// Nothing, and nobody is there to send anything.
    Nobody,
    /// Nothing from whoever is there.
    Silence,
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
    pub(crate) fn new(from: &str, to: &str) -> Self {
        Self { name: format!("{from} -> {to}"), from: from.to_owned(), ..Self::default() }
    }

    /// What it hears from now on.
    pub(super) fn hears(&self, hearing: Hearing) {
        self.hearing.store(hearing as u8, Ordering::Relaxed);
    }

    /// What it hears.
    pub(crate) fn hearing(&self) -> Hearing {
        match self.hearing.load(Ordering::Relaxed) {
            0 => Hearing::Well,
            1 => Hearing::Nobody,
            _ => Hearing::Silence,
        }
    }

    /// Counts what does not cross, and logs the first of it.
    pub(super) fn dropped(&self, count: Count, number: u64, what: impl FnOnce() -> String) {
        if self.add(count, number) {
            tracing::warn!("{}: {}; more of this is only counted", self.name, what());
        }
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
        let counts = LinkCounts::new("a", "/a");
        assert_eq!(counts.text(), "a -> /a: 0 sent");
        assert!(!counts.add(Count::Lost, 0));
        assert!(counts.add(Count::Misfit, 2));
        assert!(!counts.add(Count::Misfit, 1));
        counts.add(Count::Sent, 5);
        assert_eq!(counts.text(), "a -> /a: 5 sent, 3 misfit");
        for hearing in [Hearing::Nobody, Hearing::Silence, Hearing::Well] {
            counts.hears(hearing);
            assert_eq!(counts.hearing(), hearing);
        }
        assert_eq!(Count::ALL.map(|count| count as usize), [0, 1, 2, 3, 4, 5, 6, 7]);
    }
}

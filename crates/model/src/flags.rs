//! The quality of values, as flags.

use std::fmt;
use std::ops::{BitAnd, BitOr, BitOrAssign};

/// Qualifiers of values, as a set; the empty one qualifies nothing, and is what a plain publisher
/// sends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Flags(u64);

impl Flags {
    /// Nothing to say.
    pub const NONE: Self = Self(0);
    /// A source is older than its `max_age`.
    pub const STALE: Self = Self(1);
    /// A source reads its default or a safe value instead of a sample: none came yet, or `on_stale`
    /// replaced it.
    pub const SUBSTITUTE: Self = Self(1 << 1);
    /// A source's newest sample could not be taken; the one before stays.
    pub const REJECTED: Self = Self(1 << 2);
    /// A force acts on a signal, or upstream of it, in this node or in one before.
    pub const FORCED: Self = Self(1 << 3);
    /// The frame that a source came from was [in doubt](Self::is_in_doubt).
    pub const UPSTREAM: Self = Self(1 << 4);
    /// A block upstream of a signal reports an error.
    pub const ERROR: Self = Self(1 << 5);
    /// The sender's last frame: it ends.
    pub const STOPPED: Self = Self(1 << 6);
    /// An input of the task begins with its value of an earlier run, and no sample has come for it yet.
    pub const RESTORED: Self = Self(1 << 7);

    /// Every flag with its word, in the order of the bits.
    pub const ALL: [(Self, &'static str); 8] = [
        (Self::STALE, "STALE"),
        (Self::SUBSTITUTE, "SUBSTITUTE"),
        (Self::REJECTED, "REJECTED"),
        (Self::FORCED, "FORCED"),
        (Self::UPSTREAM, "UPSTREAM"),
        (Self::ERROR, "ERROR"),
        (Self::STOPPED, "STOPPED"),
        (Self::RESTORED, "RESTORED"),
    ];

    /// Those that make what is computed from a frame [`UPSTREAM`](Self::UPSTREAM).
    const IN_DOUBT: Self = Self(
        Self::STALE.0
            | Self::SUBSTITUTE.0
            | Self::REJECTED.0
            | Self::ERROR.0
            | Self::UPSTREAM.0
            | Self::RESTORED.0,
    );

    /// The flags of a header's word. Bits that are not known yet are kept.
    pub const fn from_bits(bits: u64) -> Self {
        Self(bits)
    }

    /// The word for a header.
    pub const fn bits(self) -> u64 {
        self.0
    }

    /// Whether there is nothing to say.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether all of `other` are set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// These but not those of `other`.
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Whether values with these flags are in doubt: `STALE`, `SUBSTITUTE`, `REJECTED`, `ERROR`,
    /// `UPSTREAM` or `RESTORED`.
    pub const fn is_in_doubt(self) -> bool {
        self.0 & Self::IN_DOUBT.0 != 0
    }

    /// The flags that a reader of a frame with these flags passes on to the values that it computes from it.
    pub const fn handed_on(self) -> Self {
        let upstream = if self.is_in_doubt() { Self::UPSTREAM.0 } else { 0 };
        Self(self.0 & Self::FORCED.0 | upstream)
    }

    /// The words of the flags that are set; a bit without a name is `BIT8` and so on.
    pub fn words(self) -> impl Iterator<Item = String> {
        let set = move |bit: &u32| self.0 >> bit & 1 == 1;
        (0..u64::BITS).filter(set).map(|bit| {
            let named = Self::ALL.iter().find(|(flag, _)| flag.0 == 1 << bit);
            named.map_or_else(|| format!("BIT{bit}"), |(_, word)| (*word).to_owned())
        })
    }
}

impl BitOr for Flags {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for Flags {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl BitAnd for Flags {
    type Output = Self;

    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl fmt::Display for Flags {
    /// The words, with blanks between them; nothing for no flag.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, word) in self.words().enumerate() {
            let blank = if index == 0 { "" } else { " " };
            write!(f, "{blank}{word}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flag_is_one_bit_of_its_own_in_the_order_of_the_contract() {
        for (bit, (flag, word)) in Flags::ALL.into_iter().enumerate() {
            assert_eq!(flag.bits(), 1 << bit);
            assert_eq!(flag.to_string(), word);
        }
    }

    #[test]
    fn a_bit_that_nobody_knows_yet_is_shown_by_its_number() {
        let flags = Flags::from_bits(1 << 40 | 1 << 3);
        assert_eq!(flags.to_string(), "FORCED BIT40");
        assert_eq!(flags.bits(), 1 << 40 | 1 << 3);
        assert_eq!(Flags::NONE.to_string(), "");
    }

    #[test]
    fn doubt_is_handed_on_as_upstream_and_a_force_as_itself() {
        for (flag, word) in Flags::ALL {
            let expected = match flag {
                Flags::FORCED => Flags::FORCED,
                // The end of a sender says nothing of what it sent.
                Flags::STOPPED => Flags::NONE,
                _ => Flags::UPSTREAM,
            };
            assert_eq!(flag.handed_on(), expected, "{word}");
        }
        assert_eq!((Flags::FORCED | Flags::ERROR).handed_on(), Flags::FORCED | Flags::UPSTREAM);
        assert_eq!(Flags::from_bits(1 << 20).handed_on(), Flags::NONE);
    }
}

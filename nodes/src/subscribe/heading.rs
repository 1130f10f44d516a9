//! The line above the live values, as wide as the terminal.

use super::received::{ReceivedFrame, age, doubts};
use super::silence::{Cause, Silence};
use crate::top::cut;

/// The heading above the values of a frame.
pub(super) struct Heading<'a> {
    pub(super) service: &'a str,
    /// Who writes the frames; empty if nobody says.
    pub(super) publisher: &'a str,
    pub(super) frame: &'a ReceivedFrame,
    pub(super) silence: Option<Silence>,
}

impl Heading<'_> {
    /// The line, of at most this many characters. The quality of the values, at its end, is the last to be cut.
    pub(super) fn line(&self, columns: usize) -> String {
        let from = match self.publisher {
            "" => String::new(),
            publisher => format!(" from \"{publisher}\""),
        };
        let header = &self.frame.receipt.header;
        let (frame, cycle) =
            (format!("frame {}", header.sequence), format!("cycle {}", header.cycle));
        let worth = self.worth();
        let name = format!("\"{}\"", self.service);
        let lines = [
            format!("{name}{from}: {frame}, {cycle}, {worth}"),
            format!("{name}: {frame}, {cycle}, {worth}"),
            format!("{name}: {frame}, {worth}"),
            format!("{name}: {worth}"),
        ];
        let fits = |line: &String| line.chars().count() <= columns;
        lines.into_iter().find(fits).unwrap_or_else(|| {
            match columns.checked_sub(worth.chars().count() + 2) {
                Some(room) if room > 1 => format!("{}: {worth}", cut(&name, room)),
                // The flags say why it is in doubt.
                _ if !fits(&worth) => cut(self.flags().trim_start(), columns).into_owned(),
                _ => worth,
            }
        })
    }

    fn flags(&self) -> String {
        doubts(&self.frame.receipt, " ")
    }

    /// How old the values are, or for how long none came, and their flags.
    fn worth(&self) -> String {
        let flags = self.flags();
        let Some(silence) = self.silence else {
            return format!("age {}{flags}", age(&self.frame.receipt));
        };
        let cause = match silence.cause {
            Cause::NoPublisher => " (no publisher)",
            Cause::Link => " (nothing through the link)",
            // Its flag says it.
            Cause::Stopped | Cause::Unknown => "",
        };
        format!("no frame for {} s{cause}{flags}", silence.seconds())
    }
}

#[cfg(test)]
mod tests {
    use isochrone_ipc::{Flags, FrameHeader, Receipt};

    use super::*;

    fn line(flags: Flags, silence: Option<Silence>, columns: usize) -> String {
        let header = FrameHeader {
            sequence: 14_845_123,
            cycle: 14_862_999,
            publish_ns: 100_000,
            flags: flags.bits(),
            ..FrameHeader::default()
        };
        let receipt = Receipt { header, received_ns: 117_900, ..Receipt::default() };
        let frame = ReceivedFrame { receipt, values: Vec::new() };
        Heading { service: "plant/level", publisher: "level", frame: &frame, silence }.line(columns)
    }

    #[test]
    fn flags_are_never_cut_off_at_eighty_columns() {
        for bits in 0..1 << 8 {
            let flags = Flags::from_bits(bits);
            for silence in
                [None, Some(Silence { for_ns: 86_400_000_000_000, cause: Cause::Stopped })]
            {
                let line = line(flags, silence, 80);
                assert!(line.chars().count() <= 80, "{line}");
                // With all flags at once, the name gives way, and then all else.
                let is_named = line.starts_with('"');
                let is_rest = ["no frame for 86400 s [", "age ", "["]
                    .iter()
                    .any(|rest| line.starts_with(rest));
                assert!(is_named || is_rest, "{line}");
                assert!(flags.is_empty() || line.ends_with(&format!("[{flags}]")), "{line}");
            }
        }
    }

    #[test]
    fn a_wide_terminal_shows_everything() {
        assert_eq!(
            line(Flags::STALE, None, 100),
            "\"plant/level\" from \"level\": frame 14845123, cycle 14862999, age 17.9 us [STALE]"
        );
    }

    #[test]
    fn instead_of_an_age_that_stands_still_the_line_says_how_long_nothing_came() {
        let silence = Silence { for_ns: 12_300_000_000, cause: Cause::NoPublisher };
        assert_eq!(
            line(Flags::NONE, Some(silence), 80),
            "\"plant/level\": frame 14845123, cycle 14862999, no frame for 12 s (no publisher)"
        );
    }
}

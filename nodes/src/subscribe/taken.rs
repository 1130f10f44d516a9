//! A frame that was received, and when.

use isochrone_ipc::{FrameHeader, Stamps};

/// A frame that was received.
pub(super) struct Taken {
    pub(super) header: FrameHeader,
    /// How many values it has.
    pub(super) channels: usize,
    /// The values, where they are wanted.
    pub(super) values: Vec<f64>,
    pub(super) received_ns: u64,
    pub(super) stamps: Stamps,
    /// Count of frames, from 1.
    pub(super) number: u64,
}

impl Taken {
    /// When the cycle of a frame was due, or the nearest to it that is known on this clock.
    pub(super) fn due_ns(&self) -> u64 {
        let FrameHeader { release_ns, publish_ns, .. } = self.header;
        match self.stamps {
            Stamps::Believed if (1..=publish_ns).contains(&release_ns) => release_ns,
            Stamps::Believed => publish_ns,
            Stamps::Future | Stamps::Foreign => self.received_ns,
        }
    }

    /// The flags of the frame behind `before`, in square brackets; nothing if it has none.
    pub(super) fn doubts(&self, before: &str) -> String {
        match self.header.flags() {
            flags if flags.is_empty() => String::new(),
            flags => format!("{before}[{flags}]"),
        }
    }

    /// How old a frame was when it came.
    pub(super) fn age(&self) -> String {
        match self.stamps {
            Stamps::Believed => {
                let age_ns = self.received_ns.saturating_sub(self.header.publish_ns);
                format!("{:.1} us", age_ns as f64 / 1e3)
            }
            Stamps::Future | Stamps::Foreign => "- us".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(release_ns: u64, publish_ns: u64, stamps: Stamps) -> Taken {
        let header = FrameHeader { release_ns, publish_ns, ..FrameHeader::default() };
        Taken { header, channels: 0, values: Vec::new(), received_ns: 900, stamps, number: 1 }
    }

    #[test]
    fn the_time_of_a_frame_is_that_of_its_cycle_where_the_writer_says_and_is_believed() {
        assert_eq!(taken(700, 800, Stamps::Believed).due_ns(), 700);
        assert_eq!(taken(0, 800, Stamps::Believed).due_ns(), 800);
        assert_eq!(taken(5000, 800, Stamps::Believed).due_ns(), 800);
        assert_eq!(taken(700, 800, Stamps::Foreign).due_ns(), 900);
        assert_eq!(taken(700, 99999, Stamps::Future).due_ns(), 900);
    }
}

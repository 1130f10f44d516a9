//! A frame that was received, and when.

use isochrone_ipc::{Announcement, FrameHeader, LayoutWatcher, SenderClock, Stamps, ipc};

/// How long a frame waits for its layout before it is shown without names. Whoever announces one does
/// so within half of it.
const PATIENCE_NS: u64 = 1_000_000_000;
/// Most frames that wait.
const MOST_WAITING: usize = 65_536;

/// A frame that was received.
pub(crate) struct Taken {
    pub(crate) header: FrameHeader,
    /// How many values it has.
    pub(crate) channels: usize,
    /// The values, where they are wanted.
    pub(crate) values: Vec<f64>,
    pub(crate) received_ns: u64,
    pub(crate) stamps: Stamps,
    /// Count of frames, from 1.
    pub(crate) number: u64,
}

impl Taken {
    /// When the cycle of a frame was due, or the nearest to it that is known on this clock.
    pub(crate) fn due_ns(&self) -> u64 {
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

    /// How old the frame was when it came; `None` if its stamps are of another clock.
    pub(super) fn age_ns(&self) -> Option<u64> {
        match self.stamps {
            Stamps::Believed => Some(self.received_ns.saturating_sub(self.header.publish_ns)),
            Stamps::Future | Stamps::Foreign => None,
        }
    }

    /// The same for people.
    pub(super) fn age(&self) -> String {
        match self.age_ns() {
            Some(age_ns) => format!("{:.1} us", age_ns as f64 / 1e3),
            None => "- us".to_owned(),
        }
    }
}

/// Whether a frame waits no longer for what is announced of it, as one of so many that wait.
pub(crate) fn is_settled(
    watcher: &LayoutWatcher<ipc::Service>,
    layout: u64,
    waited_ns: u64,
    waiting: usize,
) -> bool {
    let is_known = layout == 0 || watcher.find(layout).is_some();
    is_known || waited_ns >= PATIENCE_NS || waiting >= MOST_WAITING
}

/// What the stamps of a frame are worth, by what is announced of it.
pub(crate) fn stamps(
    watcher: &LayoutWatcher<ipc::Service>,
    header: &FrameHeader,
    received_ns: u64,
) -> Stamps {
    let announced = watcher.find(header.layout);
    let clock = announced.map_or(SenderClock::Shared, Announcement::clock);
    header.credible(clock, received_ns).stamps
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

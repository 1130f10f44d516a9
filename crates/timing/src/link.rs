//! The timing of one stream of frames, as its receiver sees it.

use crate::distribution::{Distribution, encoded};
use crate::report::LinkReport;

/// One received frame, all times in ns on one clock.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FrameRecord {
    /// The publisher's count of frames.
    pub sequence: u64,
    /// Just before the frame was sent.
    pub publish_ns: u64,
    /// When the oldest input behind the frame was published; 0 if there is none.
    pub source_ns: u64,
    /// When the frame was received.
    pub received_ns: u64,
}

/// Takes in the frames of one service, in the order in which they were received.
///
/// A gap in the sequence is a loss. A sequence that does not rise is a publisher that began anew:
/// a restart, and no loss. What was published before the first frame, or by a new publisher before
/// the first frame of its that was received, is not counted.
///
/// - *one-way*: received minus published. *End to end*: received minus source, of the frames that
///   have one. A receiver that polls adds its own waiting to both. *Age at publish*: published
///   minus source.
#[derive(Debug, Clone)]
pub struct LinkTiming {
    frames: u64,
    lost: u64,
    restarts: u64,
    first_received_ns: u64,
    last: Option<FrameRecord>,
    one_way: Distribution,
    end_to_end: Distribution,
    age_at_publish: Distribution,
}

impl LinkTiming {
    /// A link that has received nothing yet.
    pub fn new() -> Self {
        Self {
            frames: 0,
            lost: 0,
            restarts: 0,
            first_received_ns: 0,
            last: None,
            one_way: Distribution::new(),
            end_to_end: Distribution::new(),
            age_at_publish: Distribution::new(),
        }
    }

    /// Takes in the next frame.
    pub fn record(&mut self, frame: &FrameRecord) {
        match self.last.replace(*frame) {
            None => self.first_received_ns = frame.received_ns,
            Some(last) if frame.sequence > last.sequence => {
                self.lost = self.lost.saturating_add(frame.sequence - last.sequence - 1);
            }
            Some(_) => self.restarts += 1,
        }
        self.frames += 1;
        self.one_way.record(frame.received_ns.saturating_sub(frame.publish_ns));
        if frame.source_ns != 0 {
            self.end_to_end.record(frame.received_ns.saturating_sub(frame.source_ns));
            self.age_at_publish.record(frame.publish_ns.saturating_sub(frame.source_ns));
        }
    }

    /// Frames received.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Frames that were published and not received.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Times that a publisher began anew.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }

    /// Frames received per second, between the first and the last; `None` before the second.
    pub fn rate_hz(&self) -> Option<f64> {
        let elapsed_ns = self.last?.received_ns.saturating_sub(self.first_received_ns);
        (elapsed_ns > 0).then(|| (self.frames - 1) as f64 * 1e9 / elapsed_ns as f64)
    }

    /// The report of the link to this service.
    pub fn report(&self, service: impl Into<String>) -> LinkReport {
        LinkReport {
            service: service.into(),
            frames: self.frames,
            lost: self.lost,
            restarts: self.restarts,
            rate_hz: self.rate_hz(),
            one_way_ns: self.one_way.summary(),
            end_to_end_ns: self.end_to_end.summary(),
            age_at_publish_ns: self.age_at_publish.summary(),
            histograms: encoded([
                ("one_way_ns", &self.one_way),
                ("end_to_end_ns", &self.end_to_end),
                ("age_at_publish_ns", &self.age_at_publish),
            ]),
            ..LinkReport::default()
        }
    }
}

impl Default for LinkTiming {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn link(frames: impl IntoIterator<Item = FrameRecord>) -> LinkTiming {
        let mut link = LinkTiming::new();
        frames.into_iter().for_each(|frame| link.record(&frame));
        link
    }

    fn sequences(sequences: impl IntoIterator<Item = u64>) -> LinkTiming {
        link(
            sequences
                .into_iter()
                .map(|sequence| FrameRecord { sequence, ..FrameRecord::default() }),
        )
    }

    #[test]
    fn a_gap_in_the_sequence_is_a_loss_of_exactly_that_many() {
        let link = sequences([0, 1, 5, 6, 8]);
        assert_eq!((link.frames(), link.lost(), link.restarts()), (5, 4, 0));
    }

    #[test]
    fn joining_a_running_publisher_is_no_loss() {
        assert_eq!(sequences([1_000, 1_001]).lost(), 0);
    }

    #[test]
    fn a_sequence_that_goes_back_is_a_restart_and_no_loss() {
        let link = sequences([10, 11, 0, 1, 3]);
        assert_eq!((link.lost(), link.restarts()), (1, 1));
    }

    #[test]
    fn a_publisher_that_restarts_before_each_frame_is_seen() {
        assert_eq!(sequences([0, 0, 0]).restarts(), 2);
    }

    #[test]
    fn one_way_counts_from_publishing_and_end_to_end_from_the_source() {
        let frame =
            FrameRecord { sequence: 0, publish_ns: 1_000, source_ns: 400, received_ns: 1_250 };
        let report = link([frame]).report("plant/level");
        assert_eq!(report.one_way_ns.max, Some(250));
        assert_eq!(report.end_to_end_ns.max, Some(850));
        assert_eq!(report.age_at_publish_ns.max, Some(600));
    }

    #[test]
    fn a_frame_without_a_source_has_no_end_to_end_time() {
        let report = sequences([0, 1]).report("plant/level");
        assert_eq!(report.one_way_ns.count, 2);
        assert_eq!(report.end_to_end_ns.count, 0);
    }

    #[test]
    fn the_rate_is_of_the_intervals_between_frames() {
        let at =
            |sequence, received_ns| FrameRecord { sequence, received_ns, ..FrameRecord::default() };
        assert_eq!(link([at(0, 500)]).rate_hz(), None);
        let rate_hz = link((0..11).map(|k| at(k, 500 + k * 1_000_000))).rate_hz();
        assert_eq!(rate_hz, Some(1_000.0));
    }

    proptest! {
        #[test]
        fn received_and_lost_frames_add_up_to_those_published(
            received in prop::collection::btree_set(0u64..1_000, 1..200),
        ) {
            let published = received.last().unwrap() - received.first().unwrap() + 1;
            let link = sequences(received);
            prop_assert_eq!(link.frames() + link.lost(), published);
            prop_assert_eq!(link.restarts(), 0);
        }
    }
}

//! The timing of one stream of frames, as its receiver sees it.

use crate::distribution::{Distribution, encoded};
use crate::link_report::{Direction, LinkReport};
use crate::metric::Metric;

/// One received frame; all times in ns of one clock.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FrameRecord {
    /// Time just before the frame was sent.
    pub publish_ns: u64,
    /// Publish time of the oldest sample behind the frame, at the start of its path; 0 if there is
    /// none.
    pub source_ns: u64,
    /// Time when the frame was received.
    pub received_ns: u64,
}

/// Computes the timing of one service from its frames, in the order of their arrival.
///
/// - *one-way*, the last hop: received minus published. *End to end*: received minus source, for
///   frames that have one: the whole path through all nodes. A receiver that polls adds its own
///   waiting time to both. *Age at publish*: published minus source.
/// - A frame with a publish time after its receive time carries the stamp of another clock. It is
///   counted, and no latency is computed from it.
///
/// The subscriber counts losses and restarts, because it knows the writers.
#[derive(Debug, Clone)]
pub struct LinkTiming {
    frames: u64,
    future_stamps: u64,
    first_received_ns: u64,
    last_received_ns: u64,
    one_way: Distribution,
    end_to_end: Distribution,
    age_at_publish: Distribution,
}

impl LinkTiming {
    /// A link that has not received anything yet.
    pub fn new() -> Self {
        Self {
            frames: 0,
            future_stamps: 0,
            first_received_ns: 0,
            last_received_ns: 0,
            one_way: Distribution::new(),
            end_to_end: Distribution::new(),
            age_at_publish: Distribution::new(),
        }
    }

    /// Counts a frame whose times come from another clock, without computing its latency.
    pub fn count(&mut self, received_ns: u64) {
        if self.frames == 0 {
            self.first_received_ns = received_ns;
        }
        self.last_received_ns = received_ns;
        self.frames += 1;
    }

    /// Adds the next frame.
    pub fn record(&mut self, frame: &FrameRecord) {
        self.count(frame.received_ns);
        if frame.publish_ns > frame.received_ns {
            self.future_stamps += 1;
            return;
        }
        self.one_way.record(frame.received_ns.saturating_sub(frame.publish_ns));
        if (1..=frame.publish_ns).contains(&frame.source_ns) {
            self.end_to_end.record(frame.received_ns.saturating_sub(frame.source_ns));
            self.age_at_publish.record(frame.publish_ns.saturating_sub(frame.source_ns));
        }
    }

    /// Number of frames received.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Frames whose `publish_ns` was in the receiver's future.
    pub fn future_stamps(&self) -> u64 {
        self.future_stamps
    }

    /// Frames received per second, between the first and the last; `None` before the second frame.
    pub fn rate_hz(&self) -> Option<f64> {
        let elapsed_ns = self.last_received_ns.saturating_sub(self.first_received_ns);
        (elapsed_ns > 0).then(|| (self.frames - 1) as f64 * 1e9 / elapsed_ns as f64)
    }

    /// The report of the link to `service`.
    pub fn report(&self, service: impl Into<String>) -> LinkReport {
        LinkReport {
            service: service.into(),
            frames: self.frames,
            direction: Some(Direction::Received),
            future_stamps: Some(self.future_stamps),
            rate_hz: self.rate_hz(),
            one_way_ns: self.one_way.summary(),
            end_to_end_ns: self.end_to_end.summary(),
            age_at_publish_ns: self.age_at_publish.summary(),
            histograms: encoded([
                (Metric::ONE_WAY.key, &self.one_way),
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
    use super::*;

    fn link(frames: impl IntoIterator<Item = FrameRecord>) -> LinkTiming {
        let mut link = LinkTiming::new();
        frames.into_iter().for_each(|frame| link.record(&frame));
        link
    }

    #[test]
    fn one_way_counts_from_publishing_and_end_to_end_from_the_source() {
        let frame = FrameRecord { publish_ns: 1_000, source_ns: 400, received_ns: 1_250 };
        let report = link([frame]).report("plant/level");
        assert_eq!(report.one_way_ns.max, Some(250));
        assert_eq!(report.end_to_end_ns.max, Some(850));
        assert_eq!(report.age_at_publish_ns.max, Some(600));
    }

    #[test]
    fn a_frame_without_a_source_has_no_end_to_end_time() {
        let report = link([FrameRecord::default(); 2]).report("plant/level");
        assert_eq!(report.one_way_ns.count, 2);
        assert_eq!(report.end_to_end_ns.count, 0);
    }

    #[test]
    fn the_rate_is_of_the_intervals_between_frames() {
        let at = |received_ns| FrameRecord { received_ns, ..FrameRecord::default() };
        assert_eq!(link([at(500)]).rate_hz(), None);
        let rate_hz = link((0..11).map(|k| at(500 + k * 1_000_000))).rate_hz();
        assert_eq!(rate_hz, Some(1_000.0));
    }

    #[test]
    fn a_frame_from_the_future_is_counted_and_no_time_is_taken_of_it() {
        let at = |publish_ns| FrameRecord { publish_ns, source_ns: 1, received_ns: 1_000 };
        let link = link([at(1_001), at(u64::MAX), at(1_000)]);
        assert_eq!((link.frames(), link.future_stamps()), (3, 2));
        let report = link.report("plant/level");
        assert_eq!((report.future_stamps, report.one_way_ns.count), (Some(2), 1));
        assert_eq!(report.end_to_end_ns.count, 1);
    }

    #[test]
    fn a_source_after_its_frame_is_none() {
        let frame = FrameRecord { publish_ns: 1_000, source_ns: 1_100, received_ns: 1_250 };
        assert_eq!(link([frame]).report("plant/level").end_to_end_ns.count, 0);
    }
}

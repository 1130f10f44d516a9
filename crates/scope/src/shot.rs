//! A captured shot.

use crate::{Head, Rows};

/// A signal that is shown.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TrackSignal {
    /// Its name, such as `ramp.delayedValue`.
    pub name: String,
    /// Its unit; empty where nobody says.
    pub unit: String,
    /// Its type, such as `LREAL` or `BOOL`; empty where nobody says.
    pub value_type: String,
}

impl TrackSignal {
    /// Whether it is on or off.
    pub fn is_digital(&self) -> bool {
        self.value_type == "BOOL"
    }
}

/// The signals of one task.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Track {
    /// The task, or the service that the rows are frames of.
    pub task: String,
    /// From one cycle to the next, in ns, if that is known.
    pub period_ns: Option<u64>,
    /// One for each value of a row.
    pub signals: Vec<TrackSignal>,
    /// One for each cycle.
    pub rows: Rows,
    /// Whether there are rows before these, so that nothing is missing at the beginning but what is counted.
    pub has_history: bool,
    /// The first row behind these, if there is one.
    pub next: Option<Head>,
}

/// Signals over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shot {
    /// Where it is from: a node.
    pub node: String,
    /// One for each task.
    pub tracks: Vec<Track>,
    /// The instant that it was captured around, if there was one.
    pub trigger: Option<Triggered>,
    /// The first instant that was wanted, in ns. What a track lacks from here on is a gap.
    pub begin_ns: u64,
    /// The instant up to which it was wanted.
    pub end_ns: u64,
}

/// That a trigger came.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Triggered {
    /// The task of its signal.
    pub task: String,
    /// The first cycle in which the condition is true.
    pub cycle: u64,
    /// When that cycle was due, in ns.
    pub release_ns: u64,
    /// The trigger as it is written.
    pub text: String,
    /// The signal that was looked at.
    pub signal: String,
    /// The level that the signal was compared with, if it was.
    pub level: Option<f64>,
    /// How many rows are missing immediately before that cycle: the condition may have become true in one
    /// of them.
    pub lost: u64,
}

/// A time for which there are no values, or for which they held because the task missed cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// From here, in ns.
    pub begin_ns: u64,
    /// To here.
    pub end_ns: u64,
}

impl Shot {
    /// The instant that times are counted from: that of the trigger, or the first one.
    pub fn zero_ns(&self) -> u64 {
        self.trigger.as_ref().map_or(self.begin_ns, |trigger| trigger.release_ns)
    }

    /// How long it is, in ns.
    pub fn duration_ns(&self) -> u64 {
        self.end_ns.saturating_sub(self.begin_ns)
    }

    /// Rows of all tracks that are missing, and cycles that their tasks missed.
    pub fn missing(&self) -> (u64, u64) {
        let heads = self.tracks.iter().flat_map(|track| track.rows.heads());
        heads.fold((0, 0), |(lost, missed): (u64, u64), head| {
            (lost.saturating_add(head.lost), missed.saturating_add(head.missed))
        })
    }

    /// The times for which a track has no values, in their order.
    pub fn gaps(&self, track: &Track) -> Vec<Gap> {
        let (before, after) = self.lacks(track);
        let lost = track.after(|head| head.lost > 0, self.end_ns);
        before.into_iter().chain(lost).chain(after).collect()
    }

    /// The times for which a track's task missed cycles, in their order.
    pub fn missed(&self, track: &Track) -> Vec<Gap> {
        track.after(|head| head.missed > 0 && head.lost == 0, self.end_ns).collect()
    }

    /// By how much the history of a track is shorter than it was wanted, and by how much it ends too early,
    /// in ns: the most of all tracks.
    pub fn shortened_ns(&self) -> (u64, u64) {
        let long = |gap: Option<Gap>| gap.map_or(0, |it| it.end_ns.saturating_sub(it.begin_ns));
        let each = self.tracks.iter().map(|track| self.lacks(track));
        each.fold((0, 0), |(begin, end), (before, after)| {
            (begin.max(long(before)), end.max(long(after)))
        })
    }

    /// Whether no track goes on to the end.
    pub fn ends_early(&self) -> bool {
        self.tracks.iter().all(|track| self.lacks(track).1.is_some())
    }

    /// What a track lacks at the beginning and at the end, because it was not looked at there.
    pub fn lacks(&self, track: &Track) -> (Option<Gap>, Option<Gap>) {
        let Track { period_ns, rows, .. } = track;
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
            return (None, Some(Gap { begin_ns: self.begin_ns, end_ns: self.end_ns }));
        };
        let period_ns = period_ns.unwrap_or_default();
        // Two tasks begin their cycles at different instants: less than a cycle is no gap.
        let gap = |begin_ns: u64, end_ns: u64| {
            let is_gap = end_ns > begin_ns.saturating_add(period_ns.max(1));
            is_gap.then_some(Gap { begin_ns, end_ns })
        };
        let before = gap(self.begin_ns, first.release_ns).filter(|_| !track.has_history);
        let after = gap(last.release_ns.saturating_add(period_ns), self.end_ns);
        (before, after.filter(|_| track.next.is_none()))
    }
}

impl Track {
    /// The times before those rows that are so, each from the end of the cycle before.
    fn after(&self, is_so: impl Fn(&Head) -> bool, end_ns: u64) -> impl Iterator<Item = Gap> {
        let period_ns = self.period_ns.unwrap_or_default();
        let heads = || self.rows.heads().chain(&self.next);
        heads().zip(heads().skip(1)).filter(move |(_, head)| is_so(head)).filter_map(
            move |(before, head)| {
                let end_ns = head.release_ns.min(end_ns);
                let begin_ns = before.release_ns.saturating_add(period_ns).min(head.release_ns);
                (begin_ns < end_ns).then_some(Gap { begin_ns, end_ns })
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shot(heads: &[Head]) -> Shot {
        let mut rows = Rows::new(0);
        heads.iter().for_each(|head| rows.push(*head, &[]));
        let track = Track { period_ns: Some(10), rows, ..Track::default() };
        Shot { tracks: vec![track], begin_ns: 100, end_ns: 200, ..Shot::default() }
    }

    fn head(release_ns: u64, lost: u64, missed: u64) -> Head {
        Head { cycle: release_ns / 10, release_ns, lost, missed }
    }

    fn gap(begin_ns: u64, end_ns: u64) -> Gap {
        Gap { begin_ns, end_ns }
    }

    #[test]
    fn what_is_missing_at_the_ends_and_in_between_is_a_gap_and_less_than_a_cycle_is_none() {
        let whole: Vec<Head> = (0..10).map(|cycle| head(104 + 10 * cycle, 0, 0)).collect();
        let all = shot(&whole);
        assert_eq!(all.gaps(&all.tracks[0]), []);
        assert_eq!((all.missing(), all.shortened_ns()), ((0, 0), (0, 0)));
        let holed = shot(&[head(130, 0, 0), head(140, 0, 0), head(170, 1, 1)]);
        let gaps = [gap(100, 130), gap(150, 170), gap(180, 200)];
        assert_eq!(holed.gaps(&holed.tracks[0]), gaps);
        assert_eq!((holed.missing(), holed.shortened_ns()), ((1, 1), (30, 20)));
        assert_eq!(holed.missed(&holed.tracks[0]), [], "what is lost is more than missed");
    }

    #[test]
    fn what_the_task_missed_is_no_gap_and_makes_no_shot_shorter() {
        let mut missed = shot(&[head(120, 0, 2), head(150, 0, 2), head(160, 0, 0)]);
        missed.tracks[0].has_history = true;
        missed.tracks[0].next = Some(head(210, 0, 4));
        assert_eq!(missed.gaps(&missed.tracks[0]), []);
        assert_eq!(missed.missed(&missed.tracks[0]), [gap(130, 150), gap(170, 200)]);
        assert_eq!(missed.shortened_ns(), (0, 0));
        missed.tracks[0].next = Some(head(210, 1, 3));
        assert_eq!(missed.gaps(&missed.tracks[0]), [gap(170, 200)]);
    }

    #[test]
    fn a_track_without_rows_is_one_gap() {
        let empty = shot(&[]);
        assert_eq!(empty.shortened_ns(), (0, 100));
        assert_eq!(empty.gaps(&empty.tracks[0]).len(), 1);
    }
}

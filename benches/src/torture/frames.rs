//! What must hold of the frames that a reader has had.

use isochrone_ipc::FrameHeader;

/// A frame as a reader got it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Got {
    pub(super) sequence: u64,
    pub(super) cycle: u64,
    pub(super) term: u64,
    pub(super) publish_ns: u64,
    /// Cycles that its writer has missed so far.
    pub(super) missed: u64,
    /// Its writer says that it ends: it may send its last cycle once more.
    pub(super) is_last: bool,
    pub(super) values: [f64; 2],
}

impl Got {
    pub(super) fn new(header: &FrameHeader, values: &[f64]) -> Self {
        let FrameHeader { sequence, cycle, term, publish_ns, missed, .. } = *header;
        let is_last = header.flags().contains(isochrone_ipc::Flags::STOPPED);
        let value = |at: usize| values.get(at).copied().unwrap_or(f64::NAN);
        let values = [value(0), value(1)];
        Self { sequence, cycle, term, publish_ns, missed, is_last, values }
    }
}

/// Nothing goes back or repeats, and the first value climbs by at most `step` with each frame, also over a takeover.
pub(super) fn that_jump(frames: &[Got], step: f64) -> Vec<String> {
    let wrong = |pair: &[Got]| {
        let [before, after] = *pair else { return None };
        let is_taken_over = before.term != after.term;
        let moved = after.values[0] - before.values[0];
        let sent = after.sequence.saturating_sub(before.sequence);
        // Whoever takes over has one state, and steps once.
        let most = if is_taken_over { step } else { sent as f64 * step };
        let goes_on = after.cycle > before.cycle || after.is_last && after.cycle == before.cycle;
        let what = if !goes_on {
            "the cycle goes back or repeats"
        } else if after.sequence <= before.sequence {
            "the sequence goes back or repeats"
        } else if after.term < before.term {
            "the term goes back"
        } else if !(0.0..=most).contains(&moved) {
            "the ramp jumps"
        } else {
            return None;
        };
        Some(format!("{what}: {before:?}, then {after:?}"))
    };
    frames.windows(2).filter_map(wrong).collect()
}

/// The second value is never below one whose `set` was acknowledged before the frame was sent; `acknowledged` are the
/// values, which grow, and when that was.
pub(super) fn that_lost(frames: &[Got], acknowledged: &[(f64, u64)]) -> Vec<String> {
    let lost = |frame: &Got| {
        let known = acknowledged.partition_point(|(_, at_ns)| *at_ns < frame.publish_ns);
        let (value, _) = acknowledged.get(known.checked_sub(1)?)?;
        (frame.values[1] < *value).then(|| {
            format!("{value} was set and acknowledged, and a later frame lacks it: {frame:?}")
        })
    };
    frames.iter().find_map(lost).into_iter().collect()
}

/// Both values are the number of the cycle, counted from `first`: nothing of another frame is in one.
pub(super) fn that_are_torn(frames: &[Got]) -> Vec<String> {
    let Some(first) = frames.first() else { return vec!["no frame came".into()] };
    let is_torn = |frame: &&Got| {
        let passed = frame.cycle.saturating_sub(first.cycle) as f64;
        frame.values != [first.values[0] + passed; 2]
    };
    let torn = frames.iter().find(is_torn);
    torn.map(|torn| format!("a frame is torn: {torn:?} after {first:?}")).into_iter().collect()
}

/// Each cycle has its frame, or is counted as missed.
pub(super) fn that_are_missing(frames: &[Got]) -> Vec<String> {
    let is_wrong = |pair: &[Got]| {
        let [before, after] = *pair else { return None };
        let passed = after.cycle.saturating_sub(before.cycle);
        let missed = after.missed.saturating_sub(before.missed);
        let is_next = passed == missed + 1 || passed == 0 && after.is_last;
        (!is_next).then(|| format!("a frame is lost between {before:?} and {after:?}"))
    };
    frames.windows(2).find_map(is_wrong).into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn got(cycle: u64, term: u64, ramp: f64, mark: f64) -> Got {
        let (sequence, publish_ns) = (cycle, cycle * 10);
        Got { sequence, cycle, term, publish_ns, missed: 0, is_last: false, values: [ramp, mark] }
    }

    #[test]
    fn a_ramp_may_step_once_over_a_takeover_and_nothing_goes_back() {
        let before = got(5, 1, 5.0, 0.0);
        for (after, what) in [
            (got(6, 1, 6.0, 0.0), None),
            (got(8, 1, 8.0, 0.0), None),
            (got(8, 2, 6.0, 0.0), None),
            (got(8, 2, 5.0, 0.0), None),
            (got(8, 2, 8.0, 0.0), Some("the ramp jumps")),
            (got(8, 2, 4.0, 0.0), Some("the ramp jumps")),
            (got(5, 2, 5.0, 0.0), Some("the cycle goes back or repeats")),
            (got(6, 0, 6.0, 0.0), Some("the term goes back")),
            (Got { sequence: 5, ..got(6, 1, 6.0, 0.0) }, Some("the sequence goes back or repeats")),
        ] {
            let wrong = that_jump(&[before, after], 1.0);
            assert_eq!(wrong.len(), usize::from(what.is_some()), "{after:?} {wrong:?}");
            assert!(what.is_none_or(|what| wrong[0].starts_with(what)), "{wrong:?}");
        }
    }

    #[test]
    fn a_frame_after_an_acknowledgement_has_what_was_set() {
        let frames = [got(1, 1, 0.0, 0.0), got(2, 1, 0.0, 1.0), got(3, 1, 0.0, 1.0)];
        assert_eq!(that_lost(&frames, &[(1.0, 15)]), Vec::<String>::new());
        assert_eq!(that_lost(&frames, &[(1.0, 15), (2.0, 40)]), Vec::<String>::new());
        assert_eq!(that_lost(&frames, &[(1.0, 15), (2.0, 25)]).len(), 1);
    }

    #[test]
    fn a_frame_with_a_value_of_another_one_is_torn() {
        let whole = [got(1, 1, 7.0, 7.0), got(4, 1, 10.0, 10.0)];
        assert_eq!(that_are_torn(&whole), Vec::<String>::new());
        assert_eq!(that_are_torn(&[whole[0], got(4, 1, 10.0, 9.0)]).len(), 1);
        assert_eq!(that_are_torn(&[]).len(), 1);
    }

    #[test]
    fn a_cycle_without_a_frame_is_missed_or_lost() {
        let frames = [got(1, 1, 0.0, 0.0), Got { missed: 2, ..got(4, 1, 0.0, 0.0) }];
        assert_eq!(that_are_missing(&frames), Vec::<String>::new());
        assert_eq!(that_are_missing(&[frames[0], got(4, 1, 0.0, 0.0)]).len(), 1);
    }
}

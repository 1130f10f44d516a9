//! Waiting for a trigger, and keeping what lies around it.

use crate::{Edge, Extremes, Head, Rows, Shot, Signal, Track, Triggered};

/// How much is captured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Before the cycle of the trigger, in ns.
    pub before_ns: u64,
    /// From that cycle on, in ns.
    pub after_ns: u64,
}

impl Window {
    /// From its first to its last instant, in ns.
    pub fn length_ns(self) -> u64 {
        self.before_ns.saturating_add(self.after_ns)
    }

    /// How many rows of a task with this period are kept at most: those of the window, and those that wait
    /// for another task's.
    pub fn rows(self, period_ns: u64) -> u64 {
        self.length_ns().saturating_add(LAG_NS).div_ceil(period_ns.max(1)).saturating_add(MARGIN)
    }
}

/// By how much one task's rows may come later than another's.
const LAG_NS: u64 = 4_000_000_000;
const MARGIN: u64 = 16;
/// Between the cycles of a task whose period is not known, in ns: for what is kept at most.
const SOME_PERIOD_NS: u64 = 100_000;

/// A task that is looked at.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Observed {
    /// Its name.
    pub task: String,
    /// From one cycle to the next, in ns, if that is known.
    pub period_ns: Option<u64>,
    /// The signals that are kept: the first ones of a row. A row may have others behind them.
    pub signals: Vec<Signal>,
}

/// Where a trigger was looked for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Looked {
    /// In so many cycles.
    pub cycles: u64,
    /// So many were lost on their way: it may have come in one of them.
    pub lost: u64,
    /// Between these values its signal was; `None` if none of them was finite.
    pub seen: Option<Extremes>,
}

/// When the window begins.
#[derive(Debug, Clone)]
enum Start {
    /// Before a trigger.
    Trigger { armed: Armed, edge: Edge },
    /// With the first row.
    Now,
    /// Not at all: only the newest rows are wanted.
    Never,
}

/// What a trigger looks at.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Armed {
    track: usize,
    place: usize,
    signal: String,
    text: String,
}

/// The instant around which it is captured.
#[derive(Debug, Clone)]
struct Found {
    at_ns: u64,
    trigger: Option<Triggered>,
}

/// Keeps rows, and makes shots of them.
///
/// Rows are pushed task by task in the order of their cycles; between tasks the order does not matter, as
/// long as none is more than some seconds ahead of another. Memory is bounded by the window.
#[derive(Debug, Clone)]
pub struct Capture {
    node: String,
    tracks: Vec<Track>,
    window: Window,
    start: Start,
    found: Option<Found>,
    /// The newest cycle in which the trigger was looked for.
    searched_ns: Option<u64>,
    looked: Looked,
}

impl Capture {
    fn new(node: &str, observed: Vec<Observed>, window: Window, start: Start) -> Self {
        let track = |of: Observed| Track {
            task: of.task,
            period_ns: of.period_ns,
            rows: Rows::new(of.signals.len()),
            signals: of.signals,
            ..Track::default()
        };
        Self {
            node: node.to_owned(),
            tracks: observed.into_iter().map(track).collect(),
            window,
            start,
            found: None,
            searched_ns: None,
            looked: Looked::default(),
        }
    }

    /// Waits for `edge` on value `place` of the rows of task `track`. `signal` and `text` are how that is
    /// written.
    pub fn armed(
        node: &str,
        observed: Vec<Observed>,
        window: Window,
        (track, place): (usize, usize),
        (signal, text): (&str, &str),
        edge: Edge,
    ) -> Self {
        let armed = Armed { track, place, signal: signal.to_owned(), text: text.to_owned() };
        Self::new(node, observed, window, Start::Trigger { armed, edge })
    }

    /// Begins with the first row.
    pub fn now(node: &str, observed: Vec<Observed>, after_ns: u64) -> Self {
        Self::new(node, observed, Window { before_ns: 0, after_ns }, Start::Now)
    }

    /// Makes no shot by itself: for the [latest](Self::latest).
    pub fn rolling(node: &str, observed: Vec<Observed>, window: Window) -> Self {
        Self::new(node, observed, window, Start::Never)
    }

    /// Takes in a row. Whether there is a shot to [take](Self::take) then; rows that are pushed before it is
    /// taken are not searched for the next trigger.
    pub fn push(&mut self, track: usize, head: Head, values: &[f64]) -> bool {
        let Some(of) = self.tracks.get_mut(track) else { return false };
        of.rows.push(head, values);
        let most = self.window.rows(of.period_ns.unwrap_or(SOME_PERIOD_NS));
        if of.rows.len() as u64 > most {
            of.rows.pop();
        }
        self.search(track, head, values);
        if self.found.is_some() {
            return self.is_complete();
        }
        self.forget(track);
        false
    }

    fn search(&mut self, track: usize, head: Head, values: &[f64]) {
        let found = match &mut self.start {
            Start::Trigger { armed, edge } if armed.track == track => {
                let Some(value) = values.get(armed.place).copied() else { return };
                self.looked.cycles += 1;
                self.looked.lost += head.lost;
                if value.is_finite() {
                    self.looked.seen = Some(Extremes::with(self.looked.seen, value));
                }
                edge.fires(value).then(|| {
                    let task = self.tracks.get(track).map(|track| track.task.clone());
                    Some(Triggered {
                        task: task.unwrap_or_default(),
                        cycle: head.cycle,
                        release_ns: head.release_ns,
                        text: armed.text.clone(),
                        signal: armed.signal.clone(),
                        level: edge.level(),
                        lost: head.lost,
                    })
                })
            }
            Start::Trigger { .. } => return,
            Start::Now => Some(None),
            Start::Never => None,
        };
        self.searched_ns = self.searched_ns.max(Some(head.release_ns));
        if let (Some(trigger), None) = (found, &self.found) {
            self.found = Some(Found { at_ns: head.release_ns, trigger });
        }
    }

    /// Drops what no trigger to come can need.
    fn forget(&mut self, track: usize) {
        let (Some(searched_ns), Some(of)) = (self.searched_ns, self.tracks.get_mut(track)) else {
            return;
        };
        let horizon_ns = searched_ns.saturating_sub(self.window.length_ns());
        let is_old = |head: &Head| {
            head.release_ns.saturating_add(2 * of.period_ns.unwrap_or_default()) < horizon_ns
        };
        while of.rows.first().is_some_and(is_old) {
            of.rows.pop();
        }
    }

    /// Whether all rows of the window are there.
    fn is_complete(&self) -> bool {
        let Some(found) = &self.found else { return false };
        let end_ns = found.at_ns.saturating_add(self.window.after_ns);
        self.tracks.iter().filter(|track| track.rows.width() > 0).all(|track| {
            // The next one would lie beyond the end, or as good as beyond.
            let enough_ns = track.period_ns.unwrap_or_default() / 2 * 3;
            let newest = track.rows.last();
            newest.is_some_and(|head| head.release_ns.saturating_add(enough_ns) >= end_ns)
        })
    }

    /// Whether a trigger came, and its shot is not taken yet.
    pub fn is_triggered(&self) -> bool {
        self.found.is_some()
    }

    /// The shot of the trigger that came, as far as it has come; then it waits for the next one.
    pub fn take(&mut self) -> Option<Shot> {
        let Found { at_ns, trigger } = self.found.take()?;
        let begin_ns = at_ns.saturating_sub(self.window.before_ns);
        Some(self.shot(trigger, begin_ns, at_ns.saturating_add(self.window.after_ns)))
    }

    /// The newest rows, as many as the window is long.
    pub fn latest(&self) -> Shot {
        let ends = || {
            self.tracks.iter().filter_map(|track| {
                let period_ns = track.period_ns.unwrap_or_default();
                Some(track.rows.last()?.release_ns.saturating_add(period_ns))
            })
        };
        // Where all tasks have rows, unless one stands still.
        let newest_ns = ends().max().unwrap_or_default();
        let oldest_ns = ends().min().unwrap_or_default();
        let end_ns = if newest_ns - oldest_ns < LAG_NS { oldest_ns } else { newest_ns };
        self.shot(None, end_ns.saturating_sub(self.window.length_ns()), end_ns)
    }

    fn shot(&self, trigger: Option<Triggered>, begin_ns: u64, end_ns: u64) -> Shot {
        let track = |of: &Track| {
            let mut rows = Rows::new(of.rows.width());
            // A grid that follows another clock is not exact: a cycle belongs to the nearest instant.
            let half_ns = of.period_ns.unwrap_or_default() / 2;
            let nearest_ns = |head: &Head| head.release_ns.saturating_add(half_ns);
            let mut row = Vec::new();
            let (mut has_history, mut next) = (false, None);
            for (head, values) in of.rows.iter() {
                if nearest_ns(head) < begin_ns {
                    has_history = true;
                } else if nearest_ns(head) < end_ns {
                    row.clear();
                    row.extend(values);
                    // What is missing before the window is none of it.
                    let (lost, missed) =
                        if rows.is_empty() { (0, 0) } else { (head.lost, head.missed) };
                    rows.push(Head { lost, missed, ..*head }, &row);
                } else {
                    next = Some(*head);
                    break;
                }
            }
            let (signals, task) = (of.signals.clone(), of.task.clone());
            Track { rows, has_history, next, signals, task, period_ns: of.period_ns }
        };
        let shown = self.tracks.iter().filter(|track| track.rows.width() > 0);
        let tracks = shown.map(track).collect();
        Shot { node: self.node.clone(), tracks, trigger, begin_ns, end_ns }
    }

    /// Where the trigger was looked for so far.
    pub fn looked(&self) -> Looked {
        self.looked
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{Comparison, Condition};

    const MS: u64 = 1_000_000;

    fn observed(task: &str, period_ns: u64) -> Observed {
        let signal = Signal { name: format!("{task}.y"), ..Signal::default() };
        Observed { task: task.into(), period_ns: Some(period_ns), signals: vec![signal] }
    }

    fn above_one() -> Edge {
        Edge::new(Condition::Compare(Comparison::Greater, 1.0))
    }

    fn capture(window: Window) -> Capture {
        Capture::armed("n", vec![observed("t", MS)], window, (0, 0), ("x", "x > 1"), above_one())
    }

    const WINDOW: Window = Window { before_ns: 20 * MS, after_ns: 100 * MS };

    /// Pushes cycle by cycle until there is a shot, with 2.0 in the cycles that `is_high` names.
    fn shots(capture: &mut Capture, cycles: u64, is_high: impl Fn(u64) -> bool) -> Vec<Shot> {
        let mut shots = Vec::new();
        for cycle in 0..cycles {
            let head = Head { cycle, release_ns: (1_000 + cycle) * MS, ..Head::default() };
            if capture.push(0, head, &[if is_high(cycle) { 2.0 } else { 0.0 }]) {
                shots.extend(capture.take());
            }
        }
        shots
    }

    fn cycles(shot: &Shot) -> Vec<u64> {
        shot.tracks[0].rows.heads().map(|head| head.cycle).collect()
    }

    #[test]
    fn a_shot_has_the_cycles_before_the_trigger_and_those_from_it_on_and_no_others() {
        let shots = shots(&mut capture(WINDOW), 300, |cycle| cycle == 57);
        assert_eq!(shots.len(), 1);
        assert_eq!(cycles(&shots[0]), (37..157).collect::<Vec<_>>());
        let trigger = shots[0].trigger.as_ref().unwrap();
        assert_eq!((trigger.cycle, trigger.release_ns), (57, 1_057 * MS));
        assert_eq!(shots[0].shortened_ns(), (0, 0));
    }

    #[test]
    fn a_trigger_that_comes_early_has_a_shorter_history_and_is_not_passed_over() {
        let shots = shots(&mut capture(WINDOW), 200, |cycle| cycle == 5);
        assert_eq!(cycles(&shots[0]), (0..105).collect::<Vec<_>>());
        assert_eq!(shots[0].shortened_ns(), (15 * MS, 0));
    }

    #[test]
    fn after_a_shot_it_waits_for_the_next_trigger_whose_history_may_be_in_the_shot_before() {
        let high = |cycle: u64| [50, 60, 155, 400].contains(&cycle);
        let shots = shots(&mut capture(WINDOW), 520, high);
        let triggers: Vec<u64> =
            shots.iter().map(|shot| shot.trigger.as_ref().unwrap().cycle).collect();
        assert_eq!(triggers, [50, 155, 400]);
        assert_eq!(cycles(&shots[1]), (135..255).collect::<Vec<_>>());
    }

    #[test]
    fn without_a_trigger_it_begins_with_the_first_row() {
        let mut capture = Capture::now("n", vec![observed("t", MS)], 10 * MS);
        let shots = shots(&mut capture, 25, |_| false);
        assert_eq!(cycles(&shots[0]), (0..10).collect::<Vec<_>>());
        assert_eq!(cycles(&shots[1]), (10..20).collect::<Vec<_>>());
        assert_eq!(shots[0].trigger, None);
    }

    #[test]
    fn what_ends_early_gives_what_there_is() {
        let mut capture = capture(WINDOW);
        assert!(shots(&mut capture, 100, |cycle| cycle == 57).is_empty());
        assert!(capture.is_triggered());
        let shot = capture.take().unwrap();
        assert_eq!((cycles(&shot).len(), shot.shortened_ns()), (63, (0, 57 * MS)));
        assert_eq!(capture.take(), None);
        let seen = Some(Extremes { low: 0.0, high: 2.0 });
        assert_eq!(capture.looked(), Looked { cycles: 100, lost: 0, seen });
        assert_eq!(cycles(&capture.latest()).len(), 100);
    }

    #[test]
    fn the_signal_of_the_trigger_need_not_be_shown() {
        let hidden = Observed { signals: Vec::new(), ..observed("slow", 10 * MS) };
        let tasks = vec![observed("fast", MS), hidden];
        let mut capture = Capture::armed("n", tasks, WINDOW, (1, 0), ("x", ""), above_one());
        let mut shot = None;
        for cycle in 0..400 {
            let head = Head { cycle, release_ns: (1_000 + cycle) * MS, ..Head::default() };
            let mut is_there = capture.push(0, head, &[0.0]);
            if cycle % 10 == 0 {
                let head = Head { cycle: cycle / 10, ..head };
                is_there |= capture.push(1, head, &[if cycle == 150 { 2.0 } else { 0.0 }]);
            }
            if is_there {
                shot = shot.or(capture.take());
            }
        }
        let shot = shot.unwrap();
        assert_eq!((shot.tracks.len(), shot.trigger.as_ref().unwrap().cycle), (1, 15));
        assert_eq!(cycles(&shot), (130..250).collect::<Vec<_>>());
    }

    #[test]
    fn hours_of_waiting_keep_no_more_than_the_window() {
        let mut capture = capture(WINDOW);
        assert!(shots(&mut capture, 1_000_000, |_| false).is_empty());
        assert!(capture.tracks[0].rows.len() <= 125, "{}", capture.tracks[0].rows.len());
        // A task that goes on while that of the trigger stands still is bounded as well.
        let tasks = vec![observed("a", MS), observed("b", MS)];
        let mut capture = Capture::armed("n", tasks, WINDOW, (0, 0), ("x", ""), above_one());
        shots(&mut capture, 1, |_| false);
        for cycle in 0..100_000 {
            capture.push(1, Head { cycle, release_ns: cycle * MS, ..Head::default() }, &[0.0]);
        }
        assert!(capture.tracks[1].rows.len() as u64 <= WINDOW.rows(MS));
    }

    proptest! {
        /// Two tasks of any periods, whose rows come in bursts of any length.
        #[test]
        fn a_shot_does_not_depend_on_which_task_is_read_first(
            periods in (1u64..8, 1u64..8),
            phases in (0u64..8, 0u64..8),
            trigger_cycle in 2u64..300,
            bursts in prop::collection::vec(1usize..60, 200),
        ) {
            let (before_ns, after_ns) = (40 * MS, 90 * MS);
            let tasks = vec![observed("a", periods.0 * MS), observed("b", periods.1 * MS)];
            let window = Window { before_ns, after_ns };
            let mut capture = Capture::armed("n", tasks, window, (0, 0), ("x", ""), above_one());
            let row = |track: u64, cycle: u64| {
                let (period, phase) =
                    if track == 0 { (periods.0, phases.0) } else { (periods.1, phases.1) };
                let release_ns = (1_000 + phase + cycle * period) * MS;
                let value = if track == 0 && cycle >= trigger_cycle { 2.0 } else { 0.0 };
                (Head { cycle, release_ns, ..Head::default() }, value)
            };
            let mut next = [0u64; 2];
            let mut shot = None;
            for (turn, burst) in bursts.iter().enumerate() {
                let track = turn % 2;
                for _ in 0..*burst {
                    let (head, value) = row(track as u64, next[track]);
                    next[track] += 1;
                    // No task runs far ahead of the other one.
                    let other = row(1 - track as u64, next[1 - track]).0.release_ns;
                    if head.release_ns > other + 3_000 * MS {
                        next[track] -= 1;
                        break;
                    }
                    if capture.push(track, head, &[value]) && shot.is_none() {
                        shot = capture.take();
                    }
                }
            }
            if let Some(shot) = shot {
                let at_ns = row(0, trigger_cycle).0.release_ns;
                prop_assert_eq!(shot.trigger.as_ref().unwrap().cycle, trigger_cycle);
                for (track, of) in shot.tracks.iter().enumerate() {
                    let half_ns = of.period_ns.unwrap() / 2;
                    let expected: Vec<u64> = (0..3_000)
                        .filter(|cycle| {
                            let at = row(track as u64, *cycle).0.release_ns + half_ns;
                            (at_ns - before_ns..at_ns + after_ns).contains(&at)
                        })
                        .collect();
                    let found: Vec<u64> = of.rows.heads().map(|head| head.cycle).collect();
                    prop_assert_eq!(found, expected);
                }
            }
        }
    }
}

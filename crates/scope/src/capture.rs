//! Waiting for a trigger, and keeping what lies around it.

use crate::window::LAG_NS;
use crate::{Edge, Extremes, Head, Rows, Shot, Track, TrackSignal, Triggered, Window};

/// Between the cycles of a task whose period is not known, in ns: for what is kept at most.
const SOME_PERIOD_NS: u64 = 100_000;

/// A task whose rows are captured.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ObservedTask {
    /// Its name.
    pub task: String,
    /// From one cycle to the next, in ns, if that is known.
    pub period_ns: Option<u64>,
    /// The signals that are kept: the first ones of a row. A row may have others behind them.
    pub signals: Vec<TrackSignal>,
}

/// The cycles in which a trigger was looked for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TriggerSearch {
    /// How many cycles.
    pub cycles: u64,
    /// How many cycles were lost on their way: the trigger may have been in one of them.
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

/// A trigger, and the signal that it watches.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Armed {
    track: usize,
    place: usize,
    signal: String,
    text: String,
}

/// The instant around which it is captured.
#[derive(Debug, Clone)]
struct CaptureInstant {
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
    found: Option<CaptureInstant>,
    /// The newest cycle in which the trigger was looked for.
    searched_ns: Option<u64>,
    looked: TriggerSearch,
}

impl Capture {
    fn new(node: &str, observed: Vec<ObservedTask>, window: Window, start: Start) -> Self {
        let track = |of: ObservedTask| Track {
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
            looked: TriggerSearch::default(),
        }
    }

    /// Waits for `edge` on value `place` of the rows of task `track`. `signal` and `text` are how that is
    /// written.
    pub fn armed(
        node: &str,
        observed: Vec<ObservedTask>,
        window: Window,
        (track, place): (usize, usize),
        (signal, text): (&str, &str),
        edge: Edge,
    ) -> Self {
        let armed = Armed { track, place, signal: signal.to_owned(), text: text.to_owned() };
        Self::new(node, observed, window, Start::Trigger { armed, edge })
    }

    /// Begins with the first row.
    pub fn now(node: &str, observed: Vec<ObservedTask>, after_ns: u64) -> Self {
        Self::new(node, observed, Window { before_ns: 0, after_ns }, Start::Now)
    }

    /// Makes no shot by itself: for the [latest](Self::latest).
    pub fn rolling(node: &str, observed: Vec<ObservedTask>, window: Window) -> Self {
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
                self.looked.lost = self.looked.lost.saturating_add(head.lost);
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
            self.found = Some(CaptureInstant { at_ns: head.release_ns, trigger });
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

    /// The trigger that came, if its shot is not taken yet.
    pub fn triggered(&self) -> Option<&Triggered> {
        self.found.as_ref()?.trigger.as_ref()
    }

    /// The shot of the trigger that came, as far as it has come; then it waits for the next one.
    pub fn take(&mut self) -> Option<Shot> {
        let CaptureInstant { at_ns, trigger } = self.found.take()?;
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
        // Until when all tasks have rows, unless one stands still.
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
                    // Cycles that are missing before the window do not belong to it.
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

    /// The cycles in which the trigger was looked for so far.
    pub fn looked(&self) -> TriggerSearch {
        self.looked
    }
}

#[cfg(test)]
mod tests;

//! Frames that arrive after the cycle that waited for them has given up: as an alarm while the node runs, and in its
//! report.

use isochrone_engine::{TaskPlan, format_duration_ns};
use isochrone_ipc::ListedNode;
use isochrone_model::Schedule;
use isochrone_timing::{Arrivals, InVain, LateFrames, Punctuality, WarningCode, warm_up_cycles};

use super::sources::Sources;
use crate::node::alarms::Alarm;
use crate::node::standing::StateChange;
use crate::task::records::Cycle;

/// A run is judged in stretches of this length, and of at least `STRETCH_PERIODS` periods.
const STRETCH_NS: u64 = 5_000_000_000;
const STRETCH_PERIODS: u64 = 25;
/// If a stretch has too few frames to be judged by, it is extended up to this many times its length.
const MOST_STRETCHES: u64 = 12;
/// If the arrival of frames shifts by a 50th of the period or more from one stretch to the next, the source drifts, and
/// no alarm is raised.
const STEADY: u64 = 50;
/// The alarm is raised again if the arrival of frames has shifted by a 20th of the period or more since.
const NEWS: u64 = 20;

/// The highest real-time priority. A thread gets no CPU from another one of its own priority.
const HIGHEST: u8 = 99;

/// The frames of a service that a task follows.
pub(crate) struct FollowedFrames {
    task: String,
    /// The task's real-time priority.
    priority: Option<u8>,
    schedule: Schedule,
    service: String,
    /// Who sends them, as last looked up while frames were late: a source may end before the task does.
    sources: Sources,
    /// Whether that is to be looked up.
    asks: bool,
    /// How late frames are, as an alarm is to say that names their source.
    due: Option<LateFrames>,
    history: ArrivalHistory,
}

/// When frames arrived in the cycles so far.
#[derive(Default)]
struct ArrivalHistory {
    /// Cycles of the warm-up so far, which do not count.
    warm_up_cycles: u64,
    /// Arrivals in all earlier stretches.
    run: Arrivals,
    /// Arrivals in the current stretch.
    stretch: Arrivals,
    /// First release of the current stretch.
    since_ns: Option<u64>,
    /// Last release of the current stretch.
    until_ns: u64,
    /// How late frames were in the previous stretch, if they were.
    previous: Option<LateFrames>,
    /// The alarm that stands, and how late frames were when it was raised.
    alarm: Option<(LateFrames, Alarm)>,
    /// The first alarm of the run, for the report.
    first: Option<Alarm>,
}

/// What the latest look found.
enum Stretch {
    /// The stretch goes on, or says nothing.
    Open,
    /// Its frames were late; whether no alarm has said so.
    Late { late: LateFrames, is_news: bool },
    /// Its frames came in time, or not at all.
    InTime,
}

impl FollowedFrames {
    /// For the service that a task follows; `None` if it follows none.
    pub(crate) fn of(task: &TaskPlan) -> Option<Self> {
        Some(Self {
            task: task.name.clone(),
            priority: task.settings.priority,
            schedule: task.settings.schedule(),
            service: task.settings.followed_service()?.to_owned(),
            sources: Sources::default(),
            asks: false,
            due: None,
            history: ArrivalHistory::default(),
        })
    }

    /// Records the next cycle.
    pub(crate) fn note(&mut self, cycle: &Cycle) {
        let Some(follow) = &cycle.follow else { return };
        let history = &mut self.history;
        if history.warm_up_cycles < warm_up_cycles(self.schedule.period_ns) {
            history.warm_up_cycles += 1;
            return;
        }
        history.stretch.record(&cycle.record, follow, self.schedule.period_ns);
        history.since_ns.get_or_insert(cycle.record.release_ns);
        history.until_ns = cycle.record.release_ns;
    }

    /// At the end of a stretch, raises the alarm if frames have begun to arrive late, and ends it if they no longer do.
    /// `publishers` lists the publishers of a service; `None`: they cannot be determined at this moment.
    ///
    /// Who sends late frames is asked at each look until it is known. The alarm waits for that, but not for longer than a
    /// stretch: it is then raised without a name, and again with it.
    pub(crate) fn judge(
        &mut self,
        publishers: impl FnOnce(&str) -> Option<Vec<ListedNode>>,
    ) -> Option<StateChange> {
        let mut is_overdue = false;
        match self.end_stretch() {
            Stretch::Late { late, is_news } => {
                self.asks = true;
                if is_news {
                    is_overdue = self.due.replace(late).is_some();
                }
            }
            Stretch::InTime => {
                (self.asks, self.due) = (false, None);
                let (_, over) = self.history.alarm.take()?;
                tracing::info!("{}", over.end());
                return Some(StateChange::end(&over));
            }
            Stretch::Open => {}
        }
        if self.asks {
            self.look_up(publishers);
        }
        let late = if self.asks { self.due.filter(|_| is_overdue) } else { self.due.take() };
        late.map(|late| self.raise(late))
    }

    fn end_stretch(&mut self) -> Stretch {
        let period_ns = self.schedule.period_ns;
        let stretch_ns = period_ns.saturating_mul(STRETCH_PERIODS).max(STRETCH_NS);
        let history = &mut self.history;
        let passed_ns = history.since_ns.map_or(0, |since| history.until_ns.saturating_sub(since));
        if passed_ns < stretch_ns {
            return Stretch::Open;
        }
        let punctuality = history.stretch.punctuality(period_ns);
        if punctuality == Punctuality::TooFew && passed_ns / MOST_STRETCHES < stretch_ns {
            return Stretch::Open;
        }
        history.run.add(&history.stretch);
        history.stretch.clear();
        history.since_ns = None;
        let before = history.previous.take();
        match punctuality {
            Punctuality::Late(late) => {
                history.previous = Some(late);
                let is_like = |others: &LateFrames, part| late.are_like(others, period_ns / part);
                let is_known =
                    history.alarm.as_ref().is_some_and(|(alarmed, _)| is_like(alarmed, NEWS));
                let is_steady = before.is_some_and(|before| is_like(&before, STEADY));
                Stretch::Late { late, is_news: is_steady && !is_known }
            }
            Punctuality::Between => Stretch::Open,
            Punctuality::InTime | Punctuality::TooFew => Stretch::InTime,
        }
    }

    fn raise(&mut self, late: LateFrames) -> StateChange {
        let alarm = self.alarm(late);
        tracing::warn!("{}", alarm.sentence());
        let change = StateChange::begin(&alarm);
        let history = &mut self.history;
        let before = history.alarm.replace((late, alarm.clone()));
        // The same alarm, with its source.
        let names_first =
            before.is_some_and(|(known, before)| known == late && history.first == Some(before));
        if names_first || history.first.is_none() {
            history.first = Some(alarm);
        }
        change
    }

    /// The alarm for the report: of the whole run if frames were late over all of it, otherwise the first one raised.
    pub(crate) fn end(
        mut self,
        publishers: impl FnOnce(&str) -> Option<Vec<ListedNode>>,
    ) -> Option<Alarm> {
        self.history.run.add(&self.history.stretch);
        let Punctuality::Late(late) = self.history.run.punctuality(self.schedule.period_ns) else {
            return self.history.first;
        };
        self.look_up(publishers);
        Some(self.alarm(late))
    }

    fn look_up(&mut self, publishers: impl FnOnce(&str) -> Option<Vec<ListedNode>>) {
        let Some(nodes) = publishers(&self.service) else { return };
        self.asks = false;
        if !nodes.is_empty() {
            self.sources = Sources::of(nodes);
        }
    }

    fn alarm(&self, late: LateFrames) -> Alarm {
        Alarm::LateFrames {
            task: self.task.clone(),
            service: self.service.clone(),
            within_ns: self.schedule.follow_within_ns.unwrap_or_default(),
            late,
            remedy: self.remedy(late),
            sources: self.sources.nodes.clone(),
        }
    }

    fn remedy(&self, late: LateFrames) -> String {
        let catch = || {
            catch(&self.schedule, late)
                .unwrap_or_else(|| WarningCode::LateFrames.remedy().to_owned())
        };
        let Some(InVain { scattered, .. }) = late.in_vain else { return catch() };
        let in_the_way = self.priority.filter(|own| self.sources.may_wait_for(*own));
        let follow_each_other =
            "if the task and its source follow each other, let one of them be a plain task";
        let off_grid = "if the source is off the grid, align it with the releases of the task, as docs/wire.md \
                        says (The grid)";
        let ways = [
            in_the_way.map(|priority| make_way(priority, &self.sources)),
            self.sources.may_be_control_nodes().then(|| follow_each_other.to_owned()),
            match in_the_way {
                _ if scattered => Some(off_grid.to_owned()),
                // Neither a phase nor a time catches what the task itself holds up.
                Some(_) => None,
                None => Some(catch()),
            },
        ];
        ways.into_iter().flatten().collect::<Vec<_>>().join("; ")
    }
}

/// Advice for a source that may be starved by a task of this priority.
fn make_way(priority: u8, sources: &Sources) -> String {
    if sources.may_be_control_nodes() {
        return "if the task keeps its source from running, give the task a lower priority than its source has, or \
                another CPU"
            .to_owned();
    }
    let above = priority.saturating_add(1).min(HIGHEST);
    // For all threads of the process: which of them sends is not known.
    let commands = sources.nodes.iter().map(|node| format!("chrt -a -f -p {above} {}", node.pid));
    let commands = commands.collect::<Vec<_>>().join(", ");
    let what = match priority {
        HIGHEST.. => "give the task a priority below 99 and its source a higher one",
        _ => "give that a higher priority",
    };
    format!("if the task keeps its source from running, {what} ({commands}) or another CPU")
}

/// Advice on `phase` and `within` with which the frames would arrive in time, if there is any.
fn catch(schedule: &Schedule, late: LateFrames) -> Option<String> {
    let period_ns = schedule.period_ns.max(1);
    let step_ns = round_ns(period_ns / 20);
    let within_ns = (late.p99_ns + step_ns / 2).next_multiple_of(step_ns);
    // A real-time task may not watch for nearly all of its period.
    let longest_ns = (period_ns - period_ns / 10).saturating_sub(schedule.longest_watch_ns());
    let phase_ns = (schedule.phase_ns + late.median_ns) % period_ns / step_ns * step_ns;
    let written = |key: &str, ns: u64| format!("{key} = \"{}\"", format_duration_ns(ns));
    let longer = (within_ns <= longest_ns).then(|| written("within", within_ns));
    let later = (phase_ns != schedule.phase_ns).then(|| written("phase", phase_ns));
    // A later phase first: waiting longer takes more CPU time.
    let ways: Vec<String> = later.into_iter().chain(longer).collect();
    (!ways.is_empty()).then(|| format!("write {} in its [[task]]", ways.join(" or ")))
}

/// The largest of 1, 2, 5, 10, 20 ns ... that is not above `ns`.
fn round_ns(ns: u64) -> u64 {
    let ten = 10_u64.pow(ns.checked_ilog10().unwrap_or_default());
    [5, 2].into_iter().map(|n| n * ten).find(|round_ns| *round_ns <= ns).unwrap_or(ten)
}

#[cfg(test)]
#[path = "late_frames_tests.rs"]
mod tests;

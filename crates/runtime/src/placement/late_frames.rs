//! Frames that come after the cycles that follow them gave up: while the node runs, and in its report.

use isochrone_engine::{TaskPlan, format_duration_ns};
use isochrone_ipc::ListedNode;
use isochrone_model::Schedule;
use isochrone_timing::{Arrivals, InVain, LateFrames, Punctuality, WarningCode, warm_up_cycles};

use super::sources::Sources;
use crate::alarms::Alarm;
use crate::records::Cycle;
use crate::standing::StateChange;

/// The stretch of a run by which it is judged when frames come: so long, and at least so many periods.
const STRETCH_NS: u64 = 5_000_000_000;
const STRETCH_PERIODS: u64 = 25;
/// A slow source may take so many times as long to be judged.
const MOST_STRETCHES: u64 = 12;
/// Two stretches in which frames come this part of a period apart, or more, are of a source that drifts.
const STEADY: u64 = 50;
/// Frames that come this part of a period earlier or later than it was said are news.
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
    /// Who sends them, as last seen while they were late: they may end before the task.
    sources: Sources,
    seen: Seen,
}

/// What the cycles of a run have shown.
#[derive(Default)]
struct Seen {
    /// Cycles of the warm-up, by which nothing is judged.
    warm_up_cycles: u64,
    /// Of the stretches before this one.
    run: Arrivals,
    /// Of this stretch, from its first release to its last.
    stretch: Arrivals,
    since_ns: Option<u64>,
    until_ns: u64,
    /// Of the stretch before, if frames were late in it.
    before: Option<LateFrames>,
    /// As the alarm says that stands, and that alarm.
    told: Option<(LateFrames, Alarm)>,
    /// For the report.
    first: Option<Alarm>,
}

impl FollowedFrames {
    /// Those of the service that a task follows.
    pub(crate) fn of(task: &TaskPlan) -> Option<Self> {
        Some(Self {
            task: task.name.clone(),
            priority: task.settings.priority,
            schedule: task.settings.schedule(),
            service: task.settings.followed_service()?.to_owned(),
            sources: Sources::default(),
            seen: Seen::default(),
        })
    }

    /// Takes note of the next cycle.
    pub(crate) fn note(&mut self, cycle: &Cycle) {
        let Some(follow) = &cycle.follow else { return };
        let seen = &mut self.seen;
        if seen.warm_up_cycles < warm_up_cycles(self.schedule.period_ns) {
            seen.warm_up_cycles += 1;
            return;
        }
        seen.stretch.record(&cycle.record, follow, self.schedule.period_ns);
        seen.since_ns.get_or_insert(cycle.record.release_ns);
        seen.until_ns = cycle.record.release_ns;
    }

    /// At the end of a stretch, logs when frames begin to come late, or no longer do; returns what has changed.
    /// `publishers` tells who publishes a service.
    pub(crate) fn judge(
        &mut self,
        publishers: impl FnOnce(&str) -> Vec<ListedNode>,
    ) -> Option<StateChange> {
        let period_ns = self.schedule.period_ns;
        let stretch_ns = period_ns.saturating_mul(STRETCH_PERIODS).max(STRETCH_NS);
        let passed_ns = self.seen.until_ns.saturating_sub(self.seen.since_ns?);
        if passed_ns < stretch_ns {
            return None;
        }
        let punctuality = self.seen.stretch.punctuality(period_ns);
        if punctuality == Punctuality::TooFew && passed_ns / MOST_STRETCHES < stretch_ns {
            return None;
        }
        let seen = &mut self.seen;
        seen.run.add(&seen.stretch);
        seen.stretch.clear();
        seen.since_ns = None;
        let before = seen.before.take();
        match punctuality {
            Punctuality::Late(late) => {
                seen.before = Some(late);
                let is_like = |others: &LateFrames, part| late.are_like(others, period_ns / part);
                let is_told = seen.told.as_ref().is_some_and(|(told, _)| is_like(told, NEWS));
                self.look_up(publishers);
                let is_news = before.is_some_and(|before| is_like(&before, STEADY)) && !is_told;
                is_news.then(|| self.tell(late))
            }
            Punctuality::Between => None,
            Punctuality::InTime | Punctuality::TooFew => {
                let (_, over) = seen.told.take()?;
                tracing::info!("{}", over.end());
                Some(StateChange::end(&over))
            }
        }
    }

    fn tell(&mut self, late: LateFrames) -> StateChange {
        let alarm = self.alarm(late);
        tracing::warn!("{}", alarm.sentence());
        let change = StateChange::begin(&alarm);
        self.seen.first.get_or_insert_with(|| alarm.clone());
        self.seen.told = Some((late, alarm));
        change
    }

    /// What the report says, if frames were late over the whole run, or for a while.
    pub(crate) fn end(mut self, publishers: impl FnOnce(&str) -> Vec<ListedNode>) -> Option<Alarm> {
        self.seen.run.add(&self.seen.stretch);
        let Punctuality::Late(late) = self.seen.run.punctuality(self.schedule.period_ns) else {
            return self.seen.first;
        };
        self.look_up(publishers);
        Some(self.alarm(late))
    }

    fn look_up(&mut self, publishers: impl FnOnce(&str) -> Vec<ListedNode>) {
        let nodes = publishers(&self.service);
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

/// How the source gets the CPU on which a task of this priority watches for it.
fn make_way(priority: u8, sources: &Sources) -> String {
    if sources.may_be_control_nodes() {
        return "if the task keeps its source from running, give the task a lower priority than its source has, or \
                another CPU"
            .to_owned();
    }
    let above = priority.saturating_add(1).min(HIGHEST);
    // Of all its threads: which of them sends is not known.
    let commands = sources.nodes.iter().map(|node| format!("chrt -a -f -p {above} {}", node.pid));
    let commands = commands.collect::<Vec<_>>().join(", ");
    let what = match priority {
        HIGHEST.. => "give the task a priority below 99 and its source a higher one",
        _ => "give that a higher priority",
    };
    format!("if the task keeps its source from running, {what} ({commands}) or another CPU")
}

/// The configuration with which the frames would come in time, if there is one.
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
    // To wait longer takes more of a CPU.
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

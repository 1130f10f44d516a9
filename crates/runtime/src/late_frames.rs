//! Frames that come after the cycles that follow them gave up: while the node runs, and in its report.

use isochrone_engine::format_duration_ns;
use isochrone_ipc::ListedNode;
use isochrone_schedule::Schedule;
use isochrone_timing::{Arrivals, InVain, LateFrames, Punctuality, WarningCode};

use crate::alarms::Alarm;
use crate::lasting::{Lasting, StateChange};
use crate::records::Cycle;
use crate::sources::Sources;

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
    service: String,
    /// Who sends them, as last seen while they were late: they may end before the task.
    sources: Sources,
    schedule: Schedule,
    /// Of the stretch that has begun at a release.
    arrivals: Arrivals,
    since_ns: Option<u64>,
    until_ns: u64,
    lasting: Lasting,
    /// Of the stretch before, if frames were late in it.
    before: Option<LateFrames>,
    /// As the alarm says that stands.
    told: Option<LateFrames>,
    /// For the report.
    first: Option<Alarm>,
}

impl FollowedFrames {
    /// Those of a service that a task follows.
    pub(crate) fn new(
        task: String,
        priority: Option<u8>,
        service: String,
        schedule: Schedule,
    ) -> Self {
        Self {
            task,
            priority,
            service,
            sources: Sources::default(),
            schedule,
            arrivals: Arrivals::default(),
            since_ns: None,
            until_ns: 0,
            lasting: Lasting::default(),
            before: None,
            told: None,
            first: None,
        }
    }

    /// Takes note of the next cycle.
    pub(crate) fn note(&mut self, cycle: &Cycle) {
        let Some(follow) = &cycle.follow else { return };
        self.arrivals.record(&cycle.record, follow, self.schedule.period_ns);
        self.since_ns.get_or_insert(cycle.record.release_ns);
        self.until_ns = cycle.record.release_ns;
    }

    /// At the end of a stretch, logs when frames begin to come late, or no longer do; returns what has changed.
    /// `publishers` tells who publishes a service.
    pub(crate) fn judge(
        &mut self,
        publishers: impl FnOnce(&str) -> Vec<ListedNode>,
    ) -> Vec<StateChange> {
        let stretch_ns = self.schedule.period_ns.saturating_mul(STRETCH_PERIODS).max(STRETCH_NS);
        let since_ns = self.since_ns.unwrap_or(self.until_ns);
        let passed_ns = self.until_ns.saturating_sub(since_ns);
        if passed_ns < stretch_ns {
            return Vec::new();
        }
        match self.arrivals.punctuality(self.schedule.period_ns) {
            Punctuality::TooFew if passed_ns / MOST_STRETCHES < stretch_ns => return Vec::new(),
            Punctuality::Late(late) => self.take_late(late, publishers),
            Punctuality::Between => self.before = None,
            Punctuality::InTime | Punctuality::TooFew => {
                (self.before, self.told) = (None, None);
                if let Some(over) = self.lasting.end(&WarningCode::LateFrames, &self.service) {
                    tracing::info!("{}", over.end());
                }
            }
        }
        self.arrivals.clear();
        self.since_ns = None;
        self.lasting.changes()
    }

    fn take_late(&mut self, late: LateFrames, publishers: impl FnOnce(&str) -> Vec<ListedNode>) {
        self.look_up(publishers);
        let is_near = |other: Option<LateFrames>, part: u64| {
            let apart_ns = other.map(|other| other.median_ns.abs_diff(late.median_ns));
            apart_ns.is_some_and(|apart_ns| apart_ns <= self.schedule.period_ns / part)
        };
        let before = self.before.replace(late);
        // What comes now in time and now too late has no certain time.
        let is_like = |other: Option<LateFrames>, part: u64| match (late.in_vain, other) {
            (Some(_), Some(other)) => other.in_vain.is_some(),
            _ => is_near(other.filter(|other| other.in_vain.is_none()), part),
        };
        if !is_like(before, STEADY) || is_like(self.told, NEWS) {
            return;
        }
        let alarm = self.alarm(late);
        if self.lasting.begin(&alarm) {
            tracing::warn!("{}", alarm.sentence());
        }
        self.told = Some(late);
        self.first.get_or_insert(alarm);
    }

    /// What the report says, if frames were late over the whole run, or for a while.
    pub(crate) fn end(
        mut self,
        late: Option<LateFrames>,
        publishers: impl FnOnce(&str) -> Vec<ListedNode>,
    ) -> Option<Alarm> {
        let Some(late) = late else { return self.first };
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
        let sources = &self.sources;
        let catch = || {
            catch(&self.schedule, late)
                .unwrap_or_else(|| WarningCode::LateFrames.remedy().to_owned())
        };
        let Some(InVain { scattered, .. }) = late.in_vain else { return catch() };
        let mut ways = Vec::new();
        // Neither a phase nor a time catches what the task itself holds up.
        let may_wait = sources.may_wait_for(self.priority);
        if let Some(priority) = self.priority.filter(|_| may_wait) {
            ways.push(make_way(priority, sources));
        }
        if sources.may_be_control_nodes() {
            ways.push(
                "if the task and its source follow each other, let one of them be a plain task"
                    .to_owned(),
            );
        }
        if scattered {
            ways.push(
                "if the source is off the grid, align it with the releases of the task, as docs/wire.md says \
                 (The grid)"
                    .to_owned(),
            );
        } else if !may_wait {
            ways.push(catch());
        }
        ways.join("; ")
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

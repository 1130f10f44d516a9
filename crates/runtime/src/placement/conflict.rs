//! Conflicts between two tasks on one CPU.

use isochrone_timing::units::duration;
use isochrone_timing::{Warning, WarningCode};

use super::clear_phase::clear_phase_ns;
use super::need::Meeting;
use super::{CpuUser, CpuUsers};

/// The part of a CPU that the kernel's throttling lets real-time threads use by default.
const MOST_WATCHED: f64 = 0.95;

/// A conflict between two tasks on one CPU.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Conflict {
    /// The CPU.
    pub cpu: u32,
    /// One task.
    pub first: CpuUser,
    /// The other.
    pub second: CpuUser,
    /// What the conflict is.
    pub kind: ConflictKind,
}

/// What the conflict between two tasks is.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum ConflictKind {
    /// They need the CPU at the same time.
    Meeting(Meeting),
    /// The first task watches for frames of the second and [starves](isochrone_engine::starves) it: while the first
    /// watches, the second does not run.
    StarvedSource {
        /// The service that the first task follows.
        service: String,
    },
}

impl CpuUsers {
    /// The conflicts that the plan's node will have, among its own tasks and with the tasks that run already.
    ///
    /// Left out are:
    /// - tasks without a fixed CPU, and tasks with normal scheduling that only sleep;
    /// - meetings with a task of another node whose grid has no phase to this one's that is known before the start;
    /// - meetings of the plan's own tasks at different priorities: the priorities settle which of them waits;
    /// - starved sources among the plan's own tasks on CPUs that the configuration names: the check of the
    ///   configuration reports those.
    pub fn conflicts(&self) -> Vec<Conflict> {
        let is_chosen = |task: &CpuUser| {
            let mut chosen = self.auto_cpus.iter().filter_map(|index| self.own.get(*index));
            chosen.any(|other| other.task == task.task)
        };
        let own = Conflict::among(&self.own).into_iter().filter(|it| match it.kind {
            ConflictKind::Meeting(_) => it.first.priority() == it.second.priority(),
            ConflictKind::StarvedSource { .. } => is_chosen(&it.first) || is_chosen(&it.second),
        });
        let pairs = self.own.iter().flat_map(|task| self.running.iter().map(move |it| (task, it)));
        let with_others = pairs.flat_map(|(task, other)| {
            let is_known = other.is_on_grid_with(&task.need());
            let conflicts = Conflict::between(task, other).into_iter();
            conflicts.filter(move |it| is_known || it.is_starved_source())
        });
        let mut conflicts: Vec<Conflict> = own.chain(with_others).collect();
        conflicts.sort_by_key(Conflict::is_starved_source);
        conflicts
    }
}

impl Conflict {
    /// The conflicts among tasks that run.
    pub fn among(tasks: &[CpuUser]) -> Vec<Self> {
        let behind = |index: usize| tasks.iter().skip(index + 1);
        let all = tasks.iter().enumerate();
        all.flat_map(|(index, first)| behind(index).flat_map(|second| Self::between(first, second)))
            .collect()
    }

    /// The conflicts of two tasks. If one of them follows the other at a real-time priority, they are supposed to meet,
    /// so only starvation counts.
    pub(super) fn between(first: &CpuUser, second: &CpuUser) -> Vec<Self> {
        let Some(cpu) = first.placement.cpu.filter(|cpu| second.placement.cpu == Some(*cpu)) else {
            return Vec::new();
        };
        let conflict = |first: &CpuUser, second: &CpuUser, kind| Self {
            cpu,
            first: first.clone(),
            second: second.clone(),
            kind,
        };
        let both_ways = [(first, second), (second, first)];
        if both_ways.iter().any(|(a, b)| a.priority().is_some() && a.follows(b).is_some()) {
            let starved = both_ways.into_iter().filter_map(|(follower, source)| {
                let service = follower.starves(source)?.to_owned();
                Some(conflict(follower, source, ConflictKind::StarvedSource { service }))
            });
            return starved.collect();
        }
        if !first.is_punctual() || !second.is_punctual() {
            return Vec::new();
        }
        let meeting = first.need().meeting(&second.need());
        let meeting = meeting.map(|it| conflict(first, second, ConflictKind::Meeting(it)));
        meeting.into_iter().collect()
    }

    /// Whether the first task keeps the second, its source, from sending.
    pub fn is_starved_source(&self) -> bool {
        matches!(self.kind, ConflictKind::StarvedSource { .. })
    }
}

impl From<&Conflict> for Warning {
    fn from(conflict: &Conflict) -> Self {
        match &conflict.kind {
            ConflictKind::Meeting(meeting) => Self {
                code: WarningCode::SharedCpu,
                message: meeting_message(conflict, meeting),
                remedy: meeting_remedy(conflict),
            },
            ConflictKind::StarvedSource { service } => starved_source(conflict, service),
        }
    }
}

/// `a.fast and b.fast share CPU 1 and meet at each release, 0 ns apart: both need it for up to 202 us, and …`
fn meeting_message(conflict: &Conflict, meeting: &Meeting) -> String {
    let Conflict { cpu, first, second, .. } = conflict;
    let Meeting { met, of, apart_ns, overlap_ns } = *meeting;
    let (one, other) = (first.full_name(), second.full_name());
    let releases =
        if met == of { "each release".into() } else { format!("{met} of {of} releases") };
    let [apart, overlap] = [apart_ns, overlap_ns].map(|ns| duration(ns as f64));
    let mut message = format!(
        "{one} and {other} share CPU {cpu} and meet at {releases} of {one}, {apart} apart: both need the CPU \
         for up to {overlap}, and {}",
        who_waits(first, second)
    );
    let share = first.watched_share() + second.watched_share();
    if share >= MOST_WATCHED {
        message += &format!(
            "; together they may watch the clock for {:.0} % of it, of which the kernel leaves real-time \
             threads 95 % unless it is told otherwise",
            share * 100.0
        );
    }
    message
}

/// Which of two tasks waits when they meet.
fn who_waits(first: &CpuUser, second: &CpuUser) -> String {
    let (lower, higher) = match (first.priority(), second.priority()) {
        (None, None) => return "they take turns on it".into(),
        (a, b) if a < b => (first, second),
        (a, b) if a > b => (second, first),
        _ => {
            return format!(
                "at equal priority ({}) the one that wakes up later waits until the other sleeps",
                first.placement.scheduler
            );
        }
    };
    let named = |task: &CpuUser| format!("{} ({})", task.full_name(), task.placement.scheduler);
    format!("{} waits for {}", named(lower), named(higher))
}

/// Suggests `phase = "auto"` only where the phase is not chosen already and some phase keeps clear of the other task.
fn meeting_remedy(Conflict { first, second, .. }: &Conflict) -> String {
    let task = first.full_name();
    let clear = clear_phase_ns(&first.need_without_phase(), &[second.need()]);
    if clear.clear_ns.is_some() && first.placement.phase_reason.is_none() {
        return format!(
            "give {task} phase = \"auto\", which keeps clear of what runs, or another cpu"
        );
    }
    let watches = [first, second].iter().any(|task| task.placement.follow.is_some());
    let within = if watches { " or a shorter within" } else { "" };
    format!("give {task} another cpu, or a smaller margin{within}")
}

fn starved_source(conflict: &Conflict, service: &str) -> Warning {
    let Conflict { cpu, first: follower, second: source, .. } = conflict;
    let (one, other) = (follower.full_name(), source.full_name());
    let message = format!(
        "{one} ({}) follows \"{service}\" of {other} ({}) on the same CPU {cpu}: while the one watches, the \
         other cannot send",
        follower.placement.scheduler, source.placement.scheduler,
    );
    // Below a source without a priority there is none to give the follower.
    let remedy = match source.priority() {
        Some(_) => format!("give {one} a lower priority than {other} has, or another cpu"),
        None => format!("give {other} a higher priority than {one} has, or another cpu"),
    };
    Warning { code: WarningCode::StarvedSource, message, remedy }
}

#[cfg(test)]
#[path = "conflict_tests.rs"]
mod tests;

//! A task as a user of a CPU.

use isochrone_engine::{TaskPlan, starves};
use isochrone_model::{EPOCH_GRID_NS, EPOCH_OFFSET_NS};

use super::need::Need;

use isochrone_control::Placement;

/// What a task needs after its release is rounded up to a multiple of this, so that the same node on the
/// same machine gets the same answers.
const RESPONSE_STEP_NS: u64 = 10_000;

/// A task, with the CPU that it needs and when.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CpuUser {
    /// Its node.
    pub node: String,
    /// Its name.
    pub task: String,
    /// From release to release, ns.
    pub period_ns: u64,
    /// When it needs which CPU.
    pub placement: Placement,
}

impl CpuUser {
    /// A task of a plan, as it will be when its node runs: on the grid that nodes share.
    pub(crate) fn planned(node: &str, task: &TaskPlan) -> Self {
        let TaskPlan { name, settings, outputs, .. } = task;
        let schedule = settings.schedule();
        Self {
            node: node.to_owned(),
            task: name.clone(),
            period_ns: schedule.period_ns,
            placement: Placement {
                cpu: settings.cpu.number(),
                scheduler: settings
                    .priority
                    .map_or_else(|| "other".into(), |n| format!("fifo:{n}")),
                wake: schedule.wake.as_str().to_owned(),
                first_release_ns: EPOCH_OFFSET_NS + schedule.phase_ns,
                longest_watch_ns: schedule.longest_watch_ns(),
                response_ns: None,
                phase_reason: settings.phase_reason.clone(),
                cpu_reason: None,
                follow: settings.follow.clone(),
                sends: outputs.iter().map(|output| output.service.clone()).collect(),
            },
        }
    }

    /// When it needs its CPU. A task that follows a service may need it until its wait is up, however early its
    /// frames have arrived so far.
    pub(super) fn need(&self) -> Need {
        let Placement { first_release_ns, longest_watch_ns, response_ns, .. } = self.placement;
        let response_ns = response_ns.unwrap_or_default().next_multiple_of(RESPONSE_STEP_NS);
        Need {
            period_ns: self.period_ns,
            release_ns: first_release_ns,
            before_ns: longest_watch_ns,
            after_ns: response_ns.max(self.follow_within_ns()),
        }
    }

    /// When it would need its CPU if it had no phase.
    pub(super) fn need_without_phase(&self) -> Need {
        Need { release_ns: EPOCH_OFFSET_NS, ..self.need() }
    }

    /// How long after a release it watches for a frame, in ns.
    fn follow_within_ns(&self) -> u64 {
        self.placement.follow.as_ref().map_or(0, |follow| follow.within_ns)
    }

    /// The part of a CPU for which it may watch the clock at a real-time priority.
    pub(super) fn watched_share(&self) -> f64 {
        let watch_ns = self.placement.longest_watch_ns.saturating_add(self.follow_within_ns());
        let share = watch_ns.min(self.period_ns) as f64 / self.period_ns.max(1) as f64;
        if self.priority().is_some() { share } else { 0.0 }
    }

    /// Whether it has to be on time: a task with normal scheduling that only sleeps is late anyway, and does not hold
    /// up others for long.
    pub(super) fn is_punctual(&self) -> bool {
        let watches = self.placement.longest_watch_ns > 0 || self.placement.follow.is_some();
        self.priority().is_some() || watches
    }

    /// The SCHED_FIFO priority that it has.
    pub(super) fn priority(&self) -> Option<u8> {
        self.placement.scheduler.strip_prefix("fifo:")?.parse().ok()
    }

    /// Its name with that of its node: `plant.fast`.
    pub(super) fn full_name(&self) -> String {
        format!("{}.{}", self.node, self.task)
    }

    /// The service of another task that it follows.
    pub(super) fn follows(&self, source: &Self) -> Option<&str> {
        let service = &self.placement.follow.as_ref()?.service;
        source.placement.sends.contains(service).then_some(service)
    }

    /// The service of another task that it follows, if it would keep that task from sending on a shared CPU.
    pub(super) fn starves(&self, source: &Self) -> Option<&str> {
        self.follows(source).filter(|_| starves(self.priority(), source.priority()))
    }

    /// Whether the phase of this task to a node that is about to start is known. It is not if their relative
    /// positions repeat at a step that does not divide the grid that nodes share.
    pub(super) fn is_on_grid_with(&self, task: &Need) -> bool {
        EPOCH_GRID_NS.is_multiple_of(self.need().step_ns(task))
    }
}

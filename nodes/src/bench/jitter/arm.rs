//! An arm: one way to run a loop, and what its turns have shown.

use std::sync::Arc;
use std::time::Duration;

use isochrone_cyclic::{
    Cyclic, Margin, Monotonic, Schedule, ThreadGrant, ThreadRequest, ThreadUsage, Wake,
};
use isochrone_engine::Plan;
use isochrone_ipc::Domain;
use isochrone_processes::Stop;
use isochrone_report::{LoopArm, TaskArm};
use isochrone_timing::{Distribution, TaskReport, Warning, WarningCode};

use super::{Settings, WARM_UP, cyclictest, loops, node};
use crate::failure::Failure;
use crate::run;

/// Ways to run a loop.
#[derive(Clone)]
pub(super) enum Kind {
    /// The node's executor with nothing to do in a cycle.
    Loop {
        wake: Wake,
        /// Whether to hold the machine out of its idle states meanwhile.
        awake: bool,
        /// Most that may be counted of a turn.
        longest: Option<Duration>,
    },
    /// The program of that name.
    Cyclictest,
    /// The whole node.
    Node(Arc<Plan>),
}

impl Kind {
    /// What cyclictest does: sleep to the release, and hold `/dev/cpu_dma_latency` at 0.
    pub(super) const fn sleep() -> Self {
        Self::Loop { wake: Wake::Sleep, awake: true, longest: None }
    }

    pub(super) const fn hybrid(cpu_budget: f64) -> Self {
        let wake = Wake::Hybrid(Margin::Adaptive { cpu_budget });
        Self::Loop { wake, awake: false, longest: None }
    }

    pub(super) const fn spin(longest: Option<Duration>) -> Self {
        Self::Loop { wake: Wake::Spin, awake: false, longest }
    }
}

/// A turn: for how long, and who wants to know.
pub(super) struct Turn<'a> {
    /// Without the warm-up.
    pub(super) counted: Duration,
    pub(super) stop: &'a Stop,
    pub(super) domain: &'a Domain,
    /// Called some fifty times a second.
    pub(super) pass: &'a dyn Fn(),
}

/// What a turn used, after its warm-up.
#[derive(Default)]
pub(super) struct Used {
    pub(super) usage: ThreadUsage,
    pub(super) elapsed_ns: u64,
}

/// An arm under one set of circumstances.
pub(super) struct Arm {
    pub(super) name: String,
    kind: Kind,
    pub(super) period_ns: u64,
    pub(super) phase_ns: u64,
    pub(super) request: ThreadRequest,
    pub(super) cpu: usize,
    pub(super) timing: LoopArm,
    /// Lives as long as the arm, so that an adaptive margin keeps what it learned.
    cyclic: Option<Cyclic<Monotonic>>,
    pub(super) grant: Option<ThreadGrant>,
    pub(super) margin_ns: Option<u64>,
    used: Used,
}

impl Arm {
    pub(super) fn new(
        name: &str,
        kind: Kind,
        period_ns: u64,
        settings: &Settings,
        origin_ns: u64,
    ) -> Self {
        Self {
            name: name.to_owned(),
            kind,
            period_ns,
            phase_ns: settings.phase_ns,
            request: ThreadRequest { priority: settings.priority, cpu: Some(settings.cpu) },
            cpu: settings.cpu,
            timing: LoopArm::new(period_ns, origin_ns),
            cyclic: None,
            grant: None,
            margin_ns: None,
            used: Used::default(),
        }
    }

    /// Has a turn.
    pub(super) fn take(&mut self, turn: &Turn<'_>) -> Result<(), Failure> {
        let used = match self.kind.clone() {
            Kind::Loop { wake, awake, longest } => {
                let longest = longest.filter(|_| self.is_real_time());
                let counted = longest.map_or(turn.counted, |longest| longest.min(turn.counted));
                let schedule = Schedule::every(self.period_ns, wake);
                let flag = turn.stop.flag();
                let mut cyclic = self
                    .cyclic
                    .take()
                    .unwrap_or_else(|| Cyclic::new(Monotonic, schedule, u64::MAX, flag));
                let setting = loops::Setting { awake, rest: longest.is_some() };
                let turn = Turn { counted, ..*turn };
                let used = loops::turn(self, &mut cyclic, &turn, setting)?;
                self.cyclic = Some(cyclic);
                used
            }
            Kind::Cyclictest => cyclictest::turn(self, turn)?,
            Kind::Node(plan) => node::turn(self, &plan, turn)?,
        };
        self.used.elapsed_ns += used.elapsed_ns;
        let (sum, more) = (&mut self.used.usage, used.usage);
        sum.cpu_ns += more.cpu_ns;
        sum.minor_faults += more.minor_faults;
        sum.major_faults += more.major_faults;
        sum.voluntary_switches += more.voluntary_switches;
        sum.involuntary_switches += more.involuntary_switches;
        Ok(())
    }

    /// Release jitter so far.
    pub(super) fn jitter(&self) -> &Distribution {
        self.timing.raw()
    }

    /// What the machine refused, and what came of it in turns of this length.
    pub(super) fn warnings(&self, counted: Duration) -> impl Iterator<Item = Warning> {
        let refusals = self.grant.iter().flat_map(|grant| &grant.refusals).map(run::warning);
        refusals.chain(self.spins_in_bursts(counted))
    }

    fn spins_in_bursts(&self, counted: Duration) -> Option<Warning> {
        let Kind::Loop { longest: Some(longest), .. } = self.kind else { return None };
        (longest < counted && self.is_real_time()).then(|| Warning {
            code: WarningCode::SpinInBursts,
            message: format!(
                "{} counts only {} ms of a turn: the kernel stops real-time threads that never sleep",
                self.name,
                longest.as_millis()
            ),
            remedy: "sysctl -w kernel.sched_rt_runtime_us=-1".into(),
        })
    }

    /// Whether the kernel granted a priority; before the first turn, whether one is asked for.
    fn is_real_time(&self) -> bool {
        match &self.grant {
            Some(grant) => ["fifo", "rr"].iter().any(|class| grant.scheduler.starts_with(class)),
            None => self.request.priority.is_some(),
        }
    }

    pub(super) fn report(&self, load: &str) -> TaskArm {
        let usage = self.used.usage;
        // Another program's thread tells its CPU time only.
        let seen = |count| (!matches!(self.kind, Kind::Cyclictest)).then_some(count);
        let (scheduler, cpu) = match &self.grant {
            Some(grant) => (grant.scheduler.clone(), grant.cpu),
            // cyclictest says nothing; it ends with an error if it does not get what it asks for.
            None => (
                self.request.priority.map_or("other".into(), |priority| format!("fifo:{priority}")),
                self.request.cpu,
            ),
        };
        let arm = self.timing.report(&self.name);
        let task = TaskReport {
            wake: match &self.kind {
                Kind::Loop { wake, .. } => wake.as_str().into(),
                Kind::Cyclictest => "sleep".into(),
                Kind::Node(plan) => {
                    plan.tasks.first().map_or("", |task| task.schedule.wake.as_str()).into()
                }
            },
            margin_ns: self.margin_ns,
            scheduler,
            cpu,
            cpu_fraction: (self.used.elapsed_ns > 0)
                .then(|| usage.cpu_ns as f64 / self.used.elapsed_ns as f64),
            minor_faults: seen(usage.minor_faults),
            major_faults: seen(usage.major_faults),
            voluntary_switches: seen(usage.voluntary_switches),
            involuntary_switches: seen(usage.involuntary_switches),
            ..arm.task
        };
        TaskArm { task, load: load.to_owned(), ..arm }
    }
}

/// How many cycles a turn has at most, the warm-up's and the one after the end included.
pub(super) fn cycles(period_ns: u64, counted: Duration) -> usize {
    ((WARM_UP + counted).as_nanos() as u64 / period_ns.max(1)) as usize + 2
}

//! An arm: one way to run a loop, and what its turns have shown.

use std::sync::Arc;
use std::time::Duration;

use isochrone_cyclic::{
    Cyclic, Margin, Monotonic, Pinning, Schedule, ThreadGrant, ThreadRequest, Wake,
};
use isochrone_engine::Plan;
use isochrone_report::{LoopArm, TaskArm};
use isochrone_runtime::TaskCpus;
use isochrone_timing::{Distribution, TaskReport, Warning, WarningCode};

use super::peers::{self, Peers};
use super::settings::JitterSettings;
use super::turn::{Terms, Turn, TurnResult, Used};
use super::{cyclictest, loops, node};
use crate::BenchError;

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
    /// The whole node, its tasks placed.
    Node(Arc<Plan>, TaskCpus),
    /// A node of the bench's own, with such peers.
    Peers(Peers),
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

/// What takes part, under all circumstances.
pub(super) struct Entrant {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) cpu: usize,
    /// Why the CPU is the best, of all or of several that were named.
    pub(super) cpu_reason: Option<String>,
}

/// An arm under one set of circumstances.
pub(super) struct Arm {
    name: String,
    kind: Kind,
    terms: Terms,
    cpu_reason: Option<String>,
    timing: LoopArm,
    /// Lives as long as the arm, so that an adaptive margin keeps what it learned.
    cyclic: Option<Cyclic<Monotonic>>,
    grant: Option<ThreadGrant>,
    margin_ns: Option<u64>,
    /// What all turns used; `None` until one tells.
    used: Option<Used>,
    /// What came up in its turns.
    warnings: Vec<Warning>,
}

impl Arm {
    pub(super) fn new(
        entrant: &Entrant,
        period_ns: u64,
        settings: &JitterSettings,
        origin_ns: u64,
    ) -> Self {
        let Entrant { name, kind, cpu, cpu_reason } = entrant;
        let request = ThreadRequest { priority: settings.priority, cpu: Pinning::Named(*cpu) };
        let (phase_ns, cpu) = (settings.phase_ns, *cpu);
        Self {
            name: name.clone(),
            kind: kind.clone(),
            terms: Terms { period_ns, phase_ns, request, cpu },
            cpu_reason: cpu_reason.clone(),
            timing: LoopArm::new(period_ns, origin_ns),
            cyclic: None,
            grant: None,
            margin_ns: None,
            used: None,
            warnings: Vec::new(),
        }
    }

    /// Has a turn.
    pub(super) fn take(&mut self, turn: &Turn<'_>) -> Result<(), BenchError> {
        let result = match self.kind.clone() {
            Kind::Loop { wake, awake, longest } => {
                let longest = longest.filter(|_| self.is_real_time());
                let counted = longest.map_or(turn.counted, |longest| longest.min(turn.counted));
                let schedule = Schedule::every(self.terms.period_ns, wake);
                let flag = turn.stop.flag();
                let cyclic = self
                    .cyclic
                    .get_or_insert_with(|| Cyclic::new(Monotonic, schedule, u64::MAX, flag));
                let setting = loops::Setting { awake, rest: longest.is_some() };
                loops::turn(&self.terms, cyclic, &Turn { counted, ..*turn }, setting)?
            }
            Kind::Cyclictest => cyclictest::turn(&self.terms, turn)?,
            Kind::Peers(peers) => peers::turn(&self.name, peers, &self.terms, turn)?,
            Kind::Node(plan, cpus) => node::turn(&self.name, &self.terms, (&plan, &cpus), turn)?,
        };
        self.add(result);
        Ok(())
    }

    fn add(&mut self, result: TurnResult) {
        let TurnResult {
            records,
            follows,
            counted,
            watch,
            thread_usage,
            grant,
            margin_ns,
            used,
            warnings,
        } = result;
        if let Some(counted) = counted {
            let mut disturbance = watch.since(counted.start);
            if let Some(thread_usage) = thread_usage {
                disturbance.faults = Some(thread_usage.minor_faults + thread_usage.major_faults);
                disturbance.preemptions = Some(thread_usage.involuntary_switches);
            }
            self.timing.turn(&records, &follows, counted, disturbance, |at_ns| watch.around(at_ns));
        }
        self.grant = grant.or(self.grant.take());
        self.margin_ns = margin_ns;
        self.used = match (self.used, used) {
            (Some(sum), Some(more)) => Some(sum.and(more)),
            (sum, more) => sum.or(more),
        };
        for warning in warnings {
            if !self.warnings.contains(&warning) {
                self.warnings.push(warning);
            }
        }
    }

    /// Release jitter so far.
    pub(super) fn jitter(&self) -> &Distribution {
        self.timing.raw()
    }

    /// What the machine refused, and what came of it in turns of this length.
    pub(super) fn warnings(&self, counted: Duration) -> impl Iterator<Item = Warning> {
        let refusals =
            self.grant.iter().flat_map(|grant| &grant.refusals).map(isochrone_runtime::warning);
        refusals.chain(self.warnings.iter().cloned()).chain(self.spins_in_bursts(counted))
    }

    fn spins_in_bursts(&self, counted: Duration) -> Option<Warning> {
        let Kind::Loop { longest: Some(longest), .. } = self.kind else { return None };
        (longest < counted && self.is_real_time()).then(|| Warning::new(
            WarningCode::SpinInBursts,
            format!(
                "{} counts only {} ms of a turn: the kernel stops real-time threads that never sleep",
                self.name,
                longest.as_millis()
            ),
        ))
    }

    /// Whether the kernel granted a priority; before the first turn, whether one is asked for.
    fn is_real_time(&self) -> bool {
        match &self.grant {
            Some(grant) => ["fifo", "rr"].iter().any(|class| grant.scheduler.starts_with(class)),
            None => self.terms.request.priority.is_some(),
        }
    }

    pub(super) fn report(&self, load: &str) -> TaskArm {
        let usage = self.used.and_then(|used| used.usage);
        let (scheduler, cpu) = match &self.grant {
            Some(grant) => (grant.scheduler.clone(), grant.cpu),
            // cyclictest says nothing; it ends with an error if it does not get what it asks for.
            None => (
                self.terms
                    .request
                    .priority
                    .map_or("other".into(), |priority| format!("fifo:{priority}")),
                self.terms.request.cpu.cpu(),
            ),
        };
        let arm = self.timing.report(&self.name);
        let task = TaskReport {
            wake: match &self.kind {
                Kind::Loop { wake, .. } => wake.as_str().into(),
                Kind::Cyclictest => Wake::Sleep.as_str().into(),
                Kind::Peers(_) => Wake::Hybrid(Margin::default()).as_str().into(),
                Kind::Node(plan, _) => {
                    plan.tasks.first().map_or("", |task| task.settings.wake.as_str()).into()
                }
            },
            margin_ns: self.margin_ns,
            scheduler,
            cpu,
            cpu_reason: self.cpu_reason.clone().filter(|_| cpu.is_some()),
            cpu_fraction: self
                .used
                .filter(|used| used.elapsed_ns > 0)
                .map(|used| used.cpu_ns as f64 / used.elapsed_ns as f64),
            minor_faults: usage.map(|usage| usage.minor_faults),
            major_faults: usage.map(|usage| usage.major_faults),
            voluntary_switches: usage.map(|usage| usage.voluntary_switches),
            involuntary_switches: usage.map(|usage| usage.involuntary_switches),
            ..arm.task
        };
        TaskArm { task, load: load.to_owned(), ..arm }
    }
}

//! Which tasks share a CPU and need it at the same time.

use std::fmt;

use isochrone_cyclic::EPOCH_OFFSET_NS;
use isochrone_engine::{Plan, TaskPlan};
use isochrone_schedule::{Meeting, Need, clear_phase_ns};
use isochrone_timing::units::duration;
use isochrone_timing::{Warning, WarningCode};

use crate::neighbours::Neighbour;
use crate::node::EPOCH_GRID_NS;
use isochrone_control::{Followed, Placement};

/// What a task needs after its release is rounded up to a multiple of this, so that the same node on the
/// same machine gets the same answers.
const RESPONSE_STEP_NS: u64 = 10_000;

/// What the kernel's throttling leaves real-time threads of a CPU by default.
const MOST_WATCHED: f64 = 0.95;

/// Two tasks on one CPU that need it at the same time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SharedCpu {
    /// The CPU.
    pub cpu: u32,
    /// One task.
    pub first: Neighbour,
    /// The other.
    pub second: Neighbour,
    /// How they meet.
    pub meeting: Meeting,
}

impl Neighbour {
    /// A task of a plan, as it will be when its node runs: on the grid that nodes share.
    pub(crate) fn planned(node: &str, task: &TaskPlan) -> Self {
        let TaskPlan { name, schedule, priority, cpu, followed_service, outputs, .. } = task;
        Self {
            node: node.to_owned(),
            task: name.clone(),
            period_ns: schedule.period_ns,
            placement: Placement {
                cpu: cpu.number(),
                scheduler: priority.map_or_else(|| "other".into(), |n| format!("fifo:{n}")),
                wake: schedule.wake.as_str().to_owned(),
                first_release_ns: EPOCH_OFFSET_NS + schedule.phase_ns,
                longest_watch_ns: schedule.longest_watch_ns(),
                response_ns: None,
                phase_reason: task.phase_choice.reason().map(str::to_owned),
                cpu_reason: None,
                follow: Followed::of(schedule, followed_service.as_deref()),
                sends: outputs.iter().map(|output| output.service.clone()).collect(),
            },
        }
    }

    /// When it needs its CPU. One that follows a service may need it until its wait is up, however soon its
    /// frames have come so far.
    pub fn need(&self) -> Need {
        let Placement { first_release_ns, longest_watch_ns, response_ns, .. } = self.placement;
        let response_ns = response_ns.unwrap_or_default().next_multiple_of(RESPONSE_STEP_NS);
        Need {
            period_ns: self.period_ns,
            release_ns: first_release_ns,
            before_ns: longest_watch_ns,
            after_ns: response_ns.max(self.placement.follow_within_ns()),
        }
    }

    /// The part of a CPU for which it may watch the clock at a real-time priority.
    fn watched_share(&self) -> f64 {
        let Placement { longest_watch_ns, .. } = self.placement;
        let watch_ns = longest_watch_ns.saturating_add(self.placement.follow_within_ns());
        let share = watch_ns.min(self.period_ns) as f64 / self.period_ns.max(1) as f64;
        if self.priority().is_some() { share } else { 0.0 }
    }

    /// The SCHED_FIFO priority that it has.
    pub(crate) fn priority(&self) -> Option<u8> {
        self.placement.scheduler.strip_prefix("fifo:")?.parse().ok()
    }

    /// Its name with that of its node: `plant.fast`.
    pub(crate) fn full_name(&self) -> String {
        format!("{}.{}", self.node, self.task)
    }

    /// Whether a node that is to start knows how its grid will lie to this one's. It begins on a multiple of
    /// [`EPOCH_GRID_NS`]; what repeats on another step cannot be known before.
    pub(crate) fn is_on_grid_with(&self, task: &Need) -> bool {
        EPOCH_GRID_NS.is_multiple_of(self.need().step_ns(task))
    }
}

impl SharedCpu {
    /// Which of a plan's tasks will share a CPU with each other, or with what runs, and need it at the same
    /// time. Tasks that may move between CPUs are left out, and tasks with normal scheduling that only
    /// sleep; so are pairs whose grids do not lie to each other in a way that can be known before the start,
    /// and tasks of the plan with different priorities, which say who is to wait. A real-time task that
    /// follows another one is left out, too: it is meant to be there when that one sends, and
    /// [`StarvedSource`](crate::StarvedSource) tells where it is in the way.
    pub fn of_plan(plan: &Plan, running: &[Neighbour]) -> Vec<Self> {
        let planned: Vec<_> =
            plan.tasks.iter().map(|task| Neighbour::planned(&plan.node, task)).collect();
        let mut shared = Self::of_running(&planned);
        shared.retain(|pair| pair.first.priority() == pair.second.priority());
        for task in &planned {
            let known = running.iter().filter(|other| other.is_on_grid_with(&task.need()));
            shared.extend(known.filter_map(|other| Self::of(task, other)));
        }
        shared
    }

    /// Which tasks share a CPU and need it at the same time, without those that may move between CPUs, or that
    /// have normal scheduling and only sleep, and without real-time tasks that follow each other.
    pub fn of_running(running: &[Neighbour]) -> Vec<Self> {
        let pairs = running.iter().enumerate().flat_map(|(index, first)| {
            running.iter().skip(index + 1).map(move |second| (first, second))
        });
        pairs.filter_map(|(first, second)| Self::of(first, second)).collect()
    }

    /// How two tasks do.
    pub(crate) fn of(first: &Neighbour, second: &Neighbour) -> Option<Self> {
        let cpu = first.placement.cpu.filter(|cpu| second.placement.cpu == Some(*cpu))?;
        let follows = |one: &Neighbour, other: &Neighbour| {
            one.priority().is_some() && one.followed_in(other).is_some()
        };
        if !is_punctual(first) || !is_punctual(second) {
            return None;
        }
        if follows(first, second) || follows(second, first) {
            return None;
        }
        let meeting = first.need().meeting(&second.need())?;
        Some(Self { cpu, first: first.clone(), second: second.clone(), meeting })
    }

    /// What to do about it. Where the phase is chosen already, or where no phase is clear of the other task,
    /// choosing one does not help.
    pub fn remedy(&self) -> String {
        let Self { first, second, .. } = self;
        let grid = Need { release_ns: EPOCH_OFFSET_NS, ..first.need() };
        let has_room = clear_phase_ns(&grid, &[second.need()]).clear_ns.is_some();
        if has_room && first.placement.phase_reason.is_none() {
            let task = first.full_name();
            return format!(
                "give {task} phase = \"auto\", which keeps clear of what runs, or another cpu"
            );
        }
        let watches = |task: &Neighbour| task.placement.follow.is_some();
        let within = if watches(first) || watches(second) { " or a shorter within" } else { "" };
        format!("give {} another cpu, or a smaller margin{within}", first.full_name())
    }

    /// What their schedulers make of it.
    fn consequence(&self) -> String {
        let [first, second] = [&self.first, &self.second];
        let waits = |one: &Neighbour, other: &Neighbour| {
            format!(
                "{} ({}) waits for {} ({})",
                one.full_name(),
                one.placement.scheduler,
                other.full_name(),
                other.placement.scheduler
            )
        };
        match (first.priority(), second.priority()) {
            (None, None) => "they take turns on it".into(),
            (a, b) if a < b => waits(first, second),
            (a, b) if a > b => waits(second, first),
            _ => format!(
                "at equal priority ({}) the one that wakes up later waits until the other sleeps",
                first.placement.scheduler
            ),
        }
    }
}

/// Whether a task means to be punctual: one with normal scheduling that only sleeps is late anyway, and
/// holds up nobody for long.
fn is_punctual(task: &Neighbour) -> bool {
    let watches = task.placement.longest_watch_ns > 0 || task.placement.follow.is_some();
    task.priority().is_some() || watches
}

/// `a.fast and b.fast share CPU 1 and meet at each release, 0 ns apart: both need it for up to 202 us, and …`
impl fmt::Display for SharedCpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cpu, first, second, meeting } = self;
        let Meeting { met, of, apart_ns, overlap_ns } = *meeting;
        let (one, other) = (first.full_name(), second.full_name());
        write!(f, "{one} and {other} share CPU {cpu} and meet at ")?;
        if met == of {
            write!(f, "each release of {one}")?;
        } else {
            write!(f, "{met} of {of} releases of {one}")?;
        }
        write!(
            f,
            ", {} apart: both need the CPU for up to {}, and {}",
            duration(apart_ns as f64),
            duration(overlap_ns as f64),
            self.consequence()
        )?;
        let share = first.watched_share() + second.watched_share();
        if share >= MOST_WATCHED {
            write!(
                f,
                "; together they may watch the clock for {:.0} % of it, of which the kernel leaves real-time \
                 threads 95 % unless it is told otherwise",
                share * 100.0
            )?;
        }
        Ok(())
    }
}

impl From<&SharedCpu> for Warning {
    fn from(shared: &SharedCpu) -> Self {
        let (code, message) = (WarningCode::SharedCpu, shared.to_string());
        Self { code, message, remedy: shared.remedy() }
    }
}

#[cfg(test)]
mod tests {
    use isochrone_engine::config::PhaseChoice;
    use isochrone_engine::{Rules, Source};

    use super::*;

    fn plan(tasks: &str) -> Plan {
        let text = format!("[node]\nname = \"b\"\n{tasks}");
        Plan::new(Source::new("b.toml", text), &Rules::default()).unwrap()
    }

    const FAST: &str = "[[task]]\nname = \"fast\"\nperiod = \"1ms\"\npriority = 80\ncpu = 1\n";

    fn running(phase_ns: u64) -> Neighbour {
        let mut task = Neighbour::planned("a", &plan(FAST).tasks[0]);
        task.placement.first_release_ns += 40_000_000 + phase_ns;
        task.placement.response_ns = Some(1_234);
        task
    }

    #[test]
    fn a_node_of_the_same_period_and_phase_on_the_same_cpu_is_met_at_each_release() {
        let shared = SharedCpu::of_plan(&plan(FAST), &[running(0)]);
        let said: Vec<_> = shared.iter().map(ToString::to_string).collect();
        assert_eq!(
            said,
            [
                "b.fast and a.fast share CPU 1 and meet at each release of b.fast, 0 ns apart: both need the \
              CPU for up to 200 us, and at equal priority (fifo:80) the one that wakes up later waits until \
              the other sleeps"
            ]
        );
        assert_eq!(SharedCpu::of_plan(&plan(FAST), &[running(500_000)]), []);
        let elsewhere = plan(&FAST.replace("cpu = 1", "cpu = 0"));
        assert_eq!(SharedCpu::of_plan(&elsewhere, &[running(0)]), []);
        let moves = plan(&FAST.replace("cpu = 1", ""));
        assert_eq!(SharedCpu::of_plan(&moves, &[running(0)]), []);
    }

    #[test]
    fn a_phase_is_no_remedy_where_none_is_clear_or_one_was_chosen() {
        let remedy = |plan: &Plan, other: &Neighbour| {
            SharedCpu::of_plan(plan, std::slice::from_ref(other))[0].remedy()
        };
        let automatic =
            "give b.fast phase = \"auto\", which keeps clear of what runs, or another cpu";
        assert_eq!(remedy(&plan(FAST), &running(0)), automatic);
        let follows = plan(&following().replace("600us", "500us"));
        let other = Neighbour::planned("a", &follows.tasks[0]);
        let expected = "give b.fast another cpu, or a smaller margin or a shorter within";
        assert_eq!(remedy(&follows, &other), expected);
        let said = SharedCpu::of_plan(&follows, &[other])[0].to_string();
        let together =
            "; together they may watch the clock for 120 % of it, of which the kernel leaves";
        assert!(said.contains(together), "{said}");
        let mut chosen = plan(FAST);
        let reason = "between the kernel's ticks".into();
        chosen.tasks[0].phase_choice = PhaseChoice::Automatic { reason };
        assert_eq!(remedy(&chosen, &running(0)), "give b.fast another cpu, or a smaller margin");
    }

    #[test]
    fn the_one_of_lower_priority_waits() {
        let low = plan(&FAST.replace("80", "70").replace("1ms", "2ms"));
        let shared = SharedCpu::of_plan(&low, &[running(0)]);
        let said = shared[0].to_string();
        assert!(said.ends_with("and b.fast (fifo:70) waits for a.fast (fifo:80)"), "{said}");
        let other = Neighbour { period_ns: 4_000_000, ..running(0) };
        let said = SharedCpu::of_plan(&low, &[other])[0].to_string();
        assert!(said.contains("meet at 1 of 2 releases of b.fast"), "{said}");
    }

    #[test]
    fn tasks_of_one_node_meet_too() {
        let two = format!("{FAST}{}", FAST.replace("fast", "slow").replace("1ms", "10ms"));
        let shared = SharedCpu::of_plan(&plan(&two), &[]);
        assert_eq!((shared.len(), shared[0].meeting.of), (1, 10));
    }

    #[test]
    fn tasks_of_one_node_with_different_priorities_are_meant_to_wait_for_each_other() {
        let low = FAST.replace("fast", "slow").replace("80", "70");
        assert_eq!(SharedCpu::of_plan(&plan(&format!("{FAST}{low}")), &[]), []);
    }

    #[test]
    fn a_task_that_only_sleeps_is_in_nobodys_way() {
        let sleeps = plan(&FAST.replace("priority = 80\n", ""));
        assert_eq!(SharedCpu::of_plan(&sleeps, &[running(0)]), []);
    }

    const SAW: &str = "[[input]]\nname = \"saw\"\nservice = \"saw\"\n";

    /// The fast task, which waits for the saw for 600 us after its release.
    fn following() -> String {
        format!(
            "{FAST}margin = \"100us\"\nphase = \"300us\"\n\
             follow = {{ service = \"saw\", within = \"600us\" }}\n{SAW}"
        )
    }

    #[test]
    fn a_task_that_follows_needs_its_cpu_after_its_release_until_its_wait_is_up() {
        let mut task = Neighbour::planned("b", &plan(&following()).tasks[0]);
        for response_ns in [None, Some(12_345), Some(700_001)] {
            task.placement.response_ns = response_ns;
            let Need { before_ns, after_ns, .. } = task.need();
            let expected_ns = if response_ns == Some(700_001) { 710_000 } else { 600_000 };
            assert_eq!((before_ns, after_ns), (100_000, expected_ns), "{response_ns:?}");
        }
        // It watches from 200 to 900 us; the other one needs its CPU from 800 us on.
        let shared = SharedCpu::of_plan(&plan(&following()), &[running(0)]);
        assert_eq!(shared[0].meeting.overlap_ns, 100_000);
        let sleeps = following().replace("priority = 80\n", "").replace("margin = \"100us\"\n", "");
        assert_eq!(SharedCpu::of_plan(&plan(&sleeps), &[running(0)]).len(), 1, "it watches, too");
    }

    #[test]
    fn a_task_that_follows_another_one_is_meant_to_be_there_when_that_one_sends() {
        let source = Neighbour {
            placement: Placement { sends: vec!["saw".into()], ..running(0).placement },
            ..running(0)
        };
        let lower = following().replace("priority = 80", "priority = 70");
        for follower in [&following(), &lower] {
            assert_eq!(SharedCpu::of_plan(&plan(follower), std::slice::from_ref(&source)), []);
        }
        let normal = following().replace("priority = 80", "wake = \"hybrid\"");
        assert_eq!(SharedCpu::of_plan(&plan(&normal), &[source]).len(), 1, "they take turns");
    }

    #[test]
    fn what_cannot_be_known_before_the_start_is_not_said() {
        let odd = plan(&FAST.replace("1ms", "7ms"));
        let other = Neighbour { period_ns: 7_000_000, ..running(0) };
        assert_eq!(SharedCpu::of_plan(&odd, std::slice::from_ref(&other)), []);
        assert_eq!(
            SharedCpu::of_running(&[other.clone(), other]).len(),
            1,
            "of what runs all is known"
        );
    }
}

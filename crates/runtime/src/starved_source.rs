//! Which tasks keep the tasks that they follow from running.

use std::fmt;

use isochrone_engine::Plan;
use isochrone_timing::{Warning, WarningCode};

use crate::neighbours::Neighbour;

/// A real-time task that watches for the frames of another one on its CPU, at the same priority or a higher
/// one: while it watches, the other does not run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StarvedSource {
    /// The CPU.
    pub cpu: u32,
    /// The task that watches.
    pub follower: Neighbour,
    /// The task that it keeps from sending.
    pub source: Neighbour,
    /// What it watches for.
    pub service: String,
}

impl Neighbour {
    /// The service of another task that it follows.
    pub(crate) fn followed_in(&self, source: &Self) -> Option<&str> {
        let service = &self.placement.follow.as_ref()?.service;
        source.placement.sends.contains(service).then_some(service)
    }

    /// The service of another task for which it watches in a way that keeps that one from sending, were they
    /// on one CPU. Without a priority it takes turns with others.
    pub(crate) fn watched_in_the_way_of(&self, source: &Self) -> Option<&str> {
        let is_itself = self.node == source.node && self.task == source.task;
        let is_in_the_way = self.priority().is_some_and(|own| source.priority() <= Some(own));
        self.followed_in(source).filter(|_| is_in_the_way && !is_itself)
    }
}

impl StarvedSource {
    /// Those that there will be when a plan's node runs beside others. What tasks of the plan do to each other
    /// on CPUs that the configuration names, its check says.
    pub fn of_plan(plan: &Plan, running: &[Neighbour]) -> Vec<Self> {
        let planned: Vec<_> =
            plan.tasks.iter().map(|task| Neighbour::planned(&plan.node, task)).collect();
        let pairs = planned.iter().flat_map(|ours| running.iter().map(move |other| (ours, other)));
        let starved = |(ours, other)| [Self::of(ours, other), Self::of(other, ours)];
        let chosen: Vec<_> =
            plan.tasks.iter().zip(&planned).filter(|(task, _)| task.cpu.is_auto()).collect();
        let is_chosen =
            |of: &Self| chosen.iter().any(|(_, task)| of.follower == **task || of.source == **task);
        let among_them = Self::of_running(&planned).into_iter().filter(is_chosen);
        pairs.flat_map(starved).flatten().chain(among_them).collect()
    }

    /// Those among the tasks that run.
    pub fn of_running(running: &[Neighbour]) -> Vec<Self> {
        let followers = running.iter();
        let pairs = followers.flat_map(|task| running.iter().map(move |source| (task, source)));
        pairs.filter_map(|(follower, source)| Self::of(follower, source)).collect()
    }

    fn of(follower: &Neighbour, source: &Neighbour) -> Option<Self> {
        let cpu = follower.placement.cpu.filter(|cpu| source.placement.cpu == Some(*cpu))?;
        let service = follower.watched_in_the_way_of(source)?.to_owned();
        Some(Self { cpu, follower: follower.clone(), source: source.clone(), service })
    }
}

/// `b.fast (fifo:80) follows "plant/saw" of a.fast (fifo:80) on the same CPU 1: while …`
impl fmt::Display for StarvedSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cpu, follower, source, service } = self;
        write!(
            f,
            "{} ({}) follows \"{service}\" of {} ({}) on the same CPU {cpu}: while the one watches, the \
             other cannot send",
            follower.full_name(),
            follower.placement.scheduler,
            source.full_name(),
            source.placement.scheduler,
        )
    }
}

impl From<&StarvedSource> for Warning {
    fn from(starved: &StarvedSource) -> Self {
        let (code, message) = (WarningCode::StarvedSource, starved.to_string());
        let [follower, source] = [&starved.follower, &starved.source].map(Neighbour::full_name);
        // No priority is lower than none.
        let remedy = match starved.source.priority() {
            Some(_) => {
                format!("give {follower} a lower priority than {source} has, or another cpu")
            }
            None => format!("give {source} a higher priority than {follower} has, or another cpu"),
        };
        Self { code, message, remedy }
    }
}

#[cfg(test)]
mod tests {
    use isochrone_engine::config::Cpu;
    use isochrone_engine::{Rules, Source};

    use super::*;

    fn plan(node: &str, task: &str, ports: &str) -> Plan {
        let text = format!(
            "[node]\nname = \"{node}\"\n[[task]]\nname = \"fast\"\nperiod = \"1ms\"\n{task}\n{ports}"
        );
        Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap()
    }

    fn source(task: &str) -> Plan {
        let saw = "[[block]]\nname = \"saw\"\ntype = \"SawTooth\"\nin = { incrementRange = 1 }\n\
                   [[output]]\nservice = \"saw\"\nsignals = [\"saw.value\"]";
        plan("a", task, saw)
    }

    fn follower(task: &str) -> Plan {
        let follow = format!("{task}\nfollow = {{ service = \"saw\", within = \"100us\" }}");
        plan("b", &follow, "[[input]]\nname = \"saw\"\nservice = \"saw\"")
    }

    fn running(plan: &Plan) -> Vec<Neighbour> {
        plan.tasks.iter().map(|task| Neighbour::planned(&plan.node, task)).collect()
    }

    #[test]
    fn a_source_of_the_same_or_a_lower_priority_on_the_cpu_of_its_follower_is_kept_from_sending() {
        let follower = follower("priority = 80\ncpu = 1");
        for task in ["priority = 80\ncpu = 1", "priority = 79\ncpu = 1", "cpu = 1"] {
            let source = source(task);
            let of_follower = StarvedSource::of_plan(&follower, &running(&source));
            assert_eq!(of_follower.len(), 1, "{task}");
            assert_eq!(StarvedSource::of_plan(&source, &running(&follower)), of_follower);
            let both = [running(&source), running(&follower)].concat();
            assert_eq!(StarvedSource::of_running(&both), of_follower);
        }
        let source = running(&source("priority = 80\ncpu = 1"));
        assert_eq!(
            StarvedSource::of_plan(&follower, &source)[0].to_string(),
            "b.fast (fifo:80) follows \"saw\" of a.fast (fifo:80) on the same CPU 1: while the one watches, \
             the other cannot send"
        );
    }

    #[test]
    fn tasks_of_one_plan_are_looked_at_once_their_cpus_are_chosen() {
        let saw = "[[block]]\nname = \"saw\"\ntype = \"SawTooth\"\ntask = \"source\"\n\
                   in = { incrementRange = 1 }\n[[output]]\nservice = \"saw\"\ntask = \"source\"\nsignals = [\"saw.value\"]\n";
        let follower = "[[task]]\nname = \"follower\"\nperiod = \"1ms\"\npriority = 80\n\
                        follow = { service = \"saw\", within = \"100us\" }\n";
        let source = "[[task]]\nname = \"source\"\nperiod = \"1ms\"\npriority = 80\n";
        let input = "[[input]]\nname = \"in\"\nservice = \"saw\"\ntask = \"follower\"\n";
        let text = format!("[node]\nname = \"n\"\n{source}{follower}{input}{saw}");
        let mut plan = Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap();
        assert_eq!(StarvedSource::of_plan(&plan, &[]), [], "no CPU is chosen yet");
        plan.tasks.iter_mut().for_each(|task| task.cpu = Cpu::Auto { chosen: Some(1) });
        let starved = StarvedSource::of_plan(&plan, &[]);
        assert_eq!(starved.len(), 1);
        assert_eq!(
            (&starved[0].follower.task[..], &starved[0].source.task[..]),
            ("follower", "source")
        );
    }

    #[test]
    fn a_source_that_can_run_while_it_is_watched_for_is_kept_from_nothing() {
        for (of_source, of_follower) in [
            ("priority = 80\ncpu = 1", "priority = 79\ncpu = 1"),
            ("priority = 80\ncpu = 0", "priority = 80\ncpu = 1"),
            ("priority = 80", "priority = 80"),
            ("cpu = 1", "cpu = 1"),
        ] {
            let source = running(&source(of_source));
            assert_eq!(StarvedSource::of_plan(&follower(of_follower), &source), [], "{of_source}");
        }
    }
}

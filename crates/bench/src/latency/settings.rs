//! Settings of a bench of latency.

use std::time::Duration;

use isochrone_timing::Warning;

use super::arm::Arm;
use super::bench_node::{NODE_HZ, NODE_VALUES, NodePlace, NodeSite};
use super::pace::{SendPace, Wait};

/// What is measured, and how.
#[derive(Debug, Clone)]
pub struct LatencySettings {
    /// By the number of values in a message.
    pub sizes: Vec<MessageSize>,
    /// Turns of each arm under each circumstance.
    pub rounds: usize,
    /// Time of a turn, in ns.
    pub turn_ns: u64,
    /// How receivers wait.
    pub wait: Wait,
    /// CPUs of the two processes.
    pub cpus: Cpus,
    /// CPU of the node, and of the last one of a chain; that of the sender if there is no third one.
    pub node_cpu: usize,
    /// SCHED_FIFO priority of both; `None` for normal scheduling.
    pub priority: Option<u8>,
}

/// Messages of one size, and what is measured with them.
#[derive(Debug, Clone, PartialEq)]
pub struct MessageSize {
    /// Values in a message.
    pub values: usize,
    /// One after the other.
    pub circumstances: Vec<Circumstance>,
}

/// The CPUs of the two processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cpus {
    /// Of the one that sends.
    pub sender: usize,
    /// Of the one that measures.
    pub receiver: usize,
}

impl LatencySettings {
    pub(super) fn turn(&self) -> Duration {
        Duration::from_nanos(self.turn_ns)
    }

    /// The names of the arms, each once.
    pub fn names(&self) -> Vec<&'static str> {
        self.arms().into_iter().map(Arm::as_str).collect()
    }

    /// The arms, each once.
    fn arms(&self) -> Vec<Arm> {
        let circumstances = self.sizes.iter().flat_map(|size| &size.circumstances);
        let mut arms = Vec::new();
        for arm in circumstances.flat_map(|some| &some.arms) {
            if !arms.contains(arm) {
                arms.push(*arm);
            }
        }
        arms
    }

    /// How long all turns take.
    pub(super) fn total(&self) -> Duration {
        let circumstances = self.sizes.iter().flat_map(|size| &size.circumstances);
        let turns: usize = circumstances.map(|some| some.arms.len() * self.rounds).sum();
        self.turn() * turns as u32
    }

    /// An arm whose receiver watches for messages without ever sleeping, if there is one.
    pub fn polling_arm(&self) -> Option<Arm> {
        let watches = |arm: &Arm| arm.has_peer() && (self.wait == Wait::Poll || !arm.can_block());
        self.arms().into_iter().find(watches)
    }

    /// Where the nodes of an arm run, first to last.
    pub fn node_places(&self, arm: Arm) -> Vec<NodePlace> {
        arm.transport().node_places(&self.site())
    }

    fn site(&self) -> NodeSite {
        let Self { cpus, node_cpu, priority, .. } = *self;
        NodeSite { sender_cpu: cpus.sender, node_cpu, priority }
    }

    /// Why numbers of arms are doubtful where their nodes run.
    pub(super) fn warnings(&self) -> Vec<Warning> {
        let site = self.site();
        self.arms().into_iter().filter_map(|arm| arm.transport().warning(&site)).collect()
    }
}

/// Arms that take turns.
#[derive(Debug, Clone, PartialEq)]
pub struct Circumstance {
    /// How often messages are sent.
    pub pace: SendPace,
    /// The arms; the others are compared with the first.
    pub arms: Vec<Arm>,
}

impl Arm {
    /// What is measured of an arm that cannot have every size and pace that is asked for; `None`: all of it.
    pub fn limited(
        self,
        sizes: &[usize],
        paces: &[SendPace],
        plan: &[MessageSize],
    ) -> Option<String> {
        let asked = sizes.iter().flat_map(|values| paces.iter().map(move |pace| (*values, *pace)));
        if asked.into_iter().all(|(values, pace)| self.transport().has(values, pace)) {
            return None;
        }
        let circumstances = plan.iter().flat_map(|size| &size.circumstances);
        let measured = circumstances.filter(|some| some.arms.contains(&self));
        let paces: Vec<String> = measured.map(|some| some.pace.to_string()).collect();
        Some(format!(
            "{self} is measured with {NODE_VALUES} value at {}: it has no other of the sizes and paces that were \
             asked for",
            paces.join(", ")
        ))
    }
}

/// The circumstances by the size of the message. The ways through nodes have one size, and not every pace,
/// whatever the others have; where they have the same, they take turns with them, and where nobody has, 1 kHz.
pub fn plan(arms: &[Arm], sizes: &[usize], paces: &[SendPace]) -> Vec<MessageSize> {
    let mut plan: Vec<MessageSize> = Vec::new();
    for values in sizes {
        if plan.iter().all(|planned| planned.values != *values) {
            let at = |pace: &SendPace| {
                let arms = arms.iter().copied();
                let arms = arms.filter(|arm| arm.transport().has(*values, *pace)).collect();
                Circumstance { pace: *pace, arms }
            };
            plan.push(MessageSize {
                values: *values,
                circumstances: paces.iter().map(at).collect(),
            });
        }
    }
    let is_planned = |arm: &&Arm| {
        let mut circumstances = plan.iter().flat_map(|size| &size.circumstances);
        circumstances.any(|some| some.arms.contains(arm))
    };
    let left: Vec<Arm> = arms.iter().filter(|arm| !is_planned(arm)).copied().collect();
    if !left.is_empty() {
        let alone = Circumstance { pace: SendPace::Hz(NODE_HZ), arms: left };
        match plan.iter_mut().find(|size| size.values == NODE_VALUES) {
            Some(size) => size.circumstances.push(alone),
            None => plan.push(MessageSize { values: NODE_VALUES, circumstances: vec![alone] }),
        }
    }
    plan.iter_mut().for_each(|size| size.circumstances.retain(|some| !some.arms.is_empty()));
    plan.retain(|size| !size.circumstances.is_empty());
    plan
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::latency::arms::arm;

    const PACES: [SendPace; 2] = [SendPace::Hz(1_000.0), SendPace::BackToBack];

    #[test]
    fn the_node_takes_turns_with_the_others_where_they_have_its_pace_and_size() {
        let plan = plan(&[arm("raw"), arm("node")], &[1, 64], &PACES);
        let arms: Vec<Vec<usize>> = plan
            .iter()
            .map(|size| size.circumstances.iter().map(|some| some.arms.len()).collect())
            .collect();
        assert_eq!(arms, [[2, 1], [1, 1]]);
    }

    #[test]
    fn the_node_has_turns_of_its_own_where_nobody_else_has_its_pace_and_size() {
        let alone = Circumstance { pace: PACES[0], arms: vec![arm("node")] };
        let other_size = plan(&[arm("raw"), arm("node")], &[64], &PACES);
        assert_eq!(other_size[1], MessageSize { values: 1, circumstances: vec![alone.clone()] });
        let other_pace = plan(&[arm("raw"), arm("node")], &[1], &PACES[1..]);
        assert_eq!(other_pace[0].circumstances[1], alone);
        let node_only = plan(&[arm("node")], &[64], &PACES);
        assert_eq!(node_only, [MessageSize { values: 1, circumstances: vec![alone] }]);
    }

    #[test]
    fn nodes_that_follow_take_turns_with_the_others_at_every_pace_that_they_can_have() {
        let paces = [1_000.0, 4_000.0, 3_000.0].map(SendPace::Hz);
        let arms = [arm("ports"), arm("node"), arm("follow"), arm("chain")];
        let plan = plan(&arms, &[1], &paces);
        let found: Vec<&[Arm]> = plan[0].circumstances.iter().map(|some| &some.arms[..]).collect();
        let [ports, node, follow, chain] = arms;
        assert_eq!(found, [&arms[..], &[ports, follow, chain], &[ports]]);
        let odd = super::plan(&[follow, node], &[64], &[SendPace::BackToBack]);
        let alone = Circumstance { pace: PACES[0], arms: vec![follow, node] };
        assert_eq!(odd, [MessageSize { values: 1, circumstances: vec![alone] }]);
    }

    #[test]
    fn what_is_measured_instead_of_what_an_arm_cannot_have_is_said() {
        let limited = |asked: Arm, sizes: &[usize], paces: &[SendPace]| {
            asked.limited(sizes, paces, &super::plan(&[arm("ports"), asked], sizes, paces))
        };
        let hz = |paces: &[f64]| paces.iter().copied().map(SendPace::Hz).collect::<Vec<_>>();
        for (arm, sizes, paces, measured) in [
            (arm("follow"), &[1][..], hz(&[300.0]), "follow is measured with 1 value at 1000 Hz: "),
            (
                arm("chain"),
                &[1],
                hz(&[300.0, 4_000.0]),
                "chain is measured with 1 value at 4000 Hz: ",
            ),
            (arm("node"), &[64], hz(&[1_000.0]), "node is measured with 1 value at 1000 Hz: "),
            (arm("follow"), &[1, 64], hz(&[100.0, 1_000.0]), "value at 100 Hz, 1000 Hz: "),
        ] {
            let said = limited(arm, sizes, &paces).unwrap();
            assert!(said.contains(measured), "{said}");
        }
        assert_eq!(limited(arm("follow"), &[1], &hz(&[1_000.0, 4_000.0])), None);
        assert_eq!(limited(arm("ports"), &[64], &PACES), None);
    }

    fn settings(node_cpu: usize, priority: Option<u8>) -> LatencySettings {
        LatencySettings {
            sizes: plan(&[arm("follow"), arm("chain")], &[1], &PACES),
            rounds: 1,
            turn_ns: 1,
            wait: Wait::Poll,
            cpus: Cpus { sender: 1, receiver: 2 },
            node_cpu,
            priority,
        }
    }

    #[test]
    fn the_nodes_of_a_chain_have_a_cpu_each_where_there_are_three() {
        let cpus = |settings: &LatencySettings, arm| -> Vec<_> {
            settings.node_places(arm).iter().map(|place| (place.cpu, place.priority)).collect()
        };
        let three = settings(0, Some(50));
        assert_eq!(cpus(&three, arm("follow")), [(1, Some(50))]);
        assert_eq!(cpus(&three, arm("chain")), [(1, Some(50)), (0, Some(50))]);
        assert_eq!(cpus(&three, arm("node")), [(0, Some(50))]);
        assert_eq!(cpus(&three, arm("ports")), []);
        for (priority, first, second) in [(None, 2, 1), (Some(1), 2, 1), (Some(89), 89, 88)] {
            let two = settings(1, priority);
            assert_eq!(cpus(&two, arm("follow")), [(1, Some(first))]);
            assert_eq!(cpus(&two, arm("chain")), [(1, Some(first)), (1, Some(second))]);
        }
        assert_eq!(three.warnings(), []);
        let warnings = settings(1, None).warnings();
        let [Warning { message: said, .. }] = &warnings[..] else { panic!("{warnings:?}") };
        assert!(said.contains("CPU 1 (SCHED_FIFO 2), then CPU 1 (SCHED_FIFO 1)"), "{said}");
    }

    #[test]
    fn who_watches_only_while_a_message_is_on_its_way_does_not_poll() {
        assert_eq!(settings(0, Some(50)).polling_arm(), None);
    }

    #[test]
    fn a_size_given_twice_is_measured_once() {
        assert_eq!(plan(&[arm("raw")], &[64, 1, 64], &PACES).len(), 2);
    }
}

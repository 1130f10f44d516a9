//! What a bench of latency is to do.

use std::time::Duration;

use isochrone_timing::{Warning, WarningCode};

use super::arms::{Arm, NODE_VALUES, Pace, Wait};
use super::bench_node::NodePlace;
use super::{follow_path, node_path};

/// What is measured, and how.
#[derive(Debug, Clone)]
pub struct Settings {
    /// By the number of values in a message.
    pub sizes: Vec<Size>,
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
pub struct Size {
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

impl Settings {
    pub(super) fn turn(&self) -> Duration {
        Duration::from_nanos(self.turn_ns)
    }

    /// The names of the arms, each once.
    pub fn names(&self) -> Vec<&'static str> {
        let circumstances = self.sizes.iter().flat_map(|size| &size.circumstances);
        let mut names = Vec::new();
        for name in circumstances.flat_map(|some| &some.arms).map(|arm| arm.as_str()) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// How long all turns take.
    pub(super) fn total(&self) -> Duration {
        let circumstances = self.sizes.iter().flat_map(|size| &size.circumstances);
        let turns: usize = circumstances.map(|some| some.arms.len() * self.rounds).sum();
        self.turn() * turns as u32
    }

    /// An arm whose receiver watches for messages without ever sleeping, if there is one.
    pub fn polling_arm(&self) -> Option<Arm> {
        let circumstances = self.sizes.iter().flat_map(|size| &size.circumstances);
        let mut arms = circumstances.flat_map(|some| &some.arms);
        let polls = |arm: &&Arm| arm.polls() && (self.wait == Wait::Poll || !arm.can_block());
        arms.find(polls).copied()
    }

    /// Where the nodes of an arm run, first to last. Those that follow have the sender's CPU, as the thread
    /// that measures is the one that sends. The only one of `follow` has what the first one of `chain` has, so that the
    /// second one is all that they differ in.
    pub fn node_places(&self, arm: Arm) -> Vec<NodePlace> {
        let at = |cpu| NodePlace { cpu, priority: self.priority };
        match follow_path::length(arm) {
            0 if arm == Arm::Node => vec![at(self.node_cpu)],
            0 => Vec::new(),
            1 => self.node_places(Arm::Chain).into_iter().take(1).collect(),
            // On one CPU, one that watches must leave it to its source.
            _ if self.nodes_share_cpu() => {
                let second = self.priority.unwrap_or_default().saturating_sub(1).max(1);
                let place =
                    |priority| NodePlace { cpu: self.cpus.sender, priority: Some(priority) };
                vec![place(second + 1), place(second)]
            }
            _ => vec![at(self.cpus.sender), at(self.node_cpu)],
        }
    }

    /// Whether all nodes of a chain run on one CPU.
    fn nodes_share_cpu(&self) -> bool {
        self.node_cpu == self.cpus.sender
    }

    /// Warns of a chain that cannot show what one with a CPU for each node would.
    pub(super) fn shared_cpu(&self) -> Option<Warning> {
        let is_shared = self.nodes_share_cpu() && self.names().contains(&Arm::Chain.as_str());
        let places = self.node_places(Arm::Chain);
        let [first, second] = &places[..] else { return None };
        is_shared.then(|| {
            let message = format!(
                "the nodes of arm \"chain\" share a CPU: {first}, then {second}; each frame waits until \
                 the first node sleeps and the kernel has switched to the second"
            );
            Warning::new(WarningCode::ChainSharesCpu, message)
        })
    }
}

/// Arms that take turns.
#[derive(Debug, Clone, PartialEq)]
pub struct Circumstance {
    /// How often messages are sent.
    pub pace: Pace,
    /// The arms; the others are compared with the first.
    pub arms: Vec<Arm>,
}

impl Arm {
    /// What is measured of an arm that cannot have every size and pace that is asked for; `None`: all of it.
    pub fn limited(self, sizes: &[usize], paces: &[Pace], plan: &[Size]) -> Option<String> {
        let asked = sizes.iter().flat_map(|values| paces.iter().map(move |pace| (*values, *pace)));
        if asked.into_iter().all(|(values, pace)| self.has(values, pace)) {
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
pub fn plan(arms: &[Arm], sizes: &[usize], paces: &[Pace]) -> Vec<Size> {
    let mut plan: Vec<Size> = Vec::new();
    for values in sizes {
        if plan.iter().all(|planned| planned.values != *values) {
            let at = |pace: &Pace| {
                let arms = arms.iter().copied().filter(|arm| arm.has(*values, *pace)).collect();
                Circumstance { pace: *pace, arms }
            };
            plan.push(Size { values: *values, circumstances: paces.iter().map(at).collect() });
        }
    }
    let is_planned = |arm: &&Arm| {
        let mut circumstances = plan.iter().flat_map(|size| &size.circumstances);
        circumstances.any(|some| some.arms.contains(arm))
    };
    let left: Vec<Arm> = arms.iter().filter(|arm| !is_planned(arm)).copied().collect();
    if !left.is_empty() {
        let alone = Circumstance { pace: Pace::Hz(node_path::RATE_HZ), arms: left };
        match plan.iter_mut().find(|size| size.values == NODE_VALUES) {
            Some(size) => size.circumstances.push(alone),
            None => plan.push(Size { values: NODE_VALUES, circumstances: vec![alone] }),
        }
    }
    plan.iter_mut().for_each(|size| size.circumstances.retain(|some| !some.arms.is_empty()));
    plan.retain(|size| !size.circumstances.is_empty());
    plan
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACES: [Pace; 2] = [Pace::Hz(1_000.0), Pace::BackToBack];

    #[test]
    fn the_node_takes_turns_with_the_others_where_they_have_its_pace_and_size() {
        let plan = plan(&[Arm::Raw, Arm::Node], &[1, 64], &PACES);
        let arms: Vec<Vec<usize>> = plan
            .iter()
            .map(|size| size.circumstances.iter().map(|some| some.arms.len()).collect())
            .collect();
        assert_eq!(arms, [[2, 1], [1, 1]]);
    }

    #[test]
    fn the_node_has_turns_of_its_own_where_nobody_else_has_its_pace_and_size() {
        let alone = Circumstance { pace: PACES[0], arms: vec![Arm::Node] };
        let other_size = plan(&[Arm::Raw, Arm::Node], &[64], &PACES);
        assert_eq!(other_size[1], Size { values: 1, circumstances: vec![alone.clone()] });
        let other_pace = plan(&[Arm::Raw, Arm::Node], &[1], &PACES[1..]);
        assert_eq!(other_pace[0].circumstances[1], alone);
        let node_only = plan(&[Arm::Node], &[64], &PACES);
        assert_eq!(node_only, [Size { values: 1, circumstances: vec![alone] }]);
    }

    #[test]
    fn nodes_that_follow_take_turns_with_the_others_at_every_pace_that_they_can_have() {
        let paces = [1_000.0, 4_000.0, 3_000.0].map(Pace::Hz);
        let arms = [Arm::Ports, Arm::Node, Arm::Follow, Arm::Chain];
        let plan = plan(&arms, &[1], &paces);
        let found: Vec<&[Arm]> = plan[0].circumstances.iter().map(|some| &some.arms[..]).collect();
        let [ports, node, follow, chain] = arms;
        assert_eq!(found, [&arms[..], &[ports, follow, chain], &[ports]]);
        let odd = super::plan(&[follow, node], &[64], &[Pace::BackToBack]);
        let alone = Circumstance { pace: PACES[0], arms: vec![follow, node] };
        assert_eq!(odd, [Size { values: 1, circumstances: vec![alone] }]);
    }

    #[test]
    fn what_is_measured_instead_of_what_an_arm_cannot_have_is_said() {
        let limited = |arm: Arm, sizes: &[usize], paces: &[Pace]| {
            arm.limited(sizes, paces, &super::plan(&[Arm::Ports, arm], sizes, paces))
        };
        let hz = |paces: &[f64]| paces.iter().copied().map(Pace::Hz).collect::<Vec<_>>();
        for (arm, sizes, paces, measured) in [
            (Arm::Follow, &[1][..], hz(&[300.0]), "follow is measured with 1 value at 1000 Hz: "),
            (
                Arm::Chain,
                &[1],
                hz(&[300.0, 4_000.0]),
                "chain is measured with 1 value at 4000 Hz: ",
            ),
            (Arm::Node, &[64], hz(&[1_000.0]), "node is measured with 1 value at 1000 Hz: "),
            (Arm::Follow, &[1, 64], hz(&[100.0, 1_000.0]), "value at 100 Hz, 1000 Hz: "),
        ] {
            let said = limited(arm, sizes, &paces).unwrap();
            assert!(said.contains(measured), "{said}");
        }
        assert_eq!(limited(Arm::Follow, &[1], &hz(&[1_000.0, 4_000.0])), None);
        assert_eq!(limited(Arm::Ports, &[64], &PACES), None);
    }

    fn settings(node_cpu: usize, priority: Option<u8>) -> Settings {
        Settings {
            sizes: plan(&[Arm::Follow, Arm::Chain], &[1], &PACES),
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
        let cpus = |settings: &Settings, arm| -> Vec<_> {
            settings.node_places(arm).iter().map(|place| (place.cpu, place.priority)).collect()
        };
        let three = settings(0, Some(50));
        assert_eq!(cpus(&three, Arm::Follow), [(1, Some(50))]);
        assert_eq!(cpus(&three, Arm::Chain), [(1, Some(50)), (0, Some(50))]);
        assert_eq!(cpus(&three, Arm::Node), [(0, Some(50))]);
        assert_eq!(cpus(&three, Arm::Ports), []);
        for (priority, first, second) in [(None, 2, 1), (Some(1), 2, 1), (Some(89), 89, 88)] {
            let two = settings(1, priority);
            assert_eq!(cpus(&two, Arm::Follow), [(1, Some(first))]);
            assert_eq!(cpus(&two, Arm::Chain), [(1, Some(first)), (1, Some(second))]);
        }
        assert_eq!(three.shared_cpu(), None);
        let said = settings(1, None).shared_cpu().unwrap().message;
        assert!(said.contains("CPU 1 (SCHED_FIFO 2), then CPU 1 (SCHED_FIFO 1)"), "{said}");
    }

    #[test]
    fn who_watches_only_while_a_message_is_on_its_way_does_not_poll() {
        assert_eq!(settings(0, Some(50)).polling_arm(), None);
    }

    #[test]
    fn a_size_given_twice_is_measured_once() {
        assert_eq!(plan(&[Arm::Raw], &[64, 1, 64], &PACES).len(), 2);
    }
}

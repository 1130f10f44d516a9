//! What a bench of latency is to do.

use std::time::Duration;

use super::arms::{Arm, Pace, Wait};
use super::node_path;

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
    /// CPU of the node.
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
        arms.find(|arm| self.wait == Wait::Poll || !arm.can_block()).copied()
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

/// The circumstances by the size of the message. The way through the node has one pace and one size,
/// whatever the others have; where they have the same, it takes turns with them.
pub fn plan(arms: &[Arm], sizes: &[usize], paces: &[Pace]) -> Vec<Size> {
    const NODE_VALUES: usize = 1;
    let node_pace = Pace::Hz(node_path::RATE_HZ);
    let with_node = arms.contains(&Arm::Node);
    let at = |values: usize, pace: Pace| {
        let belongs = |arm: &Arm| *arm != Arm::Node || (values == NODE_VALUES && pace == node_pace);
        Circumstance { pace, arms: arms.iter().copied().filter(belongs).collect() }
    };
    let mut plan: Vec<Size> = Vec::new();
    for values in sizes {
        if plan.iter().all(|planned| planned.values != *values) {
            let circumstances = paces.iter().map(|pace| at(*values, *pace)).collect();
            plan.push(Size { values: *values, circumstances });
        }
    }
    if with_node {
        let alone = Circumstance { pace: node_pace, arms: vec![Arm::Node] };
        match plan.iter_mut().find(|size| size.values == NODE_VALUES) {
            Some(_) if paces.contains(&node_pace) => {}
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
    fn a_size_given_twice_is_measured_once() {
        assert_eq!(plan(&[Arm::Raw], &[64, 1, 64], &PACES).len(), 2);
    }
}

//! All arms there are. One more is a file here, and a line in [`ARMS`].

mod cache_line;
mod follow;
mod node;
mod pipe;
mod ports;
mod raw;
mod tcp;
mod unix;

use clap::ValueEnum;
use clap::builder::PossibleValue;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::arm::Arm;

/// In the order in which the command line names them and, unless it is told otherwise, measures them.
static ARMS: &[Arm] = &[
    Arm::of(&raw::Raw),
    Arm::of(&ports::Ports),
    Arm::of(&unix::Unix),
    Arm::of(&pipe::Pipe),
    Arm::of(&tcp::Tcp),
    Arm::of(&cache_line::CacheLine),
    Arm::of(&node::Node),
    Arm::of(&follow::FOLLOW),
    Arm::of(&follow::CHAIN),
];

impl Arm {
    /// The names of all arms, with commas between them.
    pub fn names() -> String {
        ARMS.iter().map(|arm| arm.as_str()).collect::<Vec<_>>().join(",")
    }

    fn named(name: &str) -> Option<Self> {
        ARMS.iter().find(|arm| arm.as_str() == name).copied()
    }
}

impl ValueEnum for Arm {
    fn value_variants<'a>() -> &'a [Self] {
        ARMS
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.as_str()).help(self.transport().help()))
    }
}

impl Serialize for Arm {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de> Deserialize<'de> for Arm {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::named(&name).ok_or_else(|| D::Error::custom(format!("there is no arm \"{name}\"")))
    }
}

/// The arm of a name, which must exist.
#[cfg(test)]
pub(super) fn arm(name: &str) -> Arm {
    Arm::named(name).unwrap()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::latency::bench_node::NodeSite;

    #[test]
    fn every_arm_has_a_name_of_its_own_that_reads_back() {
        for (index, arm) in ARMS.iter().enumerate() {
            assert!(!ARMS[..index].contains(arm), "{arm}");
            assert_eq!(arm.to_possible_value().unwrap().get_name(), arm.as_str());
            let json = serde_json::to_string(arm).unwrap();
            assert_eq!(serde_json::from_str::<Arm>(&json).unwrap(), *arm);
        }
        assert!(serde_json::from_str::<Arm>("\"pigeon\"").is_err());
    }

    #[test]
    fn every_place_for_a_node_has_one() {
        let site = NodeSite { sender_cpu: 0, node_cpu: 2, priority: None };
        for arm in ARMS {
            let places = arm.transport().node_places(&site);
            let nodes = arm.transport().nodes(Some(1_000_000), &places);
            assert!(nodes.iter().map(|node| node.place).eq(places), "{arm}");
        }
        let nodes = |arm: &Arm| arm.transport().node_places(&site).len();
        assert_eq!(
            ["ports", "node", "follow", "chain"].map(|name| nodes(&arm(name))),
            [0, 1, 1, 2]
        );
    }
}

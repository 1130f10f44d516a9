//! Through one or two control nodes, of which each follows what it reads.

use isochrone_ipc::ForRealTime;
use isochrone_timing::{Warning, WarningCode};

use crate::latency::arm::Transport;
use crate::latency::bench_node::{BenchNode, NODE_VALUES, NodePlace, NodeSite};
use crate::latency::end::{EndError, Opening, Rendezvous};
use crate::latency::follow_path::{self, FollowPath};
use crate::latency::measuring::MeasuringOpening;
use crate::latency::pace::SendPace;

pub(super) static FOLLOW: Follow = Follow {
    name: "follow",
    help: "Through a control node that follows, from sending to reading in one thread; with one value \
           only, at paces whose period divides 20 ms, up to 10 kHz",
    services: &["follow/in", "follow/out"],
};

pub(super) static CHAIN: Follow = Follow {
    name: "chain",
    help: "The same through two control nodes, the second of which follows the first",
    services: &["chain/in", "chain/between", "chain/out"],
};

pub(super) struct Follow {
    name: &'static str,
    help: &'static str,
    /// The services that a value passes. Between each two of them is a node.
    services: &'static [&'static str],
}

impl Transport for Follow {
    fn name(&self) -> &'static str {
        self.name
    }

    fn help(&self) -> &'static str {
        self.help
    }

    fn open(&self, _: &Rendezvous<'_>) -> Result<ForRealTime<Opening>, EndError> {
        Ok(follow_path::open_peer())
    }

    fn open_measuring(
        &self,
        place: &Rendezvous<'_>,
    ) -> Result<ForRealTime<MeasuringOpening>, EndError> {
        FollowPath::open(self.services, place)
    }

    fn has_peer(&self) -> bool {
        false
    }

    fn has(&self, values: usize, pace: SendPace) -> bool {
        values == NODE_VALUES && follow_path::period_ns(pace).is_some()
    }

    /// A node alone has the place of the first one of a chain, so that the second one is all that the two arms
    /// differ in.
    fn node_places(&self, site: &NodeSite) -> Vec<NodePlace> {
        let nodes = self.services.len() - 1;
        follow_path::places(site).into_iter().take(nodes).collect()
    }

    fn nodes(&self, period_ns: Option<u64>, places: &[NodePlace]) -> Vec<BenchNode> {
        let nodes = |period_ns| follow_path::nodes(self.services, period_ns, places);
        period_ns.map(nodes).unwrap_or_default()
    }

    fn start_ns(&self, earliest_ns: u64, period_ns: Option<u64>, _: usize, _: usize) -> u64 {
        period_ns.map_or(earliest_ns, |period_ns| follow_path::start_ns(earliest_ns, period_ns))
    }

    /// One that cannot show what a chain with a CPU for each node would.
    fn warning(&self, site: &NodeSite) -> Option<Warning> {
        let places = self.node_places(site);
        let [first, second] = places.as_slice() else { return None };
        follow_path::share_cpu(site).then(|| {
            let message = format!(
                "the nodes of arm \"{}\" share a CPU: {first}, then {second}; each frame waits until \
                 the first node sleeps and the kernel has switched to the second",
                self.name
            );
            Warning::new(WarningCode::ChainSharesCpu, message)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_node_of_a_chain_follows_the_one_before() {
        let places = [NodePlace { cpu: 0, priority: None }, NodePlace { cpu: 2, priority: None }];
        let chain = CHAIN.nodes(Some(250_000), &places);
        let hops: Vec<_> = chain.iter().map(|node| (node.input, node.output)).collect();
        assert_eq!(hops, [("chain/in", "chain/between"), ("chain/between", "chain/out")]);
        assert!(chain.iter().all(|node| node.within_ns == Some(62_500)));
        assert_eq!(chain[1].place, places[1]);
    }

    #[test]
    fn only_nodes_that_share_a_cpu_with_each_other_are_warned_of() {
        let site = |node_cpu| NodeSite { sender_cpu: 0, node_cpu, priority: None };
        assert!(CHAIN.warning(&site(0)).is_some() && CHAIN.warning(&site(2)).is_none());
        assert!(FOLLOW.warning(&site(0)).is_none());
    }
}

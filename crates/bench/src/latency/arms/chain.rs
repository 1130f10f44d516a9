//! Through two control nodes, the second of which follows the first.

use isochrone_ipc::ForRealTime;
use isochrone_timing::{Warning, WarningCode};

use crate::latency::arm::Transport;
use crate::latency::bench_node::{BenchNode, NODE_VALUES, NodePlace, NodeSite};
use crate::latency::end::{EndError, Opening, Rendezvous};
use crate::latency::follow_path::{self, FollowPath};
use crate::latency::measuring::MeasuringOpening;
use crate::latency::pace::SendPace;

/// The services that a value passes.
const SERVICES: [&str; 3] = ["chain/in", "chain/between", "chain/out"];

pub(super) struct Chain;

impl Transport for Chain {
    fn name(&self) -> &'static str {
        "chain"
    }

    fn help(&self) -> &'static str {
        "The same through two control nodes, the second of which follows the first"
    }

    fn open(&self, _: &Rendezvous<'_>) -> Result<ForRealTime<Opening>, EndError> {
        Ok(follow_path::open_peer())
    }

    fn open_measuring(
        &self,
        place: &Rendezvous<'_>,
    ) -> Result<ForRealTime<MeasuringOpening>, EndError> {
        FollowPath::open(&SERVICES, place)
    }

    fn has_peer(&self) -> bool {
        false
    }

    fn has(&self, values: usize, pace: SendPace) -> bool {
        values == NODE_VALUES && follow_path::period_ns(pace).is_some()
    }

    fn node_places(&self, site: &NodeSite) -> Vec<NodePlace> {
        follow_path::places(site).into()
    }

    fn nodes(&self, period_ns: Option<u64>, places: &[NodePlace]) -> Vec<BenchNode> {
        let nodes = |period_ns| follow_path::nodes(&SERVICES, period_ns, places);
        period_ns.map(nodes).unwrap_or_default()
    }

    fn start_ns(&self, earliest_ns: u64, period_ns: Option<u64>, _: usize, _: usize) -> u64 {
        period_ns.map_or(earliest_ns, |period_ns| follow_path::start_ns(earliest_ns, period_ns))
    }

    /// One that cannot show what a chain with a CPU for each node would.
    fn warning(&self, site: &NodeSite) -> Option<Warning> {
        follow_path::share_cpu(site).then(|| {
            let [first, second] = follow_path::places(site);
            let message = format!(
                "the nodes of arm \"chain\" share a CPU: {first}, then {second}; each frame waits until \
                 the first node sleeps and the kernel has switched to the second"
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
        let chain = Chain.nodes(Some(250_000), &places);
        let hops: Vec<_> = chain.iter().map(|node| (node.input, node.output)).collect();
        assert_eq!(hops, [("chain/in", "chain/between"), ("chain/between", "chain/out")]);
        assert!(chain.iter().all(|node| node.within_ns == Some(62_500)));
        assert_eq!(chain[1].place, places[1]);
    }
}

//! Through a control node that follows.

use isochrone_ipc::ForRealTime;

use crate::latency::arm::Transport;
use crate::latency::bench_node::{BenchNode, NODE_VALUES, NodePlace, NodeSite};
use crate::latency::end::{EndError, Opening, Rendezvous};
use crate::latency::follow_path::{self, FollowPath};
use crate::latency::measuring::MeasuringOpening;
use crate::latency::pace::SendPace;

/// The services that a value passes.
const SERVICES: [&str; 2] = ["follow/in", "follow/out"];

pub(super) struct Follow;

impl Transport for Follow {
    fn name(&self) -> &'static str {
        "follow"
    }

    fn help(&self) -> &'static str {
        "Through a control node that follows, from sending to reading in one thread; with one value \
         only, at paces whose period divides 20 ms, up to 10 kHz"
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

    /// What the first one of a chain has, so that the second one is all that the two arms differ in.
    fn node_places(&self, site: &NodeSite) -> Vec<NodePlace> {
        let [first, _] = follow_path::places(site);
        vec![first]
    }

    fn nodes(&self, period_ns: Option<u64>, places: &[NodePlace]) -> Vec<BenchNode> {
        let nodes = |period_ns| follow_path::nodes(&SERVICES, period_ns, places);
        period_ns.map(nodes).unwrap_or_default()
    }

    fn start_ns(&self, earliest_ns: u64, period_ns: Option<u64>, _: usize, _: usize) -> u64 {
        period_ns.map_or(earliest_ns, |period_ns| follow_path::start_ns(earliest_ns, period_ns))
    }
}

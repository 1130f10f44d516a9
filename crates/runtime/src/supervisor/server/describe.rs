//! `describe`: the node, its tasks and configuration.

use isochrone_control::{
    Begun, Caller, ConfigurationOrigin, DescribeParams, DescribeResult, Handle, Refusal,
    TaskDescription,
};
use isochrone_cyclic::{Clock, Monotonic};

use super::ControlServer;

impl Handle<DescribeParams> for ControlServer {
    fn handle(&mut self, _: DescribeParams, _: Caller) -> Result<Begun<DescribeResult>, Refusal> {
        let operating = self.shared.lock();
        let now_ns = Monotonic.now_ns();
        let next = operating.next_cycles(now_ns);
        let task = |(index, next): (usize, u64)| {
            let lane = operating.lanes.get(index)?;
            Some(TaskDescription {
                name: lane.name.clone(),
                ob: lane.ob,
                period_ns: lane.schedule.period_ns,
                phase_ns: lane.schedule.phase_ns,
                cycle: next.saturating_sub(1),
                last_cycle: lane.last.map(|last| last.cycle),
                stands_ns: operating.stands_ns(index, now_ns),
                missed: lane.last.map_or(0, |last| last.missed),
                overruns: lane.last.map_or(0, |last| last.overruns),
                parameters: operating.operator.parameters(index) as u64,
                forces: operating.operator.forced(index) as u64,
                alarms: lane.faults.total() as u64,
                last_second: lane.seconds.last(now_ns, lane.schedule.period_ns),
                placement: operating.placement(index),
            })
        };
        Ok(Begun::Ended(DescribeResult {
            node: self.node.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            control: self.control,
            configuration: ConfigurationOrigin {
                file: operating.configuration.source.name.clone(),
                sha256: operating.configuration.sha256.clone(),
                started_sha256: Some(operating.configuration.started_sha256.clone()),
                changed: operating.configuration.is_changed || operating.operator.has_changed(),
            },
            started_unix_ns: self.started_unix_ns,
            announced_units: operating.operator.announced_units(),
            tasks: next.into_iter().enumerate().filter_map(task).collect(),
            redundancy: operating.redundancy().map(Box::new),
        }))
    }
}

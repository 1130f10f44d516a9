//! The cost of an instance in a cycle.

mod arm;
mod memory;
mod settings;

use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic, Pinning, ThreadRequest, prepare_process, prepare_thread};
use isochrone_engine::Workload;
use isochrone_processes::Stop;
use isochrone_report::{CostReport, turn_order};
use isochrone_runtime::catch_panic;
use isochrone_timing::Warning;

use self::arm::{Arm, Turn};
use crate::{BenchError, Onlooker};

pub use memory::check as check_memory;
pub use settings::{EngineSettings, TaskSize};

/// Fewest turns of an arm; even, so that each way through the arms comes as often as the other.
const FEWEST_ROUNDS: u64 = 10;
/// So that turns meet the same times, and a real-time thread pauses before the kernel makes it.
const LONGEST_TURN_NS: u64 = 400_000_000;

/// What came of a bench.
#[derive(Debug, Default)]
pub struct EngineResults {
    /// Every arm at every size.
    pub costs: Vec<CostReport>,
    /// What makes results doubtful.
    pub warnings: Vec<Warning>,
}

/// Lets the arms of each size take turns, in a thread of its own.
///
/// # Errors
/// A task cannot be built, or the thread not started.
pub fn measure(
    settings: &EngineSettings<'_>,
    clock_read_ns: Option<u64>,
    stop: &Stop,
    onlooker: &dyn Onlooker,
) -> Result<EngineResults, BenchError> {
    let mut warnings = Vec::new();
    if settings.priority.is_some() {
        warnings.extend(prepare_process().refusals.iter().map(isochrone_runtime::warning));
    }
    let bench = Bench { settings, stop, clock_read_ns, onlooker };
    let mut measured = thread::scope(|scope| {
        let measure = thread::Builder::new().name("bench".into());
        let spawned = measure.spawn_scoped(scope, || bench.measure());
        let measuring = spawned.map_err(BenchError::no_thread)?;
        measuring.join().map_err(|_| BenchError::panicked("the thread of the bench"))?
    })?;
    measured.warnings.splice(..0, warnings);
    Ok(measured)
}

struct Bench<'a> {
    settings: &'a EngineSettings<'a>,
    stop: &'a Stop,
    clock_read_ns: Option<u64>,
    onlooker: &'a dyn Onlooker,
}

impl Bench<'_> {
    fn measure(&self) -> Result<EngineResults, BenchError> {
        let EngineSettings { sizes, priority, cpu, .. } = self.settings;
        let origin_ns = Monotonic.now_ns();
        let cpu = cpu.map_or(Pinning::Any, Pinning::Named);
        let grant = prepare_thread(ThreadRequest { priority: *priority, cpu });
        let (rounds, turn_ns) = rounds(self.settings.seconds);
        let mut turn =
            Turn::new(origin_ns, turn_ns, self.clock_read_ns, grant.cpu, self.stop.clone());
        let names = self.settings.names();
        let view = self.onlooker.begin(self.settings.total(), &names);
        let mut passed = Duration::ZERO;
        let mut costs = Vec::new();
        for size in sizes {
            let build =
                |workload: &Workload| Arm::build(workload, size.instances, self.settings.catalogue);
            let mut arms = size.workloads.iter().map(build).collect::<Result<Vec<Arm>, _>>()?;
            for (_, place) in turn_order(rounds, arms.len()) {
                let Some(arm) = arms.get_mut(place) else { continue };
                let began_ns = Monotonic.now_ns();
                catch_panic(|| arm.take(&mut turn)).map_err(|panic| {
                    let place = panic.place.map(|place| format!(" at {place}")).unwrap_or_default();
                    BenchError::Failed(format!(
                        "arm \"{}\": a block panicked{place}: {}; fix the block, or leave the arm out (--arms)",
                        arm.name(),
                        panic.message
                    ))
                })?;
                if let Some(line) = names.iter().position(|name| *name == arm.name()) {
                    view.say(line, &|| arm.so_far());
                }
                passed += Duration::from_nanos(turn_ns);
                view.pass(passed);
                if self.stop.is_due() {
                    break;
                }
                if priority.is_some() {
                    // The kernel takes a CPU from a real-time thread that leaves nothing of it.
                    thread::sleep(Duration::from_nanos((Monotonic.now_ns() - began_ns) / 8));
                }
            }
            costs.extend(arms.iter().filter_map(Arm::report));
            if self.stop.is_due() {
                break;
            }
        }
        costs.sort_by_key(|cost| names.iter().position(|name| *name == cost.name));
        let warnings = grant.refusals.iter().map(isochrone_runtime::warning).collect();
        Ok(EngineResults { costs, warnings })
    }
}

/// Turns of an arm, and how long each is, in ns.
fn rounds(seconds: f64) -> (usize, u64) {
    // A number too large saturates: for ever.
    let total_ns = (seconds * 1e9) as u64;
    let rounds = total_ns.div_ceil(LONGEST_TURN_NS).max(FEWEST_ROUNDS).next_multiple_of(2);
    (usize::try_from(rounds).unwrap_or(usize::MAX), total_ns / rounds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_short_many_and_as_often_forth_as_back() {
        for seconds in [0.000_000_1, 0.01, 1.0, 5.0, 61.0, 1e300] {
            let (rounds, turn_ns) = rounds(seconds);
            assert!(rounds as u64 >= FEWEST_ROUNDS && rounds % 2 == 0, "{seconds}");
            assert!(turn_ns <= LONGEST_TURN_NS, "{seconds}: {turn_ns}");
            let total_s = rounds as f64 * turn_ns as f64 / 1e9;
            assert!(seconds > 1e9 || (total_s - seconds).abs() < 1e-6, "{seconds}: {total_s}");
        }
    }
}

//! How late a loop's releases are.

mod arm;
mod cyclictest;
mod load;
mod loops;
mod node;
mod peers;
mod settings;
mod turn;
mod validity;

use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic, prepare_process};
use isochrone_ipc::Domain;
use isochrone_machine::Environment;
use isochrone_processes::Stop;
use isochrone_report::{TaskArm, turn_order};
use isochrone_timing::Warning;

use self::arm::{Arm, Entrant, Kind};
use self::load::Stress;
use self::peers::Peers;
use self::turn::{Turn, WARM_UP};
use crate::{BenchError, Onlooker};

pub use load::Load;
pub use peers::serve as serve_peers;
pub use settings::{ArmCpu, JitterSettings, Loop, NodeArm, find_cpus};
pub use validity::check as check_sleep;

/// More than a turn needs before its warm-up and after its end: cyclictest waits for a whole second.
const LONGEST_SET_UP: Duration = Duration::from_secs(10);

/// What came of a bench.
#[derive(Debug, Default)]
pub struct JitterResults {
    /// Every arm at every period and under every load.
    pub tasks: Vec<TaskArm>,
    /// What makes results doubtful.
    pub warnings: Vec<Warning>,
}

/// Adds the loops that are measured where none are named: sleep, hybrid and, where it is installed and
/// may run, cyclictest.
pub fn add_usual_loops(settings: &mut JitterSettings) {
    settings.loops.extend([Loop::Sleep, Loop::Hybrid]);
    if cyclictest::check(settings).is_ok() {
        settings.loops.push(Loop::Cyclictest);
    }
}

/// Sees that all arms can be run.
///
/// # Errors
/// Two have one name, or one cannot run here.
pub fn check(settings: &JitterSettings) -> Result<(), BenchError> {
    settings.check_names()?;
    if settings.loops.contains(&Loop::Cyclictest) { cyclictest::check(settings) } else { Ok(()) }
}

/// Lets the arms take turns at every period and under every load.
///
/// # Errors
/// An arm cannot be run, or a load ended.
pub fn measure(
    settings: &JitterSettings,
    environment: &Environment,
    domain: &Domain,
    stop: &Stop,
    onlooker: &dyn Onlooker,
) -> Result<JitterResults, BenchError> {
    check(settings)?;
    let mut measured = JitterResults::default();
    if settings.priority.is_some() {
        measured.warnings.extend(prepare_process().refusals.iter().map(isochrone_runtime::warning));
    }
    let origin_ns = Monotonic.now_ns();
    let (rounds, counted) = (settings.rounds(), settings.counted());
    let entrants = entrants(settings, environment);
    let circumstances: Vec<(Load, u64)> = settings
        .loads
        .iter()
        .flat_map(|load| settings.periods_ns.iter().map(|period_ns| (*load, *period_ns)))
        .collect();
    let all = (rounds * entrants.len() * circumstances.len()) as f64;
    let names: Vec<&str> = entrants.iter().map(|entrant| entrant.name.as_str()).collect();
    let view = onlooker.begin((WARM_UP + counted).mul_f64(all), &names);
    let began = Instant::now();
    let mut done = 0.0;
    let mut load_before = None;
    let mut stress: Option<Stress> = None;
    for (load, period_ns) in circumstances {
        if load_before.replace(load) != Some(load) {
            // The old load ends before the new one starts.
            drop(stress.take());
            stress = Stress::start(load, (WARM_UP + counted + LONGEST_SET_UP).mul_f64(all))?;
        }
        let new = |entrant: &Entrant| Arm::new(entrant, period_ns, settings, origin_ns);
        let mut arms: Vec<Arm> = entrants.iter().map(new).collect();
        for (_, index) in turn_order(rounds, arms.len()) {
            if stop.is_due() {
                break;
            }
            let Some(arm) = arms.get_mut(index) else { continue };
            let pass = || view.pass(began.elapsed());
            arm.take(&Turn { counted, stop, domain, pass: &pass })?;
            // Ctrl-C ends the load, too.
            if let Some(stress) = stress.as_mut().filter(|_| !stop.is_due()) {
                stress.check()?;
            }
            view.show(index, arm.jitter());
            // Starting and ending a turn takes its time, too, and not the same for each arm.
            done += 1.0;
            view.expect(began.elapsed().mul_f64(all / done));
        }
        // `idle` is only worth a word beside something else.
        let named = if settings.loads == [Load::Idle] { "" } else { load.as_str() };
        // An early end may come before an arm's first turn.
        for arm in arms.iter().filter(|arm| arm.jitter().count() > 0) {
            for warning in arm.warnings(counted) {
                if !measured.warnings.contains(&warning) {
                    onlooker.warn(&warning);
                    measured.warnings.push(warning);
                }
            }
            measured.tasks.push(arm.report(named));
        }
    }
    Ok(measured)
}

/// The arms.
fn entrants(settings: &JitterSettings, environment: &Environment) -> Vec<Entrant> {
    let loops = settings.loops_on_cpus().map(|(arm, on)| Entrant {
        name: settings.loop_name(arm, on),
        kind: match arm {
            Loop::Sleep => Kind::sleep(),
            Loop::Hybrid => Kind::hybrid(0.2),
            Loop::Economical => Kind::hybrid(0.1),
            Loop::Spin => Kind::spin(loops::longest_spin(environment, settings.priority)),
            Loop::Cyclictest => Kind::Cyclictest,
            Loop::Quiet => Kind::Peers(Peers::Stay),
            Loop::Joins => Kind::Peers(Peers::ComeAndGo),
        },
        cpu: on.cpu,
        cpu_reason: on.reason.clone(),
    });
    let nodes = settings.nodes.iter().map(|NodeArm { name, plan, cpus }| Entrant {
        name: name.clone(),
        // As the loops do, it keeps its CPU without a priority too.
        kind: Kind::Node(plan.clone(), cpus.clone().named()),
        cpu: cpus.cpu(0).or(settings.cpus.first().map(|on| on.cpu)).unwrap_or(0),
        cpu_reason: cpus.reason(0),
    });
    loops.chain(nodes).collect()
}

//! How long a message takes from one process to another.
//!
//! Two processes, each on a CPU of its own. The main thread (`session`) gives the turns and keeps
//! off those CPUs; the thread that measures (`measurer`) owns one side of every arm, the peer process
//! (`peer`) the other. What an arm is stands in `arm`, and each of them is a file in `arms`. What happens in a
//! turn is in `turn`. Through nodes that follow (`follow_path`), the thread that measures owns both ends.

mod arm;
mod arms;
mod bench_node;
mod end;
mod follow_path;
mod frames;
mod in_flight;
mod measurer;
mod measuring;
mod message;
mod pace;
mod peer;
mod processes;
mod series;
mod session;
mod settings;
mod shared_words;
mod stream;
mod tending;
mod turn;

use std::thread;

use isochrone_cyclic::{Clock, Monotonic, prepare_process};
use isochrone_ipc::Participant;
use isochrone_processes::{Company, Stop};
use isochrone_report::LinkArm;
use isochrone_timing::Warning;

use crate::{BenchError, Onlooker};
use series::KeptPace;
use session::Bench;
use tending::Tending;

pub use arm::Arm;
pub use bench_node::NodePlace;
pub use pace::{SendPace, Wait};
pub use peer::serve as serve_peer;
pub use settings::{Circumstance, Cpus, LatencySettings, MessageSize, plan};

/// What came of a bench.
#[derive(Debug, Default)]
pub struct LatencyResults {
    /// Every arm under every circumstance.
    pub links: Vec<LinkArm>,
    /// What makes results doubtful.
    pub warnings: Vec<Warning>,
}

/// Lets the arms take turns under every circumstance, in a domain of their own. The peer is this very
/// program with the arguments `bench latency-peer`; there it calls [`serve_peer`].
///
/// # Errors
/// A process cannot be started, or an arm failed.
pub fn measure(
    settings: &LatencySettings,
    stop: &Stop,
    onlooker: &dyn Onlooker,
) -> Result<LatencyResults, BenchError> {
    let company = Company::gather("isobench")?;
    let refusals = prepare_process().refusals;
    let participant = Participant::join("isochrone/latency", company.domain())?.for_real_time()?;
    thread::scope(|scope| {
        let mut bench = Bench {
            settings,
            company: &company,
            participant: &participant,
            tending: Tending::start(scope, &participant),
            stop,
            onlooker,
            origin_ns: Monotonic.now_ns(),
            turns: 0,
            paces: Vec::new(),
            warnings: refusals.iter().map(isochrone_runtime::warning).collect(),
        };
        let mut links = Vec::new();
        for size in &settings.sizes {
            if stop.is_due() {
                break;
            }
            links.extend(bench.measure(size.values, &size.circumstances)?);
        }
        let mut warnings = bench.warnings;
        warnings.extend(KeptPace::warning(&bench.paces));
        warnings.extend(settings.warnings());
        Ok(LatencyResults { links, warnings })
    })
}

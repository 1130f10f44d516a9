//! The command line of `publish`.

use isochrone_engine::{parse_duration_ns, parse_seconds};
use isochrone_ipc::refuse_own_service;

use super::from::FromArgs;
use super::signals::SignalArgs;
use crate::base::failure::Failure;
use crate::base::{domain, numbers};

/// Publish frames of values: constants, waves, a CSV file or a recording
///
/// Each value, wave or CSV column is one channel. A recording is published as it is, with all of its
/// services or those that are named. A service has one writer: where another one lives, `publish` is refused,
/// also where that is on another machine and its frames arrive through a link. From a program that is not of
/// isochrone, `--take-over` takes the service over.
///
/// Frames at a rate are due on the grid that the tasks of all nodes share, if 20 ms are a multiple of the time
/// between two of them; --phase puts them before or after the releases of the tasks that read or
/// follow them.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone publish plant/analog --value 13824,true --signals level,full\n  \
    isochrone publish plant/analog --wave sine,square --amplitude 13824,1 --offset 13824 --frequency 0.5\n  \
    isochrone publish plant/analog --csv recorded.csv\n  \
    isochrone publish plant/analog --csv recorded.csv --signals level --rate 1000\n  \
    isochrone publish plant/analog --value 13824 --rate 500 --phase 200us\n  \
    isochrone publish --from level.mcap\n  \
    isochrone publish --from shift.mcap plant/level plant/valve --speed 0.5"
)]
#[command(group(clap::ArgGroup::new("what").required(true).args(["value", "wave", "csv", "from"])))]
pub(crate) struct Args {
    /// Service to publish on, such as plant/analog; with --from those of the recording, by default all
    #[arg(value_name = "SERVICE", required_unless_present = "from")]
    pub(super) services: Vec<String>,
    #[command(flatten)]
    pub(super) source: SignalArgs,
    #[command(flatten)]
    pub(super) from: FromArgs,
    /// Frames per second; default: the recorded pace of a CSV file with the column `time_s`,
    /// otherwise 1000
    #[arg(
        long,
        value_name = "HZ",
        value_parser = parse_rate,
        allow_negative_numbers = true,
        conflicts_with = "from"
    )]
    pub(super) rate: Option<f64>,
    /// How long after a task without a phase each frame is due, on the grid that all tasks share: 200us; default:
    /// half of the time between two frames, at most 150us, so that a publisher does not wake up just when tasks
    /// do. Needs a rate
    #[arg(
        long,
        value_name = "DURATION",
        value_parser = parse_duration_ns,
        allow_negative_numbers = true,
        conflicts_with = "from"
    )]
    pub(super) phase: Option<u64>,
    /// Stop after this many frames
    #[arg(long, value_parser = numbers::parse_count, allow_negative_numbers = true)]
    pub(super) count: Option<u64>,
    /// Stop after this time, counted from the first frame: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", value_parser = parse_seconds, allow_negative_numbers = true)]
    pub(super) seconds: Option<f64>,
    /// Print the summary as JSON
    #[arg(long)]
    pub(super) json: bool,
    #[command(flatten)]
    pub(super) take_over: domain::TakeOver,
    #[command(flatten)]
    pub(super) domain: domain::Args,
}

const MAX_RATE_HZ: f64 = 100_000.0;
const MIN_RATE_HZ: f64 = 1.0 / 3600.0;

fn parse_rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if (MIN_RATE_HZ..=MAX_RATE_HZ).contains(&rate) => Ok(rate),
        _ => Err(format!("give frames per second, from {MIN_RATE_HZ:.4} to {MAX_RATE_HZ}")),
    }
}

/// Refuses a name that is reserved for nodes, such as that of their telemetry.
pub(super) fn refuse_reserved(service: &str) -> Result<(), Failure> {
    refuse_own_service(service).map_err(Failure::usage)
}

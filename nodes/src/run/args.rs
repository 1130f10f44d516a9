//! The arguments of `run`.

use std::path::PathBuf;

use isochrone_engine::parse_seconds;

use crate::base::{domain, numbers};

/// Run a control node until Ctrl-C, SIGTERM, --seconds or --cycles
///
/// Each task runs at its period: it reads the newest frame of every input's service, steps the
/// blocks and publishes a frame for every output. Peers may join, leave or be killed at any time.
/// If the machine refuses real-time scheduling, a warning shows the remedy; --strict makes it an
/// error.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone run examples/level.toml\n  \
    isochrone run level.toml --seconds 60 --report level.json\n  isochrone run level.toml --record level.mcap\n  isochrone run level.toml --strict")]
pub(crate) struct Args {
    /// Configuration file (TOML)
    pub(super) file: PathBuf,
    /// Stop after this time, counted from the first cycle: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", value_parser = parse_seconds, allow_negative_numbers = true)]
    pub(super) seconds: Option<f64>,
    /// Stop after this many cycles of the first task
    #[arg(long, value_parser = numbers::parse_count, allow_negative_numbers = true)]
    pub(super) cycles: Option<u64>,
    /// Write the report (JSON) to this file at the end
    #[arg(long, value_name = "FILE.json")]
    pub(super) report: Option<PathBuf>,
    /// Add to this file what is set, forced, released, undone and applied, with the values before and after.
    /// While it cannot be written, changes are refused
    #[arg(long, value_name = "FILE.jsonl")]
    pub(super) journal: Option<PathBuf>,
    /// Record every cycle of every task in this file, with its inputs and outputs and what is done to the node:
    /// `replay` repeats the run bit for bit. No file is replaced: where level.mcap is there, level_0002.mcap is written,
    /// and so on. If the file cannot be written any more, the node runs on without it
    #[arg(long, value_name = "FILE.mcap")]
    pub(super) record: Option<PathBuf>,
    /// Retain the state of the node in this file instead of NODE.state in $STATE_DIRECTORY or
    /// ~/.local/state/isochrone. The configuration says retain = true
    #[arg(long, value_name = "FILE.state")]
    pub(super) state: Option<PathBuf>,
    /// Start without the state that the node retained, which is kept as FILE.state.cold
    #[arg(long)]
    pub(super) cold: bool,
    /// Run as one of two processes of the node on this machine: the first one holds the outputs, the second one stands by
    /// and takes over within milliseconds if the first is silent. Two machines cannot be twins: that would need a
    /// witness and a common clock
    #[arg(long)]
    pub(super) redundant: bool,
    /// How many of its releases the standby waits in silence before it takes over
    #[arg(long, value_name = "RELEASES", default_value_t = 2, requires = "redundant",
          value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(super) after: u32,
    /// Print the report as JSON instead of the table
    #[arg(long)]
    pub(super) json: bool,
    /// Refuse to start if there are warnings or the requested scheduling is refused
    #[arg(long)]
    pub(super) strict: bool,
    /// Exit with status 1 if a block reported an error
    #[arg(long)]
    pub(super) fail_on_block_errors: bool,
    #[command(flatten)]
    pub(super) take_over: domain::TakeOver,
    #[command(flatten)]
    pub(super) domain: domain::Args,
}

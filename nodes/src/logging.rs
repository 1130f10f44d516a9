//! Logs: ours and iceoryx2's, to stderr.

use isochrone_ipc::{LogLevel, set_log_level};
use tracing::level_filters::LevelFilter;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

use crate::terminal;

/// The target of what iceoryx2 says: a line is a dump of a structure, thousands of characters long,
/// and whatever matters of it comes as an error.
const ICEORYX2: &str = "iceoryx2_bb_loggers";

/// What blocks, inputs and followed frames report: that something is well again belongs to the warning before.
const EVENTS: [&str; 2] = ["isochrone_runtime::events", "isochrone_runtime::late_frames"];

/// Sets logging up: warnings; with `-v` also what is set up, with `-vv` also services that are created
/// and peers that come and go, with `-vvv` also iceoryx2's own messages. `RUST_LOG` overrides all of it: levels,
/// for all or for a target (`warn,isochrone_ipc=debug`).
pub(crate) fn set_up(verbosity: u8) {
    let level = match verbosity {
        0 => LevelFilter::WARN,
        1 => LevelFilter::INFO,
        2 => LevelFilter::DEBUG,
        _ => LevelFilter::TRACE,
    };
    let chosen = std::env::var("RUST_LOG").ok().filter(|text| !text.is_empty());
    let is_ours_alone = verbosity < 3 && chosen.is_none();
    let filter = match chosen {
        Some(text) => text.parse().unwrap_or_else(|error| {
            terminal::note(&format!("RUST_LOG={text:?} is not used: {error}"));
            Targets::new().with_default(level)
        }),
        None => ours(level, verbosity),
    };
    // iceoryx2 asks its own level before it hands a message on.
    set_log_level(match highest(&filter) {
        LevelFilter::OFF | LevelFilter::ERROR => LogLevel::Error,
        _ if is_ours_alone => LogLevel::Fatal,
        LevelFilter::WARN => LogLevel::Warn,
        LevelFilter::INFO => LogLevel::Info,
        LevelFilter::DEBUG => LogLevel::Debug,
        _ => LogLevel::Trace,
    });
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(terminal::notes)
        // Modules of the program are for those who choose among them.
        .with_target(!is_ours_alone)
        .with_ansi(terminal::stderr_has_colour());
    tracing_subscriber::registry().with(lines).with(filter).init();
}

/// What is logged unless somebody chooses.
fn ours(level: LevelFilter, verbosity: u8) -> Targets {
    let filter = Targets::new().with_default(level);
    match verbosity {
        0 => filter
            .with_target(ICEORYX2, LevelFilter::OFF)
            .with_targets(EVENTS.map(|events| (events, LevelFilter::INFO))),
        1 | 2 => filter.with_target(ICEORYX2, LevelFilter::OFF),
        _ => filter,
    }
}

/// The highest level of any target.
fn highest(filter: &Targets) -> LevelFilter {
    let targets = filter.iter().map(|(_, level)| level);
    targets.chain(filter.default_level()).max().unwrap_or(LevelFilter::OFF)
}

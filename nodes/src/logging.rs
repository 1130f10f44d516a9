//! Logs: ours and iceoryx2's, to stderr.

use isochrone_ipc::{LogLevel, set_log_level};
use tracing::level_filters::LevelFilter;
use tracing_subscriber::EnvFilter;

use crate::terminal;

/// The target of what iceoryx2 says: a line is a dump of a structure, thousands of characters long,
/// and whatever matters of it comes as an error.
const ICEORYX2: &str = "iceoryx2_bb_loggers=off";

/// What blocks, inputs and followed frames report: that something is well again belongs to the warning before.
const EVENTS: [&str; 2] = ["isochrone_runtime::events=info", "isochrone_runtime::late_frames=info"];

/// Sets logging up: warnings; with `-v` also what is set up, with `-vv` also services that are created
/// and peers that come and go, with `-vvv` also iceoryx2's own messages. `RUST_LOG` overrides all of it.
pub(crate) fn set_up(verbosity: u8) {
    let level = match verbosity {
        0 => LevelFilter::WARN,
        1 => LevelFilter::INFO,
        2 => LevelFilter::DEBUG,
        _ => LevelFilter::TRACE,
    };
    let is_ours_alone = verbosity < 3 && std::env::var_os(EnvFilter::DEFAULT_ENV).is_none();
    let mut filter = EnvFilter::builder().with_default_directive(level.into()).from_env_lossy();
    if is_ours_alone && let Ok(directive) = ICEORYX2.parse() {
        filter = filter.add_directive(directive);
    }
    if is_ours_alone && verbosity == 0 {
        let directives = EVENTS.iter().filter_map(|events| events.parse().ok());
        filter = directives.fold(filter, EnvFilter::add_directive);
    }
    // iceoryx2 asks its own level before it hands a message on.
    set_log_level(match filter.max_level_hint().unwrap_or(level) {
        LevelFilter::OFF | LevelFilter::ERROR => LogLevel::Error,
        _ if is_ours_alone => LogLevel::Fatal,
        LevelFilter::WARN => LogLevel::Warn,
        LevelFilter::INFO => LogLevel::Info,
        LevelFilter::DEBUG => LogLevel::Debug,
        _ => LogLevel::Trace,
    });
    tracing_subscriber::fmt()
        .with_writer(terminal::notes)
        // Modules of the program are for those who choose among them.
        .with_target(!is_ours_alone)
        .with_ansi(terminal::stderr_has_colour())
        .with_env_filter(filter)
        .init();
}

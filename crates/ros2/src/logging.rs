//! Logs: ours, iceoryx2's and RustDDS's, to stderr.

use isochrone_ipc::{LogLevel, set_log_level};
use tracing::level_filters::LevelFilter;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

use crate::terminal::Notes;

/// Sets logging up: warnings; with `-v` also who comes and goes, with `-vv` also what RustDDS says.
pub(crate) fn set_up(verbosity: u8) {
    let level = match verbosity {
        0 => LevelFilter::WARN,
        1 => LevelFilter::INFO,
        2 => LevelFilter::DEBUG,
        _ => LevelFilter::TRACE,
    };
    let chosen = std::env::var("RUST_LOG").ok().and_then(|text| text.parse::<Targets>().ok());
    let filter = chosen.unwrap_or_else(|| {
        Targets::new().with_default(level).with_target("iceoryx2_bb_loggers", LevelFilter::OFF)
    });
    set_log_level(LogLevel::Fatal);
    let lines = tracing_subscriber::fmt::layer().with_writer(|| Notes).with_target(false);
    tracing_subscriber::registry().with(lines.with_ansi(false)).with(filter).init();
    if verbosity >= 2 && log::set_logger(&RustDds).is_ok() {
        log::set_max_level(log::LevelFilter::Warn);
    }
}

/// Hands on what RustDDS says. It warns of much that is as it should be, so only those who look closely see it.
struct RustDds;

impl log::Log for RustDds {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.level() <= log::Level::Warn
    }

    fn log(&self, record: &log::Record<'_>) {
        if self.enabled(record.metadata()) {
            tracing::debug!("{}: {}", record.target(), record.args());
        }
    }

    fn flush(&self) {}
}

//! Logs: ours and iceoryx2's, to stderr.

use std::io;

use isochrone_ipc::{LogLevel, set_log_level};
use tracing::level_filters::LevelFilter;
use tracing_subscriber::EnvFilter;

/// Sets logging up: warnings, and more with each `-v`; `RUST_LOG` overrides both.
pub(crate) fn set_up(verbosity: u8) {
    let level = match verbosity {
        0 => LevelFilter::WARN,
        1 => LevelFilter::INFO,
        2 => LevelFilter::DEBUG,
        _ => LevelFilter::TRACE,
    };
    let filter = EnvFilter::builder().with_default_directive(level.into()).from_env_lossy();
    // iceoryx2 asks its own level before it hands a message on.
    set_log_level(match filter.max_level_hint().unwrap_or(level) {
        LevelFilter::OFF | LevelFilter::ERROR => LogLevel::Error,
        LevelFilter::WARN => LogLevel::Warn,
        LevelFilter::INFO => LogLevel::Info,
        LevelFilter::DEBUG => LogLevel::Debug,
        _ => LogLevel::Trace,
    });
    tracing_subscriber::fmt()
        .with_writer(io::stderr)
        .with_ansi(crate::terminal::stderr_has_colour())
        .with_env_filter(filter)
        .init();
}

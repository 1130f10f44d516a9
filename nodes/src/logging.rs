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

/// What blocks, inputs, their services and followed frames report: that something is well again belongs to the warning
/// before.
const EVENTS: [&str; 3] = [
    "isochrone_runtime::events",
    "isochrone_runtime::supervisor::layouts",
    "isochrone_runtime::placement",
];

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
    let chosen = std::env::var("RUST_LOG").ok().and_then(|text| chosen(&text));
    let is_ours_alone = verbosity < 3 && chosen.is_none();
    let filter = chosen.unwrap_or_else(|| ours(level, verbosity));
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

/// What `RUST_LOG` chooses, if it can be read: levels and `target=level`, separated by commas.
fn chosen(text: &str) -> Option<Targets> {
    let parts: Vec<&str> = text.split(',').map(str::trim).filter(|part| !part.is_empty()).collect();
    if parts.is_empty() {
        return None;
    }
    let filter = parts.join(",").parse();
    if let Err(error) = &filter {
        terminal::note(&format!(
            "RUST_LOG={text:?} is ignored: {error}; write levels, or targets with levels: warn,isochrone_ipc=debug"
        ));
    }
    filter.ok()
}

/// The default filter of the log.
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

#[cfg(test)]
mod tests {
    use tracing::Level;

    use super::*;

    #[test]
    fn levels_are_chosen_for_all_and_for_targets_with_spaces_and_empty_parts_between() {
        let filter = chosen(" warn , isochrone_ipc=debug,").unwrap();
        assert!(filter.would_enable("isochrone_ipc::domain", &Level::DEBUG));
        assert!(filter.would_enable("isochrone_runtime", &Level::WARN));
        assert!(!filter.would_enable("isochrone_runtime", &Level::INFO));
        assert_eq!(highest(&filter), LevelFilter::DEBUG);
    }

    #[test]
    fn what_chooses_nothing_or_cannot_be_read_leaves_the_programs_own_filter() {
        for text in ["", " ", ",", "isochrone_ipc=loud"] {
            assert!(chosen(text).is_none(), "{text}");
        }
    }
}

//! How long a bench and its turns may take.

use isochrone_engine::parse_seconds;

/// Reads how long a bench takes: a week at most.
pub(super) fn parse_length(text: &str) -> Result<f64, String> {
    match parse_seconds(text)? {
        seconds if seconds <= 604_800.0 => Ok(seconds),
        _ => Err("give at most a week, 604800s".into()),
    }
}

/// Reads how long a turn takes: what it measures is kept in memory until it is over.
pub(super) fn parse_turn(text: &str) -> Result<f64, String> {
    match parse_seconds(text)? {
        seconds @ 0.01..=60.0 => Ok(seconds),
        _ => Err("a turn takes 10ms to 60s".into()),
    }
}

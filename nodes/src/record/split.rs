//! When another file begins.

use std::time::Duration;

use isochrone_engine::parse_duration_ns;

/// How long a file becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Split {
    /// This long.
    After(Duration),
    /// About this large, in bytes.
    Size(u64),
}

/// Units of sizes, in bytes.
const UNITS: [(&str, u64); 7] = [
    ("kB", 1_000),
    ("MB", 1_000_000),
    ("GB", 1_000_000_000),
    ("TB", 1_000_000_000_000),
    ("KiB", 1 << 10),
    ("MiB", 1 << 20),
    ("GiB", 1 << 30),
];
/// Less would be files of little but names.
const LEAST_BYTES: u64 = 100_000;
const MOST_BYTES: f64 = 1e15;
const LEAST_TIME: Duration = Duration::from_secs(1);

/// Reads a time or a size.
pub(crate) fn parse(text: &str) -> Result<Split, String> {
    let text = text.trim();
    let size = UNITS.into_iter().find_map(|(unit, bytes)| Some((text.strip_suffix(unit)?, bytes)));
    if let Some((number, unit_bytes)) = size {
        let number: f64 = number.trim().parse().map_err(|_| how(text))?;
        let bytes = number * unit_bytes as f64;
        if !(LEAST_BYTES as f64..=MOST_BYTES).contains(&bytes) {
            return Err(format!(
                "a file has at least {} kB and at most 1000 TB",
                LEAST_BYTES / 1000
            ));
        }
        return Ok(Split::Size(bytes as u64));
    }
    let time = Duration::from_nanos(parse_duration_ns(text).map_err(|_| how(text))?);
    if time < LEAST_TIME {
        return Err("a file is at least 1s long".into());
    }
    Ok(Split::After(time))
}

fn how(text: &str) -> String {
    format!("\"{text}\" is neither a time nor a size; give one such as 10min, 1h, 500MB or 1GB")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_or_a_size_has_its_unit() {
        assert_eq!(parse("1h"), Ok(Split::After(Duration::from_secs(3600))));
        assert_eq!(parse("1GB"), Ok(Split::Size(1_000_000_000)));
        assert_eq!(parse("0.5 MiB"), Ok(Split::Size(1 << 19)));
        for wrong in ["1", "", "GB", "xMB", "NaNGB", "-1GB", "1kB", "10ms", "1 day"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}

//! The signals of a publisher.

use std::collections::HashSet;
use std::path::PathBuf;

use isochrone_ipc::SignalSpec;

use isochrone_timing::units::counted;

use crate::base::csv_table::CsvTable;
use crate::base::failure::Failure;
use crate::base::numbers;
use crate::base::rows;
use crate::base::wave::{Shape, Wave};

/// The signals, as given on the command line.
#[derive(clap::Args)]
pub(super) struct SignalArgs {
    /// Constant values, one per channel: numbers, true or false
    #[arg(
        long,
        value_delimiter = ',',
        value_parser = Constant::parse,
        allow_negative_numbers = true,
        value_name = "V,…"
    )]
    value: Vec<Constant>,
    /// Waves, one per channel
    #[arg(long, value_delimiter = ',', value_enum, value_name = "SHAPE,…")]
    wave: Vec<Shape>,
    /// CSV file, for example from `subscribe --csv`: a header row, then one row per frame. The
    /// column `time_s` sets when each frame is due, `cycle` is ignored, and every other column is a
    /// channel; one that stands twice with the same values is one channel. Publishing stops after the last
    /// row; with a larger --count the last row is repeated
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Channel names for --value and --wave (default: ch0, ch1, …); with --csv, the columns to
    /// publish, in this order
    #[arg(long, value_delimiter = ',', value_name = "NAME,…", conflicts_with = "from")]
    signals: Vec<String>,
    /// Peak of each wave, or one value for all
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "1",
        value_parser = parse_finite,
        allow_negative_numbers = true,
        value_name = "A,…"
    )]
    amplitude: Vec<f64>,
    /// Mean of each wave, or one value for all
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "0",
        value_parser = parse_finite,
        allow_negative_numbers = true,
        value_name = "O,…"
    )]
    offset: Vec<f64>,
    /// Frequency of each wave in Hz, or one value for all
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "1",
        value_parser = parse_frequency,
        allow_negative_numbers = true,
        value_name = "HZ,…"
    )]
    frequency: Vec<f64>,
}

/// The signals, with their names.
pub(super) struct Signals {
    source: Source,
    specs: Vec<SignalSpec>,
}

/// Where the values come from.
enum Source {
    Constant(Vec<f64>),
    Waves(Vec<Wave>),
    Table(CsvTable),
}

/// A value of the command line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Constant {
    value: f64,
    is_bool: bool,
}

impl Constant {
    /// Reads a number, `true` or `false`.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        if let Some(value) = numbers::parse_bool(text) {
            return Ok(Self { value: f64::from(value), is_bool: true });
        }
        let value = numbers::parse_number(text).map_err(|error| error.to_string())?;
        Ok(Self { value, is_bool: false })
    }
}

impl Signals {
    pub(super) fn new(args: &SignalArgs) -> Result<Self, Failure> {
        check_names(&args.signals)?;
        if let Some(path) = &args.csv {
            let mut table = CsvTable::read(path).map_err(Failure::usage)?;
            if !args.signals.is_empty() {
                table = table.select(&args.signals).map_err(Failure::usage)?;
            }
            // Untyped: whether a sample fits its input is for the input to say, sample by sample.
            let specs = table.columns().iter().zip(table.units());
            let specs = specs.map(|(name, unit)| SignalSpec::new(name, "").in_unit(unit)).collect();
            return Ok(Self { source: Source::Table(table), specs });
        }
        let (source, types) = if args.wave.is_empty() {
            let types =
                args.value.iter().map(|constant| if constant.is_bool { "BOOL" } else { "" });
            let values = args.value.iter().map(|constant| constant.value).collect();
            (Source::Constant(values), types.collect())
        } else {
            (Source::Waves(waves(args)?), vec![""; args.wave.len()])
        };
        let names = names(args, types.len())?;
        let specs = names.into_iter().zip(types).map(|(name, of)| SignalSpec::new(name, of));
        Ok(Self { source, specs: specs.collect() })
    }

    pub(super) fn specs(&self) -> &[SignalSpec] {
        &self.specs
    }

    /// The table that the values come from, if they do.
    pub(super) fn table(&self) -> Option<&CsvTable> {
        match &self.source {
            Source::Table(table) => Some(table),
            _ => None,
        }
    }

    pub(super) fn write(&self, frame: u64, time_s: f64, values: &mut [f64]) {
        match &self.source {
            Source::Constant(constants) => values.copy_from_slice(constants),
            Source::Waves(waves) => {
                values.iter_mut().zip(waves).for_each(|(value, wave)| *value = wave.at(time_s));
            }
            Source::Table(table) => values.copy_from_slice(table.row(frame)),
        }
    }
}

/// Refuses names that readers could not tell apart, or not find in a table.
fn check_names(names: &[String]) -> Result<(), Failure> {
    let mut seen = HashSet::new();
    for (index, name) in names.iter().enumerate() {
        let number = index + 1;
        let why = if name.trim().is_empty() {
            format!("--signals: name {number} is empty; give each signal a name")
        } else if rows::is_reserved(name) {
            format!(
                "--signals: \"{name}\" is no name for a signal, because `subscribe --csv` writes a column \
                 \"{name}\" of its own; choose another name"
            )
        } else if !seen.insert(name) {
            format!("--signals names \"{name}\" twice; name each once")
        } else {
            continue;
        };
        return Err(Failure::usage(why));
    }
    Ok(())
}

/// The names of channels: those that were given, or their numbers.
fn names(args: &SignalArgs, channels: usize) -> Result<Vec<String>, Failure> {
    if args.signals.is_empty() {
        return Ok((0..channels).map(|channel| format!("ch{channel}")).collect());
    }
    if args.signals.len() != channels {
        let given = counted(args.signals.len(), "signal");
        return Err(Failure::usage(format!(
            "--signals names {given} for {}; name each once",
            counted(channels, "channel")
        )));
    }
    Ok(args.signals.clone())
}

fn waves(args: &SignalArgs) -> Result<Vec<Wave>, Failure> {
    let channels = args.wave.len();
    let of = |option: &str, values: &[f64], channel: usize| match values {
        [one] => Ok(*one),
        several => {
            let value = several.get(channel).copied().filter(|_| several.len() == channels);
            value.ok_or_else(|| {
                Failure::usage(format!(
                    "--{option} gives {} for {}; give one for all, or one for each",
                    counted(several.len(), "value"),
                    counted(channels, "wave")
                ))
            })
        }
    };
    let wave = |(channel, shape): (usize, &Shape)| {
        Ok(Wave {
            shape: *shape,
            amplitude: of("amplitude", &args.amplitude, channel)?,
            offset: of("offset", &args.offset, channel)?,
            frequency_hz: of("frequency", &args.frequency, channel)?,
        })
    };
    args.wave.iter().enumerate().map(wave).collect()
}

fn parse_finite(text: &str) -> Result<f64, String> {
    match numbers::parse_number(text) {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("give a number, such as 13824 or 0.5".into()),
    }
}

fn parse_frequency(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(frequency) if frequency.is_finite() && frequency >= 0.0 => Ok(frequency),
        _ => Err("give a frequency in Hz, 0 or greater".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_a_number_or_true_or_false() {
        let read = |text| Constant::parse(text).map(|constant| (constant.value, constant.is_bool));
        assert_eq!(read("13824"), Ok((13824.0, false)));
        assert_eq!(read("true"), Ok((1.0, true)));
        assert_eq!(read("FALSE"), Ok((0.0, true)));
        assert!(read("1e400").unwrap_err().contains("1.8e308"));
        assert!(read("yes").unwrap_err().contains("true or false"));
    }
}

//! `get`: values alone.

use super::node;
use super::reading::Reading;
use super::types::typed;
use crate::base::failure::Failure;
use crate::base::terminal;

/// Print values of a running node, one per line
///
/// All values of a task are of the same cycle, after its blocks stepped. The values stand alone, as `show`
/// writes them but with all their digits; `set` takes them as they are. Values with flags, such as those
/// computed from a dead sensor (STALE), are named on stderr. A program had better use --json, which has the
/// flags as well, and where a TIME is a number of milliseconds and a WORD a whole number.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone get level ramp.setChangeRate\n  \
    isochrone get level level.y level_raw.ok\n  isochrone get level 'ramp.*' --json")]
pub(crate) struct Args {
    #[command(flatten)]
    node: node::Args,
    /// Signals: inputs, `block.pin`, `block.17.pin`; `*` matches within one part of a name
    #[arg(required = true, value_name = "NAME")]
    names: Vec<String>,
    /// Print one JSON document, with names and cycles
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut node = args.node.connect()?;
    let reading = if args.json { node.read(&args.names)? } else { node.read_typed(&args.names)? };
    if args.json {
        return terminal::print_json(&reading);
    }
    let value = |(name, value): (&str, _)| typed(reading.types.get(name), value) + "\n";
    let lines = reading.values.iter().map(value);
    terminal::print(&lines.collect::<String>())?;
    if let Some(warning) = warning(&reading) {
        terminal::note(&warning);
    }
    Ok(())
}

/// Says which values have flags, in the order in which they are printed.
fn warning(reading: &Reading) -> Option<String> {
    /// So many are named; `show` has all of them.
    const NAMED: usize = 5;
    let flagged = reading.values.iter().map(|(name, _)| (name, reading.flags(name)));
    let flagged: Vec<_> = flagged.filter(|(_, flags)| !flags.is_empty()).collect();
    let named = flagged.iter().take(NAMED).map(|(name, flags)| format!("{name} is {flags}"));
    let mut parts: Vec<_> = named.collect();
    if flagged.len() > NAMED {
        parts.push(format!("{} more", flagged.len() - NAMED));
    }
    (!parts.is_empty()).then(|| format!("warning: {}", parts.join("; ")))
}

#[cfg(test)]
mod tests {
    use isochrone_control::{Value, Values};

    use super::*;

    #[test]
    fn values_with_flags_are_named_in_their_order_and_the_rest_is_counted() {
        let names: Vec<String> = (0..9).map(|number| format!("b.{number}")).collect();
        let values: Values = names.iter().map(|name| (name.clone(), Value::Bool(true))).collect();
        let of = |from: usize| -> Reading {
            let flags = vec!["STALE".to_owned(), "ERROR".to_owned()];
            let flagged = names.iter().skip(from).map(|name| (name.clone(), flags.clone()));
            let quality = Some(flagged.collect());
            Reading { values: values.clone(), quality, ..Reading::default() }
        };
        let said = warning(&of(7));
        assert_eq!(said.as_deref(), Some("warning: b.7 is STALE ERROR; b.8 is STALE ERROR"));
        assert!(warning(&of(0)).unwrap().ends_with("b.4 is STALE ERROR; 4 more"));
        assert_eq!(warning(&of(9)), None);
        assert_eq!(warning(&Reading { quality: None, ..of(0) }), None);
    }
}

//! Checks of `[[protect]]` and `[limits]`.

use isochrone_blocks::{PinDefault, PinType};
use toml::Spanned;

use super::InputPart;
use super::names::{Entry, Names};
use super::pins::part_of_variable;
use super::wires::Wiring;
use crate::Diagnostic;
use crate::config::{Config, Limit, Variable};
use crate::diagnostic::{Among, Problem};
use crate::nearest::KnownNames;
use crate::pattern::{Pattern, part_matches};

/// Reports names that stand for nothing, and constants outside of their limits.
pub(super) fn check(
    config: &Config,
    names: &Names<'_>,
    wiring: &Wiring,
    diagnostics: &mut Vec<Diagnostic>,
) {
    for protected in &config.protected {
        let pattern = Pattern::new(protected.get_ref());
        let matches = is_of_value(names, &pattern) || !pins(names, wiring, &pattern).is_empty();
        if !matches && !is_unclear(names, &pattern) {
            diagnostics.push(unknown(names, protected));
        }
    }
    let check = |limit| check_limit(names, wiring, &config.variables, limit);
    diagnostics.extend(config.limits.iter().filter_map(check));
}

fn check_limit(
    names: &Names<'_>,
    wiring: &Wiring,
    variables: &[Variable],
    limit: &Limit,
) -> Option<Diagnostic> {
    let (min, max) = *limit.range.as_ref()?.get_ref();
    let diagnostic =
        |problem, message: String| Diagnostic::new(problem, limit.names.span(), message);
    let pattern = Pattern::new(limit.names.get_ref());
    let pins = pins(names, wiring, &pattern);
    if pins.is_empty() && is_unclear(names, &pattern) {
        return None;
    }
    let constant = |pin: &Pin| {
        let entry = names.entries.get(pin.entry)?;
        let known = entry.block_type?.inputs.get(pin.pin)?;
        let constants = wiring.constants_of(entry.first + pin.instance, pin.entry);
        let constant = constants.get(pin.pin).copied().flatten()?;
        // Limits are for numbers, and a task is none.
        let is_given = known.default != PinDefault::CallingTask || known.pin_type.holds(constant);
        let is_bounded = known.pin_type != PinType::Bool;
        is_bounded.then(|| {
            let name = format!("{}.{}", entry.instance_name(pin.instance), known.name);
            (name, is_given.then_some(constant))
        })
    };
    let is_meant = |variable: &&Variable| {
        variable.name.as_ref().is_some_and(|name| pattern.matches(name.get_ref()))
            && variable.value_type != Some(PinType::Bool)
    };
    let variables = || variables.iter().filter(is_meant);
    if let Some(range) = variables().find_map(|variable| variable.range.as_ref()) {
        let message = format!("\"{}\" bounds a variable that has a range", limit.names.get_ref());
        let diagnostic = diagnostic(Problem::Conflict, message).help("keep one of the two");
        return Some(Diagnostic { first: Some(range.span()), ..diagnostic });
    }
    let initial = |variable: &Variable| {
        let name = variable.name.as_ref()?.get_ref().clone();
        Some((name, variable.initial.as_ref().map(|initial| *initial.get_ref())))
    };
    let in_file = pins.iter().filter_map(constant).chain(variables().filter_map(initial));
    let mut parameters = in_file.peekable();
    if pins.is_empty() && !is_of_value(names, &pattern) {
        return Some(unknown(names, &limit.names));
    }
    if parameters.peek().is_none() {
        let message = format!("\"{}\" is no parameter that has limits", limit.names.get_ref());
        let help = "limits are for input pins that hold numbers and that no wire leads to, and for \
                    variables that hold numbers";
        return Some(diagnostic(Problem::Conflict, message).help(help));
    }
    let outside = |(name, constant): (String, Option<f64>)| {
        Some((name, constant.filter(|constant| !(min..=max).contains(constant))?))
    };
    let (name, constant) = parameters.find_map(outside)?;
    let message = format!("{name} is {constant:?}, outside of its limits {min:?} to {max:?}");
    let key = if names.variables.contains_key(name.as_str()) { "initial" } else { "[block.in]" };
    let help = format!("change the value in {key}, or the limits");
    Some(diagnostic(Problem::OutOfRange, message).help(help))
}

/// Whether a pattern stands for a variable, for an input, or for what that is worth.
fn is_of_value(names: &Names<'_>, pattern: &Pattern) -> bool {
    let parts = |input: &&str| InputPart::ALL.map(|part| format!("{input}{}", part.suffix()));
    names.inputs.keys().flat_map(parts).any(|input| pattern.matches(&input))
        || names.variables.keys().any(|variable| pattern.matches(variable))
}

/// Whether a pattern may stand for pins of a block whose type does not exist, which is another diagnostic.
fn is_unclear(names: &Names<'_>, pattern: &Pattern) -> bool {
    let name = pattern.parts().first().map_or("", String::as_str);
    let mut untyped = names.entries.iter().filter(|entry| entry.block_type.is_none());
    untyped.any(|entry| part_matches(name, entry.name))
}

/// A pin of an instance: inputs first, then outputs.
struct Pin {
    entry: usize,
    instance: usize,
    pin: usize,
}

/// The pins that match a pattern. Of instances that differ in nothing, one is enough.
fn pins(names: &Names<'_>, wiring: &Wiring, pattern: &Pattern) -> Vec<Pin> {
    let mut found = Vec::new();
    for (index, entry) in names.entries.iter().enumerate() {
        let Some(block_type) = entry.block_type else { continue };
        let (name, number, pin) = match (pattern.parts(), entry.count) {
            ([name, pin], 1) => (name, "*", pin),
            ([name, number, pin], 2..) => (name, number.as_str(), pin),
            _ => continue,
        };
        if !part_matches(name, entry.name) {
            continue;
        }
        let named = block_type.signals().filter(|(_, known)| part_matches(pin, known.name));
        let pins: Vec<usize> = named.map(|(pin, _)| pin).collect();
        for instance in instances(entry, wiring, number) {
            found.extend(pins.iter().map(|pin| Pin { entry: index, instance, pin: *pin }));
        }
    }
    found
}

/// The instances of an entry whose numbers match, or some that stand for all.
fn instances(entry: &Entry<'_>, wiring: &Wiring, pattern: &str) -> Vec<usize> {
    if let Ok(number) = pattern.parse::<usize>() {
        return Some(number).filter(|number| *number < entry.count).into_iter().collect();
    }
    let is_matched = |instance: &usize| part_matches(pattern, &instance.to_string());
    if pattern.chars().any(|c| c != '*') {
        return (0..entry.count).filter(is_matched).collect();
    }
    let range = entry.first..entry.first + entry.count;
    let exceptions = wiring.exceptions.range(range).map(|(instance, _)| instance - entry.first);
    let exceptions: Vec<usize> = exceptions.collect();
    let other = (0..entry.count).find(|instance| !exceptions.contains(instance));
    exceptions.into_iter().chain(other).collect()
}

fn unknown(names: &Names<'_>, written: &Spanned<String>) -> Diagnostic {
    let text = written.get_ref();
    let message = format!("there is no signal \"{text}\"");
    let diagnostic = Diagnostic::new(Problem::UnknownSource, written.span(), message);
    let (base, rest) = text.split_once('.').unwrap_or((text, ""));
    if Pattern::is_glob(base) {
        return diagnostic
            .help("no input or pin matches it; * stands for any characters between two dots");
    }
    if names.variables.contains_key(base) && !names.blocks.contains_key(base) {
        return part_of_variable(base, rest, written.span());
    }
    let entry = names.blocks.get(base).and_then(|block| names.entries.get(*block));
    let Some(entry) = entry else { return diagnostic.seek(text, Among::InputsAndBlocks) };
    let Some(block_type) = entry.block_type else { return diagnostic };
    let pin = rest.rsplit('.').next().unwrap_or_default();
    let mut pins = block_type.signals().map(|(_, pin)| pin.name);
    if !pins.clone().any(|name| part_matches(pin, name)) {
        let known = KnownNames::new(pins);
        return diagnostic.help(match (known.nearest(pin), rest.rsplit_once('.')) {
            (None, _) => known.listing(),
            (Some(near), Some((number, _))) => format!("did you mean \"{base}.{number}.{near}\"?"),
            (Some(near), None) if entry.count == 1 => format!("did you mean \"{base}.{near}\"?"),
            (Some(near), None) => format!("did you mean \"{base}.*.{near}\"?"),
        });
    }
    let first = pins.find(|name| part_matches(pin, name)).unwrap_or_default();
    diagnostic.help(match entry.count {
        1 => format!("{base} is a single block: \"{base}.{first}\""),
        _ => format!("{base} has several instances: \"{base}.0.{first}\", or \"{base}.*.{first}\""),
    })
}

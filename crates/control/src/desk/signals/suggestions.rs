//! Suggestions for names that do not exist.

use std::cmp::Ordering;

use isochrone_engine::Pattern;
use isochrone_engine::{KnownNames, listing};
use isochrone_model::Refusal;

use super::Signals;
use crate::desk::refusal;

/// The most names of each kind that a misspelt one is compared with: a comparison takes some microseconds.
const COMPARED: usize = 4096;

impl Signals {
    /// The refusal of a name that does not exist, with a suggestion.
    pub(in crate::desk) fn unknown(&self, name: &str) -> Refusal {
        refusal::unknown(name, self.suggestion(name))
    }

    /// How many names a misspelt one is compared with: blocks, inputs and variables, or pins.
    pub(in crate::desk) fn comparisons(&self) -> usize {
        const PINS: usize = 16;
        (self.blocks.len() + self.values.len()).clamp(PINS, 2 * COMPARED)
    }

    fn suggestion(&self, name: &str) -> String {
        let is_glob = Pattern::is_glob(name);
        let matches_any = |name: &str| self.matching(&Pattern::new(name)).total() > 0;
        if is_glob && matches_any(name) {
            return "* is for reading and releasing alone; write each name".into();
        }
        if let Some((run, _)) = self.instance(name) {
            let pins = run.block_type.signals().map(|(_, pin)| pin.name);
            let listing = whole_names(name, pins).listing();
            let what = if run.block_type.is_alarm() { "an alarm" } else { "a block" };
            return format!("it is {what}; {listing}; \"{name}.*\" stands for all of them");
        }
        let (owner, pin) = name.rsplit_once('.').unwrap_or((name, ""));
        if let Some((run, _)) = self.instance(owner) {
            let pins = run.block_type.signals().map(|(_, pin)| pin.name);
            return whole_names(owner, pins).suggestion(pin);
        }
        let base = name.split('.').next().unwrap_or_default();
        // What stands behind the name of a block with several instances is a number.
        let of_value = self.value(base).filter(|_| owner == base || self.block(base).is_none());
        if let Some((task, slot)) = of_value {
            if self.is_variable(task, slot) {
                return format!("{base} is a variable, which has its value alone: \"{base}\"");
            }
            return whole_names(base, ["ok", "age"]).suggestion(pin);
        }
        if Pattern::is_glob(base) || is_glob && self.block(base).is_some() {
            return "no signal matches it; * stands for any characters between two dots".into();
        }
        if let Some(block) = self.block(base) {
            return match block.count {
                1 if self.locate(&format!("{base}.{pin}")).is_some() => {
                    format!("{base} is a single block: \"{base}.{pin}\"")
                }
                1 => format!("{base} is a single block: \"{base}.*\" stands for all of its pins"),
                count => {
                    let last = count - 1;
                    format!("the instances of {base} are {base}.0 to {base}.{last}: \"{base}.0.*\"")
                }
            };
        }
        let value = |found: &_| self.value_name(found);
        let place = |found: &_, beginning: &str| among(value(found).unwrap_or_default(), beginning);
        let values = alike(&self.values, base, place);
        let blocks = alike(&self.blocks, base, |block, beginning| among(&block.name, beginning));
        let names = values.iter().filter_map(value).chain(blocks.iter().map(|block| &*block.name));
        let known = KnownNames::new(names);
        let Some(near) = known.nearest(base) else {
            let names = self.values.iter().filter_map(value);
            let names = names.chain(self.blocks.iter().map(|block| &*block.name));
            return listing(names, self.values.len() + self.blocks.len());
        };
        let whole = format!("{near}{}", name.strip_prefix(base).unwrap_or_default());
        if self.locate(&whole).is_some() || is_glob && matches_any(&whole) {
            return format!("did you mean \"{whole}\"?");
        }
        // Its owner exists, so the rest is misspelt.
        let suggestion = self.suggestion(&whole);
        if self.instance(&whole).is_some() {
            return format!("did you mean \"{whole}\"? {suggestion}");
        }
        suggestion
    }
}

/// From many items ordered by name, those whose names begin like the misspelt one, with as long a common beginning as
/// leaves few of them; all if there are few.
fn alike<'a, T>(all: &'a [T], written: &str, compared: impl Fn(&T, &str) -> Ordering) -> &'a [T] {
    let mut found = all;
    for (end, c) in written.char_indices() {
        if found.len() <= COMPARED {
            break;
        }
        let beginning = written.get(..end + c.len_utf8()).unwrap_or_default();
        let first = found.partition_point(|one| compared(one, beginning) == Ordering::Less);
        found = found.get(first..).unwrap_or_default();
        let end = found.partition_point(|one| compared(one, beginning) == Ordering::Equal);
        found = found.get(..end).unwrap_or_default();
    }
    found.get(..COMPARED).unwrap_or(found)
}

/// Where a name stands among those that have a beginning.
fn among(name: &str, beginning: &str) -> Ordering {
    if name.starts_with(beginning) { Ordering::Equal } else { name.cmp(beginning) }
}

/// The signals of a block or an input, by the last part of their names.
struct WholeNames<'a> {
    owner: &'a str,
    parts: Vec<&'a str>,
}

fn whole_names<'a>(owner: &'a str, parts: impl IntoIterator<Item = &'a str>) -> WholeNames<'a> {
    WholeNames { owner, parts: parts.into_iter().collect() }
}

impl WholeNames<'_> {
    /// Suggests the full name that is nearest, so that it can be copied; otherwise lists those that exist.
    fn suggestion(&self, written: &str) -> String {
        match KnownNames::new(self.parts.iter().copied()).nearest(written) {
            Some(near) => format!("did you mean \"{}.{near}\"?", self.owner),
            None => self.listing(),
        }
    }

    /// Lists the full names that exist.
    fn listing(&self) -> String {
        let names: Vec<_> =
            self.parts.iter().map(|part| format!("{}.{part}", self.owner)).collect();
        KnownNames::new(names.iter().map(String::as_str)).listing()
    }
}

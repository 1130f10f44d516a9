//! Resolving the names of a configuration.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use isochrone_blocks::{BlockType, EXPR, PinType};
use toml::Spanned;

use super::pins::described;
use super::{InputPart, Rules};
use crate::Diagnostic;
use crate::config::{BlockEntry, Config};
use crate::diagnostic::{Among, Problem};
use crate::nearest::KnownNames;
use crate::parse::known_type;
use isochrone_model::OWN_SERVICES;

/// Most instances of a file: looking for names among more would keep others who ask a node waiting.
pub(crate) const MAX_INSTANCES: usize = 1_000_000;

/// Names resolved to indexes. Entries whose name, type or task is unknown are `None`; the errors
/// about them are reported.
pub(super) struct Names<'a> {
    pub(super) tasks: Vec<TaskName<'a>>,
    pub(super) inputs: HashMap<&'a str, ValueName>,
    pub(super) variables: HashMap<&'a str, ValueName>,
    pub(super) blocks: HashMap<&'a str, usize>,
    /// One for each `[[block]]`, then one for each `[[alarm]]`, in file order.
    pub(super) entries: Vec<Entry<'a>>,
    /// The task of each `[[output]]`.
    pub(super) outputs: Vec<Option<usize>>,
}

pub(super) struct TaskName<'a> {
    pub(super) name: &'a str,
    pub(super) ob: Option<i16>,
    pub(super) period_ns: u64,
}

/// An input or a variable: its index among those of the file.
#[derive(Clone, Copy)]
pub(super) struct ValueName {
    pub(super) index: usize,
    pub(super) task: Option<usize>,
    pub(super) value_type: Option<PinType>,
}

/// The instances of one `[[block]]`, or an alarm.
pub(super) struct Entry<'a> {
    pub(super) name: &'a str,
    pub(super) span: Range<usize>,
    pub(super) block_type: Option<BlockType>,
    pub(super) task: Option<usize>,
    pub(super) count: usize,
    /// Otherwise nothing can be said about a wire from one of the instances.
    pub(super) count_is_known: bool,
    /// Number of the first instance among all instances of the file.
    pub(super) first: usize,
}

impl Entry<'_> {
    /// Name of instance `index`: the entry's own, or with its number if it is one of several.
    pub(super) fn instance_name(&self, index: usize) -> String {
        if self.count == 1 { self.name.to_owned() } else { format!("{}.{index}", self.name) }
    }
}

impl<'a> Names<'a> {
    pub(super) fn resolve(
        config: &'a Config,
        rules: &Rules<'_>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Self {
        let (task, input, variable, block) = (
            Unique { value: "task", remedy: "give each task a name of its own" },
            Unique { value: "input", remedy: "give each input a name of its own" },
            Unique {
                value: "variable",
                remedy: "give each variable a name that no other one and no input has",
            },
            Unique { value: "block", remedy: "give each block a name of its own" },
        );
        task.check(config.tasks.iter().map(|task| task.name.as_ref()), diagnostics);
        let inputs = || config.inputs.iter().map(|input| input.name.as_ref());
        input.check(inputs(), diagnostics);
        let variables = config.variables.iter().map(|variable| variable.name.as_ref());
        variable.check_beside(inputs(), variables, diagnostics);
        let blocks = || config.blocks.iter().map(|block| block.name.as_ref());
        block.check(blocks(), diagnostics);
        let alarm = Unique {
            value: "alarm",
            remedy: "give each alarm a name that no other one and no block has",
        };
        let alarms = config.alarms.iter().map(|alarm| alarm.name.as_ref());
        alarm.check_beside(blocks(), alarms, diagnostics);
        let service = Unique { value: "service", remedy: "give each output a service of its own" };
        service.check(config.outputs.iter().map(|output| output.service.as_ref()), diagnostics);
        let ob = Unique { value: "ob", remedy: "give each task an ob of its own, or none" };
        let signal = Unique { value: "signal", remedy: "name each signal of an output once" };
        for output in &config.outputs {
            signal.check(output.signals.iter().map(Some), diagnostics);
        }
        let obs = config.tasks.iter().map(|task| {
            let number = task.settings.ob?;
            Some(Spanned::new(task.ob_span.clone(), number))
        });
        ob.check(Vec::from_iter(obs).iter().map(Option::as_ref), diagnostics);
        services(config, rules, diagnostics);
        let tasks = Tasks::new(config);
        let mut first = 0;
        let mut entry = |block: &'a BlockEntry, diagnostics: &mut Vec<Diagnostic>| {
            let (name, span) = match &block.name {
                Some(name) => (name.get_ref().as_str(), name.span()),
                None => ("", block.block_type.as_ref().map_or(0..0, Spanned::span)),
            };
            let block_type = block_type(block, rules, diagnostics);
            let task = tasks.resolve(block.task.as_ref(), "block", span.clone(), diagnostics);
            let count = instances(block, first, diagnostics);
            first += count;
            let count_is_known = !block.count_is_wrong;
            Entry { name, span, block_type, task, count, count_is_known, first: first - count }
        };
        let entries: Vec<_> = config.blocks.iter().map(|block| entry(block, diagnostics)).collect();
        let inputs = config.inputs.iter().enumerate().filter_map(|(index, input)| {
            let name = input.name.as_ref()?;
            let task = tasks.resolve(input.task.as_ref(), "input", name.span(), diagnostics);
            let value_type = input.value_type;
            Some((name.get_ref().as_str(), ValueName { index, task, value_type }))
        });
        let inputs = inputs.collect();
        let variables = config.variables.iter().enumerate().filter_map(|(index, variable)| {
            let name = variable.name.as_ref()?;
            let task = tasks.resolve(variable.task.as_ref(), "variable", name.span(), diagnostics);
            let value_type = variable.value_type;
            Some((name.get_ref().as_str(), ValueName { index, task, value_type }))
        });
        let mut names = Self {
            inputs,
            variables: variables.collect(),
            blocks: entries.iter().enumerate().map(|(index, entry)| (entry.name, index)).collect(),
            entries,
            outputs: config
                .outputs
                .iter()
                .map(|output| {
                    let span = output.service.as_ref().map_or(0..0, Spanned::span);
                    tasks.resolve(output.task.as_ref(), "output", span, diagnostics)
                })
                .collect(),
            tasks: config
                .tasks
                .iter()
                .map(|task| TaskName {
                    name: task.name.as_ref().map_or("", |name| name.get_ref()),
                    ob: task.settings.ob,
                    // A period that could not be read stops the plan later; any will do until then.
                    period_ns: task.settings.period_ns.max(1),
                })
                .collect(),
        };
        names.add_alarms(config, &tasks, diagnostics);
        names.add_formulas(config, diagnostics);
        names.add_conditions(config, diagnostics);
        names.ambiguous(config, diagnostics);
        names
    }

    pub(super) fn obs(&self) -> Vec<(i16, u64)> {
        self.tasks.iter().filter_map(|task| Some((task.ob?, task.period_ns))).collect()
    }

    /// The input that a signal is of, and which part: `NAME`, `NAME.ok` or `NAME.age`.
    pub(super) fn input_part(&self, signal: &str) -> Option<(ValueName, InputPart)> {
        InputPart::ALL.into_iter().find_map(|part| {
            let input = self.inputs.get(signal.strip_suffix(part.suffix())?)?;
            Some((*input, part))
        })
    }

    /// Reports blocks with a pin that is called as an input's `ok` or `age` is.
    fn ambiguous(&self, config: &Config, diagnostics: &mut Vec<Diagnostic>) {
        let names = config.inputs.iter().filter_map(|input| input.name.as_ref());
        for name in names {
            let block = self.blocks.get(name.get_ref().as_str());
            let Some(entry) = block.and_then(|block| self.entries.get(*block)) else { continue };
            let Some(block_type) = entry.block_type.filter(|_| entry.count == 1) else { continue };
            let pins = || block_type.signals().map(|(_, pin)| pin);
            let parts = [InputPart::Ok, InputPart::Age].map(InputPart::suffix);
            let taken = parts.into_iter().find(|part| pins().any(|pin| part[1..] == *pin.name));
            if let Some(part) = taken {
                let signal = format!("{}{part}", name.get_ref());
                let what = described(&block_type, entry.name);
                let message =
                    format!("\"{signal}\" would be a signal of this input and a pin of {what}");
                let diagnostic = Diagnostic::new(Problem::Duplicate, name.span(), message)
                    .help("give one of them another name");
                diagnostics.push(Diagnostic { first: Some(entry.span.clone()), ..diagnostic });
            }
        }
    }

    /// The input or the variable of a name.
    pub(super) fn value(&self, name: &str) -> Option<ValueName> {
        self.inputs.get(name).or_else(|| self.variables.get(name)).copied()
    }

    /// Names of the inputs, then of the variables, each in file order.
    pub(super) fn values_in_order(&self) -> Vec<&'a str> {
        let in_order = |names: &HashMap<&'a str, ValueName>| {
            let mut names: Vec<_> = names.iter().map(|(name, of)| (of.index, *name)).collect();
            names.sort_unstable();
            names.into_iter().map(|(_, name)| name)
        };
        in_order(&self.inputs).chain(in_order(&self.variables)).collect()
    }

    /// Number of instances in the file.
    pub(super) fn instances(&self) -> usize {
        self.entries.last().map_or(0, |entry| entry.first + entry.count)
    }

    /// Entry that an instance belongs to.
    pub(super) fn entry_of(&self, instance: usize) -> Option<&Entry<'a>> {
        let next = self.entries.partition_point(|entry| entry.first <= instance);
        self.entries.get(next.checked_sub(1)?)
    }

    /// Name of an instance.
    pub(super) fn instance_name(&self, instance: usize) -> String {
        self.entry_of(instance)
            .map_or_else(String::new, |entry| entry.instance_name(instance - entry.first))
    }
}

/// What services may not be called. Those of the nodes themselves may be read, not written.
fn services(config: &Config, rules: &Rules<'_>, diagnostics: &mut Vec<Diagnostic>) {
    let written = config.outputs.iter().filter_map(|output| output.service.as_ref());
    let (own, written): (Vec<_>, Vec<_>) =
        written.partition(|service| service.get_ref().starts_with(OWN_SERVICES));
    for service in own {
        let name = service.get_ref();
        let message = format!(
            "\"{name}\" cannot be an output's service: names that begin with \"{OWN_SERVICES}\" are \
             for what nodes say of themselves"
        );
        let mut parts = name.trim_start_matches(OWN_SERVICES).rsplit('/');
        let rest = parts.find(|part| !part.is_empty()).unwrap_or("level");
        diagnostics.push(
            Diagnostic::new(Problem::BadName, service.span(), message)
                .help(format!("choose another name, such as \"plant/{rest}\"")),
        );
    }
    let read = config.inputs.iter().filter_map(|input| input.service.as_ref());
    for service in written.into_iter().chain(read) {
        if let Err(reason) = (rules.service_name)(service.get_ref()) {
            let message =
                format!("\"{}\" cannot be the name of a service: {reason}", service.get_ref());
            diagnostics.push(Diagnostic::new(Problem::BadName, service.span(), message));
        }
    }
}

/// The names of the tasks.
pub(super) struct Tasks<'a> {
    names: Vec<&'a str>,
    one_name_is_taken_twice: bool,
}

impl<'a> Tasks<'a> {
    fn new(config: &'a Config) -> Self {
        let name = |task: &'a crate::config::Task| {
            task.name.as_ref().map_or("", |name| name.get_ref().as_str())
        };
        let names: Vec<&str> = config.tasks.iter().map(name).collect();
        let mut seen = HashSet::new();
        let one_name_is_taken_twice =
            names.iter().any(|name| !name.is_empty() && !seen.insert(*name));
        Self { names, one_name_is_taken_twice }
    }

    fn known(&self) -> impl Iterator<Item = &'a str> {
        self.names.iter().copied().filter(|name| !name.is_empty())
    }

    /// The task that is named, or the only one.
    pub(super) fn resolve(
        &self,
        task: Option<&Spanned<String>>,
        of: &str,
        span: Range<usize>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<usize> {
        let Some(task) = task else {
            if self.names.len() > 1 {
                let message = format!("this {of} does not say which task it belongs to");
                // Not all of them: there is a diagnostic for each entry without a task.
                let known: Vec<&str> = self.known().take(12).collect();
                diagnostics.push(
                    Diagnostic::new(Problem::MissingKey, span, message)
                        .help(format!("there are several tasks: {}", known.join(", "))),
                );
            }
            return (self.names.len() == 1).then_some(0);
        };
        let index = self.names.iter().position(|name| name == task.get_ref());
        // Of two tasks of one name, one is probably the task that is missing here.
        if index.is_none() && !self.one_name_is_taken_twice {
            let message = format!("there is no task \"{}\"", task.get_ref());
            diagnostics.push(
                Diagnostic::new(Problem::UnknownTask, task.span(), message)
                    .seek(task.get_ref(), Among::Tasks),
            );
        }
        index
    }
}

/// Number of instances of a block, when there are `before` in the entries before it.
fn instances(block: &BlockEntry, before: usize, diagnostics: &mut Vec<Diagnostic>) -> usize {
    let Some(count) = &block.count else { return 1 };
    let (instances, span) = (*count.get_ref() as usize, count.span());
    if before.saturating_add(instances) <= MAX_INSTANCES {
        return instances;
    }
    let message = format!("count {instances} is too many: {before} instances stand before it");
    diagnostics.push(
        Diagnostic::new(Problem::OutOfRange, span, message)
            .help(format!("a file has at most {MAX_INSTANCES} instances")),
    );
    1
}

fn block_type(
    block: &BlockEntry,
    rules: &Rules<'_>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<BlockType> {
    let written = block.block_type.as_ref()?;
    let found = known_type(written.get_ref(), rules.catalogue);
    if found.is_none() {
        let message = format!("there is no block type \"{}\"", written.get_ref());
        let known = KnownNames::new(rules.catalogue.iter().chain([&EXPR]).map(|known| known.name));
        let mut help = known.suggestion(written.get_ref());
        if known.nearest(written.get_ref()).is_none() {
            help += "; a block of your own needs the program that brings it (examples/own_blocks)";
        }
        diagnostics
            .push(Diagnostic::new(Problem::UnknownBlockType, written.span(), message).help(help));
    }
    found.copied()
}

/// A kind of value that stands once in a file.
struct Unique {
    value: &'static str,
    remedy: &'static str,
}

impl Unique {
    /// Reports every value that stands a second time.
    fn check<'a, T: std::fmt::Display + Eq + std::hash::Hash + 'a>(
        &self,
        values: impl Iterator<Item = Option<&'a Spanned<T>>>,
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        self.check_beside(std::iter::empty(), values, diagnostics);
    }

    /// Reports every value that stands a second time, or that one of another kind has already.
    fn check_beside<'a, T: std::fmt::Display + Eq + std::hash::Hash + 'a>(
        &self,
        others: impl Iterator<Item = Option<&'a Spanned<T>>>,
        values: impl Iterator<Item = Option<&'a Spanned<T>>>,
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        let mut seen: HashMap<_, _> =
            others.flatten().map(|other| (other.get_ref(), other)).collect();
        for value in values.flatten() {
            let first = *seen.entry(value.get_ref()).or_insert(value);
            if !std::ptr::eq(first, value) {
                let message = format!("{} \"{}\" is taken already", self.value, value.get_ref());
                let diagnostic =
                    Diagnostic::new(Problem::Duplicate, value.span(), message).help(self.remedy);
                diagnostics.push(Diagnostic { first: Some(first.span()), ..diagnostic });
            }
        }
    }
}

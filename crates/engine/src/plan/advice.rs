//! Advice on configurations that are allowed but probably not intended: inputs and variables that nothing reads, and
//! wires that are seldom read.

use std::collections::HashSet;

use toml::Spanned;

use super::names::{Entry, Names};
use super::wires::{Origin, Wiring};
use super::{LinkPlan, TaskPlan};
use crate::Diagnostic;
use crate::config::{Config, Input};
use crate::diagnostic::Problem;

impl Wiring {
    /// Warns of inputs and variables that no wire and no frame reads.
    pub(super) fn report_unread(&self, config: &Config, diagnostics: &mut Vec<Diagnostic>) {
        let wires = self.wires.iter().map(|wire| wire.from);
        let signals = self.signals.iter().flatten().map(|signal| signal.from);
        let (mut inputs, mut variables) = (HashSet::new(), HashSet::new());
        for origin in wires.chain(signals) {
            match origin {
                Origin::Input { input, .. } => inputs.insert(input),
                Origin::Variable(variable) => variables.insert(variable),
                Origin::Pin { .. } => false,
            };
        }
        let unread = config.inputs.iter().enumerate().filter(|(index, _)| !inputs.contains(index));
        let unread = unread.filter_map(|(_, input)| Some(("input", input.name.as_ref()?)));
        let of_operators = config.variables.iter().enumerate();
        let of_operators = of_operators.filter(|(index, _)| !variables.contains(index));
        let of_operators = of_operators.filter_map(|(_, it)| Some(("variable", it.name.as_ref()?)));
        for (what, name) in unread.chain(of_operators) {
            let message = format!("nothing reads {what} \"{}\"", name.get_ref());
            diagnostics.push(
                Diagnostic::new(Problem::NoEffect, name.span(), message)
                    .help("wire it to a pin, name it in an output's signals, or leave it out"),
            );
        }
    }

    /// Notes on blocks that read what is wired to them at certain times only.
    pub(super) fn latched(&self, names: &Names<'_>) -> Vec<Diagnostic> {
        let note = |(entry, constants): (&Entry<'_>, &Vec<Option<f64>>)| {
            let block_type = entry.block_type?;
            let pins = block_type.inputs.iter().zip(constants);
            let wired = pins.filter(|(_, constant)| constant.is_none());
            let (wired, latches): (Vec<_>, Vec<_>) =
                wired.filter_map(|(pin, _)| Some((pin.name, pin.latched_by?))).unzip();
            let latch = latches.first()?;
            let message = format!(
                "block \"{}\" ({}) reads what is wired to {} in its first call and while {latch} is \
                 TRUE, at no other time",
                entry.name,
                block_type.name,
                wired.join(", "),
            );
            let help = format!(
                "set {latch} for a cycle when the value has come; until its first sample an input \
                 reads its default"
            );
            Some(Diagnostic::new(Problem::Latched, entry.span.clone(), message).help(help))
        };
        names.entries.iter().zip(&self.constants).filter_map(note).collect()
    }
}

/// Notes which inputs would keep the last value of a publisher that died. Those without a service are
/// run by `simulate` alone, or by a program that sets them.
pub(super) fn without_max_age(config: &Config) -> Option<Diagnostic> {
    let inputs = config.inputs.iter().filter(|i| i.service.is_some() && i.max_age_ns.is_none());
    let (names, is_one, span) = named(inputs)?;
    let verb = if is_one { "runs" } else { "run" };
    let message =
        format!("{names} {verb} without max_age: nobody would notice that the publisher died");
    let help = "write max_age = \"20ms\" or what its values are good for";
    Some(Diagnostic::new(Problem::NoMaxAge, span, message).help(help))
}

/// Notes which inputs no service gives their values.
pub(super) fn without_service(config: &Config) -> Option<Diagnostic> {
    let inputs = config.inputs.iter().filter(|input| input.service.is_none());
    let (names, is_one, span) = named(inputs)?;
    let verb = if is_one { "has" } else { "have" };
    let message = format!(
        "{names} {verb} no service: `simulate` takes that, and a program that gives the values; `run` does not"
    );
    let help = "write service = \"…\", or make a [[variable]] of a value that operators give";
    Some(Diagnostic::new(Problem::NoService, span, message).help(help))
}

/// The names of some inputs for a message, whether it is one, and where the first stands.
fn named<'a>(
    inputs: impl Iterator<Item = &'a Input>,
) -> Option<(String, bool, std::ops::Range<usize>)> {
    const SHOWN: usize = 3;
    let names: Vec<&Spanned<String>> = inputs.filter_map(|input| input.name.as_ref()).collect();
    let shown: Vec<_> = names.iter().take(SHOWN).map(|n| format!("\"{}\"", n.get_ref())).collect();
    let noun = if names.len() == 1 { "input" } else { "inputs" };
    let more = match names.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    Some((format!("{noun} {}{more}", shown.join(", ")), names.len() == 1, names.first()?.span()))
}

/// Warns of inputs that say `feedback = true` and that no output depends on.
pub(super) fn feedback_without_effect(
    config: &Config,
    tasks: &[TaskPlan],
    links: &[LinkPlan],
    diagnostics: &mut Vec<Diagnostic>,
) {
    let exported = links.iter().flat_map(|link| link.upstream.iter().map(|it| (link.from, it)));
    let published = tasks.iter().enumerate();
    let published =
        published.flat_map(|(t, task)| task.outputs.iter().map(move |o| (t, &o.upstream)));
    let handed_on: HashSet<(usize, usize)> = exported
        .chain(published)
        .flat_map(|(task, upstream)| upstream.sources.iter().map(move |source| (task, *source)))
        .collect();
    for (task, plan) in tasks.iter().enumerate() {
        let useless = plan
            .inputs
            .iter()
            .enumerate()
            .filter(|(index, input)| input.feedback && !handed_on.contains(&(task, *index)));
        for (_, input) in useless {
            let written = config
                .inputs
                .iter()
                .find(|it| it.name.as_ref().is_some_and(|name| *name.get_ref() == input.name));
            let span = written.and_then(|it| Some(it.feedback.as_ref()?.span()));
            let message = format!(
                "feedback of input \"{}\" has no effect: no output is computed from it",
                input.name
            );
            diagnostics.push(
                Diagnostic::new(
                    Problem::NoEffect,
                    span.unwrap_or_else(|| input.span.clone()),
                    message,
                )
                .help("leave it out; it is for an input that closes a loop of nodes"),
            );
        }
    }
}

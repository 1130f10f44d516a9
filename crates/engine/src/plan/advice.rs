//! Advice on configurations that are allowed but probably not intended: inputs that nothing reads, and wires that are
//! seldom read.

use std::collections::HashSet;

use super::names::{Entry, Names};
use super::wires::{Origin, Wiring};
use super::{LinkPlan, TaskPlan};
use crate::Diagnostic;
use crate::config::Config;
use crate::diagnostic::Problem;

impl Wiring {
    /// Warns of inputs that no wire and no frame reads.
    pub(super) fn report_unread(&self, config: &Config, diagnostics: &mut Vec<Diagnostic>) {
        let wires = self.wires.iter().map(|wire| wire.from);
        let signals = self.signals.iter().flatten().map(|signal| signal.from);
        let read: HashSet<usize> = wires
            .chain(signals)
            .filter_map(|origin| match origin {
                Origin::Input { input, .. } => Some(input),
                Origin::Pin { .. } => None,
            })
            .collect();
        let unread = config.inputs.iter().enumerate().filter(|(index, _)| !read.contains(index));
        for name in unread.filter_map(|(_, input)| input.name.as_ref()) {
            let message = format!("nothing reads input \"{}\"", name.get_ref());
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
    const SHOWN: usize = 3;
    let inputs = config.inputs.iter().filter(|i| i.service.is_some() && i.max_age_ns.is_none());
    let names: Vec<_> = inputs.filter_map(|input| input.name.as_ref()).collect();
    let shown: Vec<_> = names.iter().take(SHOWN).map(|n| format!("\"{}\"", n.get_ref())).collect();
    let noun = if names.len() == 1 { "input" } else { "inputs" };
    let verb = if names.len() == 1 { "runs" } else { "run" };
    let more = match names.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let (shown, first) = (shown.join(", "), names.first()?.span());
    let message = format!(
        "{noun} {shown}{more} {verb} without max_age: nobody would notice that the publisher died"
    );
    let help = "write max_age = \"20ms\" or what its values are good for";
    Some(Diagnostic::new(Problem::NoMaxAge, first, message).help(help))
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

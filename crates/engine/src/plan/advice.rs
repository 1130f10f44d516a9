//! What is allowed and hardly meant: inputs that nothing reads, and wires that are seldom read.

use std::collections::HashSet;

use super::names::{Entry, Names};
use super::wires::{Origin, Wiring};
use crate::Finding;
use crate::config::Config;
use crate::finding::Problem;

impl Wiring {
    /// Warns of inputs that no wire and no frame reads.
    pub(super) fn report_unread(&self, config: &Config, findings: &mut Vec<Finding>) {
        let wires = self.wires.iter().map(|wire| wire.from);
        let signals = self.signals.iter().flatten().map(|signal| signal.from);
        let read: HashSet<usize> = wires
            .chain(signals)
            .filter_map(|origin| match origin {
                Origin::Input(input) => Some(input),
                Origin::Pin { .. } => None,
            })
            .collect();
        let unread = config.inputs.iter().enumerate().filter(|(index, _)| !read.contains(index));
        for name in unread.filter_map(|(_, input)| input.name.as_ref()) {
            let message = format!("nothing reads input \"{}\"", name.get_ref());
            findings.push(
                Finding::new(Problem::NoEffect, name.span(), message)
                    .help("wire it to a pin, name it in an output's signals, or leave it out"),
            );
        }
    }

    /// Notes on blocks that read what is wired to them at certain times only.
    pub(super) fn latched(&self, names: &Names<'_>) -> Vec<Finding> {
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
            Some(Finding::new(Problem::Latched, entry.span.clone(), message).help(help))
        };
        names.entries.iter().zip(&self.constants).filter_map(note).collect()
    }
}

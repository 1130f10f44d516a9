//! `[[input]]`: values that other processes publish.

use isochrone_blocks::PinType;
use toml::Spanned;

use super::section::Section;
use crate::Diagnostic;
use crate::config::{Bad, Binding, Input, OnStale};
use crate::diagnostic::Problem;
use crate::keys::{input as keys, on_stale};

pub(super) fn input(section: Section<'_>) -> Input {
    let value_type = section.value_type(&keys::TYPE);
    Input {
        name: section.name(&keys::NAME),
        value_type,
        service: section.string(&keys::SERVICE),
        binding: binding(&section),
        task: section.string(&keys::TASK),
        default: section.value(&keys::DEFAULT, value_type),
        range: section.range(&keys::RANGE, value_type).map(Spanned::into_inner),
        finite: finite(&section, value_type),
        max_age_ns: section.duration_ns(&keys::MAX_AGE).map(Spanned::into_inner),
        on_stale: on_stale_of(&section, value_type),
        bad: section.choice(&keys::BAD, &Bad::ALL).map_or(Bad::Ignore, Spanned::into_inner),
        feedback: section.truth(&keys::FEEDBACK),
        unit: section.unit(&keys::UNIT, value_type),
        comment: section.comment(&keys::COMMENT),
    }
}

/// Whether it takes finite samples alone. An INT, BOOL or TIME is never another.
fn finite(section: &Section<'_>, value_type: Option<PinType>) -> bool {
    let Some(finite) = section.truth(&keys::FINITE) else { return true };
    let conflict = match value_type {
        Some(PinType::Lreal) | None => {
            let is_bounded = !finite.get_ref() && section.get(&keys::RANGE).is_some();
            is_bounded.then_some((
                "both range and finite = false".to_owned(),
                "NaN lies in no range; keep one of them",
            ))
        }
        Some(other) => Some((
            format!("finite, which is not for {other}"),
            "only an LREAL can be NaN or infinite; leave finite out",
        )),
    };
    if let Some((has, help)) = conflict {
        let message = format!("[[input]] has {has}");
        section.report(Diagnostic::new(Problem::Conflict, finite.span(), message).help(help));
    }
    finite.into_inner()
}

/// What a stale input reads: a word, or a ramp, which needs values between others.
fn on_stale_of(section: &Section<'_>, value_type: Option<PinType>) -> OnStale {
    let written = section.get(&keys::ON_STALE);
    let Some(table) = written.filter(|value| value.get_ref().as_table().is_some()) else {
        let chosen = section.choice(&keys::ON_STALE, &OnStale::WORDS);
        return chosen.map_or(OnStale::Hold, Spanned::into_inner);
    };
    let ramp = section.table(&keys::ON_STALE, &on_stale::TABLE);
    let rate = ramp.and_then(|ramp| ramp.number(&on_stale::RAMP));
    if let Some(value_type) = value_type.filter(|value_type| *value_type != PinType::Lreal) {
        let message = format!("[[input]] on_stale cannot be a ramp for {value_type}");
        let help = "only an LREAL goes from one value to another in steps; write on_stale = \"default\" \
                    or \"hold\"";
        section.report(Diagnostic::new(Problem::Conflict, table.span(), message).help(help));
    }
    rate.map_or(OnStale::Hold, |rate| OnStale::Ramp(rate.into_inner()))
}

/// Where an input's value is: `signal` or `channel`; neither is the first channel.
fn binding(section: &Section<'_>) -> Binding {
    let channel = section.integer::<u16>(&keys::CHANNEL);
    let signal = section.string(&keys::SIGNAL);
    if let (Some(_), Some(signal)) = (section.get(&keys::CHANNEL), &signal) {
        let message = "[[input]] has both signal and channel";
        let help = "signal finds the value by the name that its publisher gives it, channel by its \
                    place in the frame; keep one";
        section.report(Diagnostic::new(Problem::Conflict, signal.span(), message).help(help));
    }
    match signal {
        Some(signal) if signal.get_ref().is_empty() => {
            let message = "[[input]] signal is empty";
            let help = "name a signal of the publisher, such as \"level.y\"";
            section.report(Diagnostic::new(Problem::OutOfRange, signal.span(), message).help(help));
            Binding::Signal(String::new())
        }
        Some(signal) => Binding::Signal(signal.into_inner()),
        None => Binding::Channel(channel.map_or(0, |channel| usize::from(channel.into_inner()))),
    }
}

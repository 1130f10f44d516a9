//! Process alarms: each is an instance behind the blocks of the file, which wires lead to and from. A comparison is one
//! of [`ALARM`], any other condition one of a type of its own.

use std::collections::HashMap;
use std::sync::{LazyLock, Mutex, PoisonError};

use isochrone_blocks::expr::{Operand, Program, SignalComparison};
use isochrone_blocks::{ALARM, BlockType, PinType, condition};
use toml::Spanned;

use super::InputPart;
use super::names::{Entry, Names, Tasks};
use super::wires::{Origin, PREVIOUS, Reader, Resolver, Wire, has_no_previous};
use crate::Diagnostic;
use crate::config::{self, Config};
use crate::diagnostic::Problem;

/// The inputs of [`ALARM`], in the order in which it declares them.
#[derive(Clone, Copy)]
enum Pin {
    A,
    B,
    AOk,
    BOk,
    Above,
    Equal,
    Below,
    Hysteresis,
    Delay,
}

impl<'a> Names<'a> {
    /// Adds the alarms to the blocks, each in the task that it names or that has its first signal.
    pub(super) fn add_alarms(
        &mut self,
        config: &'a Config,
        tasks: &Tasks<'_>,
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        let first_entry = self.entries.len();
        let mut open = Vec::new();
        for (index, alarm) in config.alarms.iter().enumerate() {
            let (name, span) = match &alarm.name {
                Some(name) => (name.get_ref().as_str(), name.span()),
                None => ("", 0..0),
            };
            let is_open = alarm.task.is_none() && config.tasks.len() > 1;
            let task = match &alarm.task {
                _ if is_open => None,
                task => tasks.resolve(task.as_ref(), "alarm", span.clone(), diagnostics),
            };
            open.extend(is_open.then_some(index));
            self.blocks.insert(name, self.entries.len());
            self.entries.push(Entry {
                name,
                span,
                block_type: Some(ALARM),
                task,
                count: 1,
                count_is_known: true,
                first: self.instances(),
            });
        }
        // An alarm may be about an alarm, whose task may be open too.
        let mut before = usize::MAX;
        while open.len() < before {
            before = open.len();
            open.retain(|index| {
                let signal = config.alarms.get(*index).and_then(first_signal);
                let task = signal.and_then(|signal| self.task_of(signal.get_ref()));
                if let Some(entry) = self.entries.get_mut(first_entry + index) {
                    entry.task = task;
                }
                task.is_none()
            });
        }
        // Of the others, the signal does not exist, which is another mistake.
        let of_alarm = |signal: &Spanned<String>| {
            let signal = signal.get_ref();
            let is_output = |(_, pin): (&str, &str)| ALARM.outputs.iter().any(|it| it.name == pin);
            let is_alarm = |entry: &Entry<'_>| entry.block_type.is_some_and(|it| it.is_alarm());
            signal.split_once('.').is_some_and(is_output)
                && self.entry_named(signal).is_some_and(is_alarm)
        };
        for alarm in open.iter().filter_map(|index| config.alarms.get(*index)) {
            if first_signal(alarm).is_some_and(of_alarm) {
                let span = alarm.name.as_ref().map_or(0..0, Spanned::span);
                tasks.resolve(None, "alarm", span, diagnostics);
            }
        }
    }

    /// Checks the conditions of the alarms, and gives each that is no comparison the type that evaluates it.
    pub(super) fn add_conditions(&mut self, config: &Config, diagnostics: &mut Vec<Diagnostic>) {
        for (index, alarm) in config.alarms.iter().enumerate() {
            let Some(when) = &alarm.when else { continue };
            let (Some(expression), Some(text)) = (&when.expression, &when.text) else { continue };
            let types = when.names.iter().map(|name| self.type_of(name.get_ref()));
            // What does not exist is another mistake.
            let Some(types) = types.collect::<Option<Vec<_>>>() else { continue };
            match expression.condition(&types) {
                Err(mistake) => diagnostics.push(text.diagnostic(when.name.get_ref(), mistake)),
                Ok(_) if expression.comparison().is_some() => {}
                Ok(program) => {
                    if let Some(entry) = self.entries.get_mut(config.blocks.len() + index) {
                        entry.block_type = Some(interned(when, types, program));
                    }
                }
            }
        }
    }

    /// The task of a signal.
    fn task_of(&self, signal: &str) -> Option<usize> {
        let signal = signal.strip_suffix(PREVIOUS).unwrap_or(signal);
        if let Some((input, _)) = self.input_part(signal) {
            return input.task;
        }
        match self.variables.get(signal) {
            Some(variable) => variable.task,
            None => self.entry_named(signal)?.task,
        }
    }

    /// The entry that a signal is of.
    fn entry_named(&self, signal: &str) -> Option<&Entry<'a>> {
        let name = signal.split_once('.').map_or(signal, |(name, _)| name);
        self.entries.get(*self.blocks.get(name)?)
    }
}

/// The signal that an alarm's condition names first.
fn first_signal(alarm: &config::AlarmSection) -> Option<&Spanned<String>> {
    alarm.when.as_ref()?.names.first()
}

/// The type of an alarm whose condition is no comparison. It stays for the life of the process, as that of an `Expr`.
fn interned(when: &config::Formula, types: Vec<PinType>, program: Program) -> BlockType {
    /// By the text, and the types of what it reads.
    type Types = HashMap<(String, Vec<PinType>), BlockType>;
    static TYPES: LazyLock<Mutex<Types>> = LazyLock::new(Mutex::default);
    let text = when.text.as_ref().map_or("", |text| text.as_str()).trim().to_owned();
    let mut known = TYPES.lock().unwrap_or_else(PoisonError::into_inner);
    *known.entry((text, types)).or_insert_with_key(|(_, types)| {
        let inputs = condition::inputs(types).leak();
        condition::alarm_of(inputs, Box::leak(Box::new(program)))
    })
}

impl Resolver<'_, '_> {
    /// The wires of an alarm, and its other input pins.
    pub(super) fn alarm(
        &mut self,
        alarm: &config::AlarmSection,
        entry: &Entry<'_>,
        wires: &mut Vec<Wire>,
    ) -> Vec<Option<f64>> {
        let block_type = entry.block_type.unwrap_or(ALARM);
        let defaults = block_type.inputs.iter().map(|pin| pin.default.slot().unwrap_or_default());
        let mut pins: Vec<_> = defaults.map(Some).collect();
        let written = alarm.when.as_ref();
        let Some((when, expression)) = written.and_then(|it| Some((it, it.expression.as_ref()?)))
        else {
            return pins;
        };
        let period_ns = entry.task.and_then(|task| self.names.tasks.get(task));
        let period_ns = period_ns.map_or(1, |task| task.period_ns);
        let delay = alarm.delay_ns.div_ceil(period_ns) as f64;
        let mut set = |pin: usize, value: Option<f64>| {
            if let Some(slot) = pins.get_mut(pin) {
                *slot = value;
            }
        };
        let comparison = expression.comparison();
        // Of each signal its place among the names, and the pins of its value and of whether that can be believed.
        let mut leads = Vec::new();
        if let Some(SignalComparison { left, right, holds, .. }) = comparison {
            let back = if holds[0] { -alarm.hysteresis } else { alarm.hysteresis };
            let [above, equal, below] = holds.map(|holds| f64::from(u8::from(holds)));
            let constants = [
                (Pin::Above, above),
                (Pin::Equal, equal),
                (Pin::Below, below),
                (Pin::Hysteresis, back),
                (Pin::Delay, delay),
            ];
            constants.into_iter().for_each(|(pin, value)| set(pin as usize, Some(value)));
            leads.push([left, Pin::A as usize, Pin::AOk as usize]);
            match right {
                Operand::Name(right) => leads.push([right, Pin::B as usize, Pin::BOk as usize]),
                Operand::Literal(value) => set(Pin::B as usize, Some(value)),
            }
        } else {
            let signals = when.names.len();
            leads.extend((0..signals).map(|name| [name, name, signals + name]));
            set(2 * signals, Some(delay));
        }
        let has_pins = comparison.is_some() || !block_type.reads_in_place();
        for [name, value, ok] in leads {
            let Some(signal) = when.names.get(name) else { continue };
            let Some(mut source) = self.source(signal).filter(|_| has_pins) else { continue };
            // A condition that asks itself whether an input can be believed knows what to do where it cannot.
            let asked = format!("{}{}", signal.get_ref(), InputPart::Ok.suffix());
            if when.names.iter().any(|it| *it.get_ref() == asked) {
                source.ok = None;
            }
            let to_pins = std::iter::once((source.origin, value));
            for (from, to_pin) in to_pins.chain(source.ok.map(|from| (from, ok))) {
                set(to_pin, None);
                wires.push(Wire {
                    from,
                    to_instance: entry.first,
                    to_pin,
                    previous: source.previous,
                    span: source.span.clone(),
                });
            }
        }
        pins
    }

    /// Where the value of a signal in a condition comes from.
    fn source(&mut self, signal: &Spanned<String>) -> Option<Source> {
        let (text, span) = (signal.get_ref().as_str(), signal.span());
        let (name, previous) = match text.strip_suffix(PREVIOUS) {
            Some(name) => (name, true),
            None => (text, false),
        };
        let (origin, _) = self.origin(name, span.clone(), Reader::Output)?;
        let what = match origin {
            Origin::Input { .. } => "an input",
            Origin::Variable(_) => "a variable",
            Origin::Pin { .. } => "",
        };
        if previous && !what.is_empty() {
            let message = has_no_previous(name, what);
            let diagnostic = Diagnostic::new(Problem::UnknownSource, span, message);
            self.report(diagnostic.help(format!("write \"{name}\"")));
            return None;
        }
        let ok = match origin {
            Origin::Input { input, part: InputPart::Value } => {
                Some(Origin::Input { input, part: InputPart::Ok })
            }
            _ => None,
        };
        Some(Source { origin, ok, previous, span })
    }
}

/// Where the value of a signal in a condition comes from.
struct Source {
    origin: Origin,
    /// Whether it can be believed, where something says so.
    ok: Option<Origin>,
    previous: bool,
    span: std::ops::Range<usize>,
}

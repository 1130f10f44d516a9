//! Process alarms: each is an instance of [`ALARM`] behind the blocks of the file, which wires lead to and from.

use isochrone_blocks::{ALARM, PinType};
use toml::Spanned;

use super::InputPart;
use super::names::{Entry, Names, Tasks};
use super::wires::{Origin, PREVIOUS, Reader, Resolver, Wire, has_no_previous};
use crate::Diagnostic;
use crate::config::{self, AlarmCondition, AlarmOperand, Config};
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
                let when = config.alarms.get(*index).and_then(|alarm| alarm.when.as_ref());
                let task = when.and_then(|when| self.task_of(when.first_signal().get_ref()));
                if let Some(entry) = self.entries.get_mut(first_entry + index) {
                    entry.task = task;
                }
                task.is_none()
            });
        }
        // Of the others, the signal does not exist, which is another mistake.
        let of_alarm = |when: &AlarmCondition| {
            let signal = when.first_signal().get_ref();
            let is_output = |(_, pin): (&str, &str)| ALARM.outputs.iter().any(|it| it.name == pin);
            let is_alarm = |entry: &Entry<'_>| entry.block_type.is_some_and(|it| it.is_alarm());
            signal.split_once('.').is_some_and(is_output)
                && self.entry_named(signal).is_some_and(is_alarm)
        };
        for alarm in open.iter().filter_map(|index| config.alarms.get(*index)) {
            if alarm.when.as_ref().is_some_and(of_alarm) {
                let span = alarm.name.as_ref().map_or(0..0, Spanned::span);
                tasks.resolve(None, "alarm", span, diagnostics);
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

impl Resolver<'_, '_> {
    /// The wires of an alarm, and its other input pins.
    pub(super) fn alarm(
        &mut self,
        alarm: &config::AlarmSection,
        entry: &Entry<'_>,
        wires: &mut Vec<Wire>,
    ) -> Vec<Option<f64>> {
        let mut pins: Vec<Option<f64>> =
            ALARM.inputs.iter().map(|pin| Some(pin.default.slot().unwrap_or_default())).collect();
        let mut set = |pin: Pin, value: Option<f64>| {
            if let Some(slot) = pins.get_mut(pin as usize) {
                *slot = value;
            }
        };
        let Some(when) = &alarm.when else { return pins };
        let period_ns = entry.task.and_then(|task| self.names.tasks.get(task));
        let period_ns = period_ns.map_or(1, |task| task.period_ns);
        set(Pin::Delay, Some(alarm.delay_ns.div_ceil(period_ns) as f64));
        let first = when.first_signal();
        let Some((left, left_type)) = self.operand(first) else { return pins };
        let mut lead = |from: Source, pin: Pin, ok: Pin| {
            let of_pins = std::iter::once((from.origin, pin)).chain(from.ok.map(|from| (from, ok)));
            for (from_origin, to_pin) in of_pins {
                set(to_pin, None);
                wires.push(Wire {
                    from: from_origin,
                    to_instance: entry.first,
                    to_pin: to_pin as usize,
                    previous: from.previous,
                    span: from.span.clone(),
                });
            }
        };
        lead(left, Pin::A, Pin::AOk);
        let truth = |condition: bool| Some(f64::from(u8::from(condition)));
        let holds = match when {
            AlarmCondition::Is { signal, value } => {
                if left_type != PinType::Bool {
                    let name = signal.get_ref();
                    let message = format!("\"{name}\" is {left_type}, and no condition by itself");
                    let help = format!("compare it: {name} > 1.0");
                    let diagnostic = Diagnostic::new(Problem::TypeMismatch, signal.span(), message);
                    self.report(diagnostic.help(help));
                }
                // Between FALSE and TRUE.
                set(Pin::B, Some(0.5));
                [*value, false, !*value]
            }
            AlarmCondition::Comparison { left, relation, right } => {
                let right_type = match right.get_ref() {
                    AlarmOperand::Number(_) => None,
                    AlarmOperand::Time(_) => Some(PinType::Time),
                    AlarmOperand::Bool(_) => Some(PinType::Bool),
                    AlarmOperand::Signal(name) => {
                        let name = Spanned::new(right.span(), name.clone());
                        let Some((source, right_type)) = self.operand(&name) else { return pins };
                        lead(source, Pin::B, Pin::BOk);
                        Some(right_type)
                    }
                };
                let constant = match right.get_ref() {
                    AlarmOperand::Signal(_) => None,
                    AlarmOperand::Number(number) => Some(*number),
                    AlarmOperand::Time(ms) => Some(f64::from(*ms)),
                    AlarmOperand::Bool(value) => truth(*value),
                };
                if constant.is_some() {
                    set(Pin::B, constant);
                }
                let relation = *relation.get_ref();
                if let Err((message, help)) = comparable(left.get_ref(), left_type, right_type) {
                    let diagnostic = Diagnostic::new(Problem::TypeMismatch, right.span(), message);
                    self.report(diagnostic.help(help));
                } else if left_type == PinType::Bool && relation.is_ordering() {
                    let message = format!("BOOL signals are not compared by {relation}");
                    let diagnostic = Diagnostic::new(Problem::TypeMismatch, left.span(), message);
                    self.report(diagnostic.help("of two BOOL signals one is = or <> the other"));
                }
                let back = if relation.holds()[0] { -alarm.hysteresis } else { alarm.hysteresis };
                set(Pin::Hysteresis, Some(back));
                relation.holds()
            }
        };
        for (pin, holds) in [Pin::Above, Pin::Equal, Pin::Below].into_iter().zip(holds) {
            set(pin, truth(holds));
        }
        pins
    }

    /// Where the value of a signal in a condition comes from, and its type.
    fn operand(&mut self, signal: &Spanned<String>) -> Option<(Source, PinType)> {
        let (text, span) = (signal.get_ref().as_str(), signal.span());
        let (name, previous) = match text.strip_suffix(PREVIOUS) {
            Some(name) => (name, true),
            None => (text, false),
        };
        let (origin, value_type) = self.origin(name, span.clone(), Reader::Output)?;
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
        Some((Source { origin, ok, previous, span }, value_type))
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

/// Whether a signal of a type can be compared with another type; `None`: a number. INT and LREAL are both numbers,
/// nothing else becomes another type by itself.
fn comparable(
    name: &str,
    left: PinType,
    right: Option<PinType>,
) -> Result<(), (String, &'static str)> {
    let is_number = |of: PinType| matches!(of, PinType::Lreal | PinType::Int);
    let (fits, with) = match right {
        None => (is_number(left) || left == PinType::Word, "a number".to_owned()),
        Some(right) => {
            (left == right || is_number(left) && is_number(right), right.as_str().to_owned())
        }
    };
    let help = match left {
        PinType::Bool => "a BOOL is a condition by itself, with = or <> another BOOL",
        PinType::Time => "compare with a time such as T#2s",
        PinType::Word => "compare with a number such as 16#8200",
        PinType::Lreal | PinType::Int => "compare with a number, or with a signal that is one",
    };
    let message = || format!("\"{name}\" is {left} and is not compared with {with}");
    if fits { Ok(()) } else { Err((message(), help)) }
}

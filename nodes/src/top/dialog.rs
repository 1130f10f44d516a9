//! Questions that are answered with the keyboard before an order goes to the node.

use isochrone_blocks::PinType;
use isochrone_engine::parse_seconds;
use isochrone_runtime::control::{Hold, SignalDescription, Value};

use super::news::Order;
use crate::numbers::type_of;
use crate::operate::{CALLING_TASK, Written, shown};

/// What stands over the list.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Dialog {
    Help,
    /// A message of the node, and the first line of it that is shown.
    Message {
        title: String,
        text: String,
        first: usize,
    },
    Question(Question),
}

/// A question.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Question {
    pub(super) asks: Asks,
    /// What was typed so far.
    pub(super) input: String,
    /// Of a confirmation: the value that the signal has.
    pub(super) before: Option<String>,
    /// Why the last answer is none.
    pub(super) error: Option<String>,
}

/// What a question is about.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Asks {
    NewValue(Target),
    ForcedValue(Target),
    ForceTime(Target, Value),
    /// With what this screen set last, in words.
    Transaction(Option<(u64, String)>),
    /// Whether it shall be done.
    Confirm(Order),
    /// Why it shall be done, and the value that the signal has.
    Comment(Order, Option<String>),
}

/// The signal of a question.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Target {
    pub(super) name: String,
    pub(super) value_type: String,
    pub(super) unit: Option<String>,
    pub(super) can_be_unset: bool,
    /// When the question was asked.
    pub(super) value: Option<Value>,
}

/// What an answer leads to.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Next {
    Ask(Question),
    Send(Order),
}

/// What holds a force until it is released.
const HOLD: &str = "hold";

impl Question {
    pub(super) fn new(asks: Asks) -> Self {
        Self { asks, input: String::new(), before: None, error: None }
    }

    /// What the answer may be.
    pub(super) fn help(&self) -> String {
        match &self.asks {
            Asks::NewValue(target) | Asks::ForcedValue(target) => {
                match type_of(&target.value_type) {
                    PinType::Bool => "true or false".into(),
                    PinType::Int if target.can_be_unset => {
                        format!("a whole number from -32768 to 32767, or {CALLING_TASK}")
                    }
                    PinType::Int => "a whole number from -32768 to 32767".into(),
                    PinType::Time => {
                        "a time, such as 100ms or T#1s500ms; a number alone is in milliseconds"
                            .into()
                    }
                    PinType::Word => "a whole number from 0 to 65535, or 16#8F00".into(),
                    PinType::Lreal => "a number, such as 0.5 or 1e3".into(),
                }
            }
            Asks::ForceTime(..) => {
                format!("a time, such as 30 (seconds) or 5min; \"{HOLD}\": until it is released")
            }
            Asks::Transaction(Some((number, what))) => {
                format!("#{number} {what}; `isochrone journal` lists others")
            }
            Asks::Transaction(None) => "the number of a set; `isochrone journal` lists them".into(),
            Asks::Confirm(_) => String::new(),
            Asks::Comment(..) => "for the journal, such as: sensor 3 calibrated".into(),
        }
    }

    /// Asks for the reason first, where the node keeps one.
    pub(super) fn for_comment(self) -> Self {
        match &self.asks {
            Asks::Confirm(order) if order.clone().comment_mut().is_some() => {
                let input = order.comment().unwrap_or_default().to_owned();
                let asks = Asks::Comment(order.clone(), self.before);
                Self { input, ..Self::new(asks) }
            }
            _ => self,
        }
    }

    /// Takes what was typed.
    pub(super) fn answer(self) -> Next {
        let answered = self.read();
        match answered {
            Ok(next) => next,
            Err(error) => Next::Ask(Self { error: Some(error), ..self }),
        }
    }

    fn read(&self) -> Result<Next, String> {
        let confirm = |order, target: Option<&Target>| {
            let before = target.filter(|it| it.value.is_some()).map(Target::now);
            Next::Ask(Self { before, ..Self::new(Asks::Confirm(order)) })
        };
        Ok(match &self.asks {
            Asks::NewValue(target) => {
                let value = target.read(&self.input)?;
                let to = target.shown(value);
                let (name, comment) = (target.name.clone(), None);
                confirm(Order::Set { name, value, to, comment }, Some(target))
            }
            Asks::ForcedValue(target) => {
                let value = target.read(&self.input)?;
                Next::Ask(Self::new(Asks::ForceTime(target.clone(), value)))
            }
            Asks::ForceTime(target, value) => {
                let hold = hold(&self.input)?;
                let (name, to) = (target.name.clone(), target.shown(*value));
                let (value, comment) = (*value, None);
                confirm(Order::Force { name, value, to, hold, comment }, Some(target))
            }
            Asks::Transaction(last) => {
                let transaction = self.input.trim().parse();
                let transaction = transaction.map_err(|_| "give the number of a transaction")?;
                let last = last.as_ref().filter(|(number, _)| *number == transaction);
                let what = last.map(|(_, what)| what.clone());
                confirm(Order::Undo { transaction, what }, None)
            }
            Asks::Confirm(order) => Next::Send(order.clone()),
            Asks::Comment(order, before) => {
                let (mut order, before) = (order.clone(), before.clone());
                if let Some(comment) = order.comment_mut() {
                    let text = self.input.trim();
                    *comment = (!text.is_empty()).then(|| text.to_owned());
                }
                Next::Ask(Self { before, ..Self::new(Asks::Confirm(order)) })
            }
        })
    }
}

impl Target {
    pub(super) fn new(signal: &SignalDescription, value: Option<Value>) -> Self {
        let SignalDescription { name, value_type, unit, can_be_unset, .. } = signal.clone();
        Self { name, value_type, unit, can_be_unset, value }
    }

    /// The value that was typed.
    fn read(&self, text: &str) -> Result<Value, String> {
        Written::read(text.trim())?.of(type_of(&self.value_type), self.unit.as_deref())
    }

    /// A value of its type, with its unit.
    pub(super) fn shown(&self, value: Value) -> String {
        let value_type = type_of(&self.value_type);
        let value = shown(value, value_type);
        match self.unit.as_deref() {
            // A time is written with its unit.
            Some(unit) if value_type != PinType::Time && !unit.is_empty() => {
                format!("{value} {unit}")
            }
            _ => value,
        }
    }

    /// The value that it had.
    pub(super) fn now(&self) -> String {
        self.value.map_or("-".into(), |value| self.shown(value))
    }
}

fn hold(text: &str) -> Result<Hold, String> {
    if text.trim().eq_ignore_ascii_case(HOLD) {
        return Ok(Hold::UntilReleased);
    }
    parse_seconds(text.trim()).map(Hold::Seconds).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use isochrone_runtime::control::Role;

    use super::*;
    use crate::top::fixtures::signal;

    fn target(value_type: &str) -> Target {
        Target::new(&signal("ramp.setChangeRate", Role::Parameter, value_type), None)
    }

    fn answered(asks: Asks, input: &str) -> Next {
        Question { input: input.into(), ..Question::new(asks) }.answer()
    }

    fn confirmed(next: Next) -> Order {
        let Next::Ask(question) = next else { panic!("{next:?}") };
        match question.answer() {
            Next::Send(order) => order,
            next => panic!("{next:?}"),
        }
    }

    #[test]
    fn a_value_is_confirmed_before_it_is_sent() {
        let next = answered(Asks::NewValue(target("LREAL")), " 7.5 ");
        let (name, to) = ("ramp.setChangeRate".into(), "7.5 m/s".into());
        let set = Order::Set { name, value: Value::Number(7.5), to, comment: None };
        assert_eq!(confirmed(next), set);
    }

    #[test]
    fn a_pin_that_can_be_without_a_value_says_how_it_gets_there() {
        let signal = signal("ramp.callOB", Role::Parameter, "INT");
        let asks = |can_be_unset| {
            let signal = SignalDescription { can_be_unset, ..signal.clone() };
            Asks::NewValue(Target::new(&signal, Some(Value::Integer(35))))
        };
        assert!(!Question::new(asks(false)).help().contains("calling task"));
        assert!(Question::new(asks(true)).help().ends_with("or calling task"));
        let Order::Set { value, to, .. } = confirmed(answered(asks(true), "calling task")) else {
            panic!("a value is set")
        };
        assert!(matches!(value, Value::Number(value) if value.is_nan()), "{value}");
        assert_eq!(to, "calling task");
    }

    #[test]
    fn a_force_has_a_value_a_time_and_a_confirmation() {
        for (time, hold) in [
            ("30", Hold::Seconds(30.0)),
            ("5min", Hold::Seconds(300.0)),
            ("Hold", Hold::UntilReleased),
        ] {
            let Next::Ask(question) = answered(Asks::ForcedValue(target("BOOL")), "true") else {
                panic!("a time is to be asked for")
            };
            let next = answered(question.asks, time);
            let name = "ramp.setChangeRate".to_owned();
            let (value, to) = (Value::Bool(true), "TRUE".to_owned());
            let comment = None;
            assert_eq!(confirmed(next), Order::Force { name, value, to, hold, comment });
        }
    }

    #[test]
    fn what_is_no_value_is_asked_for_again_with_what_was_typed_and_the_reason() {
        for (asks, input) in [
            (Asks::NewValue(target("LREAL")), "seven"),
            (Asks::NewValue(target("LREAL")), ""),
            (Asks::NewValue(target("LREAL")), "1.1m"),
            (Asks::NewValue(target("TIME")), "1.5mm"),
            (Asks::NewValue(target("LREAL")), "1e999"),
            (Asks::NewValue(target("WORD")), "16#XYZ"),
            (Asks::ForceTime(target("LREAL"), Value::Number(1.0)), ""),
            (Asks::ForceTime(target("LREAL"), Value::Number(1.0)), "soon"),
            (Asks::Transaction(None), "-1"),
        ] {
            let Next::Ask(question) = answered(asks.clone(), input) else { panic!("{input}") };
            assert_eq!((question.asks, question.input.as_str()), (asks, input));
            assert!(question.error.is_some(), "{input}");
        }
    }
}

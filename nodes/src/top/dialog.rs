//! Questions that are answered with the keyboard before an order goes to the node.

use isochrone_blocks::PinType;
use isochrone_engine::parse_seconds;
use isochrone_runtime::control::{Hold, SignalDescription, Value};

use super::news::Order;
use crate::numbers::type_of;
use crate::operate::{parse, shown};

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
    Transaction,
    /// Whether it shall be done.
    Confirm(Order),
}

/// The signal of a question.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Target {
    pub(super) name: String,
    pub(super) value_type: String,
    pub(super) unit: Option<String>,
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
            Asks::Transaction => "the number of a set; `isochrone journal` lists them".into(),
            Asks::Confirm(_) => String::new(),
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
                let value = parse(self.input.trim())?;
                confirm(Order::Set { name: target.name.clone(), value }, Some(target))
            }
            Asks::ForcedValue(target) => {
                let value = parse(self.input.trim())?;
                Next::Ask(Self::new(Asks::ForceTime(target.clone(), value)))
            }
            Asks::ForceTime(target, value) => {
                let hold = hold(&self.input)?;
                confirm(
                    Order::Force { name: target.name.clone(), value: *value, hold },
                    Some(target),
                )
            }
            Asks::Transaction => {
                let transaction = self.input.trim().parse();
                let transaction = transaction.map_err(|_| "give the number of a transaction")?;
                confirm(Order::Undo { transaction }, None)
            }
            Asks::Confirm(order) => Next::Send(order.clone()),
        })
    }
}

impl Target {
    pub(super) fn new(signal: &SignalDescription, value: Option<Value>) -> Self {
        let SignalDescription { name, value_type, unit, .. } = signal.clone();
        Self { name, value_type, unit, value }
    }

    /// The value that it had, with its unit.
    pub(super) fn now(&self) -> String {
        let value = self.value.map(|value| shown(value, type_of(&self.value_type)));
        let unit = self.unit.as_deref().unwrap_or_default();
        format!("{} {unit}", value.as_deref().unwrap_or("-"))
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
        let set = Order::Set { name: "ramp.setChangeRate".into(), value: Value::Number(7.5) };
        assert_eq!(confirmed(next), set);
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
            assert_eq!(confirmed(next), Order::Force { name, value: Value::Bool(true), hold });
        }
    }

    #[test]
    fn what_is_no_value_is_asked_for_again_with_what_was_typed_and_the_reason() {
        for (asks, input) in [
            (Asks::NewValue(target("LREAL")), "seven"),
            (Asks::NewValue(target("LREAL")), ""),
            (Asks::NewValue(target("LREAL")), "1e999"),
            (Asks::NewValue(target("WORD")), "16#XYZ"),
            (Asks::ForceTime(target("LREAL"), Value::Number(1.0)), ""),
            (Asks::ForceTime(target("LREAL"), Value::Number(1.0)), "soon"),
            (Asks::Transaction, "-1"),
        ] {
            let Next::Ask(question) = answered(asks.clone(), input) else { panic!("{input}") };
            assert_eq!((question.asks, question.input.as_str()), (asks, input));
            assert!(question.error.is_some(), "{input}");
        }
    }
}

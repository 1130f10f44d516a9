//! Questions that are answered with the keyboard before an order goes to the node.

use isochrone_control::{Hold, Value};
use isochrone_engine::parse_seconds;

use super::history::History;
use super::signals::Signals;
use crate::session::{Order, Target};

/// The dialog above the list.
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
    /// The text typed so far.
    pub(super) input: String,
    /// Why the last answer was not accepted.
    pub(super) error: Option<String>,
}

/// The subject of a question.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Asks {
    NewValue(Target),
    ForcedValue(Target),
    ForceTime(Target, Value),
    Transaction,
    /// Whether it shall be done.
    Confirm(Order),
    /// Why it shall be done.
    Comment(Order),
}

impl Asks {
    /// The signal that it is about.
    pub(super) fn signal(&self) -> Option<&str> {
        match self {
            Self::NewValue(target) | Self::ForcedValue(target) | Self::ForceTime(target, _) => {
                Some(&target.name)
            }
            Self::Confirm(order) | Self::Comment(order) => order.signal(),
            Self::Transaction => None,
        }
    }
}

/// The step after an answer.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Next {
    Ask(Question),
    Send(Order),
}

/// What holds a force until it is released.
const HOLD: &str = "hold";

impl Question {
    pub(super) fn new(asks: Asks) -> Self {
        Self { asks, input: String::new(), error: None }
    }

    /// A hint on the possible answers, or on the meaning of the answer.
    pub(super) fn help(&self, history: &History, signals: &Signals) -> String {
        match &self.asks {
            Asks::NewValue(target) | Asks::ForcedValue(target) => target.expected(),
            Asks::ForceTime(..) => {
                format!("a time, such as 30 (seconds) or 5min; \"{HOLD}\": until it is released")
            }
            Asks::Transaction if self.input.is_empty() => match history.undoable() {
                Some(_) => "the number of a set; `isochrone journal` lists them".into(),
                None => history.why_nothing(),
            },
            Asks::Transaction => match self.transaction() {
                Ok(number) => history.describe(number, signals).unwrap_or_else(|why| why),
                Err(error) => error,
            },
            Asks::Confirm(_) => String::new(),
            Asks::Comment(_) => "for the journal, such as: sensor 3 calibrated".into(),
        }
    }

    /// Asks for the reason first, where the node keeps one.
    pub(super) fn for_comment(self) -> Self {
        match &self.asks {
            Asks::Confirm(order) if order.takes_reason() => {
                let input = order.comment().unwrap_or_default().to_owned();
                Self { input, ..Self::new(Asks::Comment(order.clone())) }
            }
            _ => self,
        }
    }

    /// Takes what was typed.
    pub(super) fn answer(self, history: &History, signals: &Signals) -> Next {
        let answered = self.read(history, signals);
        match answered {
            Ok(next) => next,
            Err(error) => Next::Ask(Self { error: Some(error), ..self }),
        }
    }

    /// The number that was typed.
    fn transaction(&self) -> Result<u64, String> {
        self.input.trim().parse().map_err(|_| "give the number of a transaction".into())
    }

    fn read(&self, history: &History, signals: &Signals) -> Result<Next, String> {
        let confirm = |order| Next::Ask(Self::new(Asks::Confirm(order)));
        Ok(match &self.asks {
            Asks::NewValue(target) => {
                let value = target.read(&self.input)?;
                let to = target.shown(value);
                let (name, comment) = (target.name.clone(), None);
                confirm(Order::Set { name, value, to, comment })
            }
            Asks::ForcedValue(target) => {
                let value = target.read(&self.input)?;
                Next::Ask(Self::new(Asks::ForceTime(target.clone(), value)))
            }
            Asks::ForceTime(target, value) => {
                let hold = hold(&self.input)?;
                let (name, to) = (target.name.clone(), target.shown(*value));
                let (value, comment) = (*value, None);
                confirm(Order::Force { name, value, to, hold, comment })
            }
            Asks::Transaction => {
                let transaction = self.transaction()?;
                // An unknown transaction cannot be confirmed.
                let what = history.describe(transaction, signals)?;
                confirm(Order::Undo { transaction, what })
            }
            Asks::Confirm(order) => Next::Send(order.clone()),
            Asks::Comment(order) => {
                let mut order = order.clone();
                if let Some(comment) = order.comment_mut() {
                    let text = self.input.trim();
                    *comment = (!text.is_empty()).then(|| text.to_owned());
                }
                confirm(order)
            }
        })
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
    use isochrone_control::{Role, SignalDescription};

    use super::*;
    use crate::top::fixtures::signal;

    fn target(value_type: &str) -> Target {
        Target::new(&signal("ramp.setChangeRate", Role::Parameter, value_type))
    }

    fn answered(asks: Asks, input: &str) -> Next {
        let question = Question { input: input.into(), ..Question::new(asks) };
        question.answer(&History::default(), &Signals::default())
    }

    fn confirmed(next: Next) -> Order {
        let Next::Ask(question) = next else { panic!("{next:?}") };
        match question.answer(&History::default(), &Signals::default()) {
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
            Asks::NewValue(Target::new(&signal))
        };
        let help = |can_be_unset| {
            Question::new(asks(can_be_unset)).help(&History::default(), &Signals::default())
        };
        assert!(!help(false).contains("calling task"));
        assert!(help(true).ends_with("or calling task"));
        let Order::Set { value, to, .. } = confirmed(answered(asks(true), "calling task")) else {
            panic!("a value is set")
        };
        assert_eq!(value, Value::CallingTask);
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
            (Asks::Transaction, "-1"),
            (Asks::Transaction, "33"),
            (Asks::NewValue(Target { limits: Some([0.2, 1.5]), ..target("LREAL") }), "1.6"),
            (Asks::ForcedValue(Target { limits: Some([0.2, 1.5]), ..target("LREAL") }), "0"),
        ] {
            let Next::Ask(question) = answered(asks.clone(), input) else { panic!("{input}") };
            assert_eq!((question.asks, question.input.as_str()), (asks, input));
            assert!(question.error.is_some(), "{input}");
        }
    }
}

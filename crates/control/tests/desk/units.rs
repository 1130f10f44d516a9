//! The units and comments of signals.

use isochrone_control::desk::{Feeds, Operator};
use isochrone_engine::{Plan, Rules, Source};

const NODE: &str = r#"
[node]
name = "level"
[[task]]
name = "fast"
period = "1ms"
[[input]]
name = "level"
service = "plant/level"
unit = "m"
comment = "Transmitter"
[[input]]
name = "flow"
service = "plant/flow"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
count = 2
unit = "m"
comment = "Smooths"
in = { value = "level", setChangeRate = 1.0 }
"#;

fn operator() -> Operator {
    let plan = Plan::new(Source::new("n.toml", NODE), &Rules::default()).unwrap();
    Operator::new(&plan, Feeds::Services)
}

fn unit(operator: &Operator, name: &str) -> String {
    let signal = operator.signals().find(name).unwrap();
    operator.unit(&signal).to_owned()
}

#[test]
fn a_signal_has_the_unit_and_the_comment_of_its_configuration() {
    let operator = operator();
    let said = |name: &str| {
        let signal = operator.signals().find(name).unwrap();
        (signal.unit.to_owned(), signal.comment.to_owned())
    };
    for (name, unit, comment) in [
        ("level", "m", "Transmitter"),
        ("level.ok", "", ""),
        ("level.age", "s", ""),
        ("flow", "", ""),
        ("ramp.0.delayedValue", "m", "Smooths"),
        ("ramp.1.delayedValue", "m", "Smooths"),
        ("ramp.1.setChangeRate", "1/s", "Smooths"),
    ] {
        assert_eq!(said(name), (unit.to_owned(), comment.to_owned()), "{name}");
    }
}

#[test]
fn an_announced_unit_is_that_of_an_input_without_one() {
    let mut operator = operator();
    assert_eq!((unit(&operator, "flow"), operator.announced_units()), (String::new(), 0));
    let of = |input: &str, unit: &str| (input.to_owned(), unit.to_owned());
    operator.announce_units([of("flow", "l/s"), of("level", "cm")]);
    assert_eq!((unit(&operator, "flow"), operator.announced_units()), ("l/s".to_owned(), 2));
    assert_eq!(unit(&operator, "level"), "m");
    assert_eq!(unit(&operator, "flow.age"), "s");
    operator.announce_units([of("flow", "")]);
    assert_eq!(unit(&operator, "flow"), "");
}

//! What a change of the configuration does to values, told before it is made.

use isochrone_control::desk::{PreparedChange, RequestTerms};
use isochrone_model::{ChangedValue, Given, Value};

use crate::hand::{Hand, draft};

const NODE: &str = r#"
[node]
name = "n"
control = "force"
[[task]]
name = "t"
period = "1ms"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
count = 3
[block.in]
value = 1.0
setChangeRate = 10.0
[[block]]
name = "last"
type = "LimRateOfChangeCI"
[block.in]
value = "ramp.1.delayedValue"
setChangeRate = 10.0
"#;

fn prepared(hand: &Hand, text: &str) -> PreparedChange {
    hand.operator.change(draft(text), RequestTerms::default()).unwrap()
}

fn value(name: &str, before: f64, after: f64) -> ChangedValue {
    let [before, after] = [before, after].map(|value| Given::Value(Value::Number(value)));
    ChangedValue { name: name.to_owned(), before, after, value_type: Some("LREAL".to_owned()) }
}

#[test]
fn instances_that_change_alike_are_told_once_and_one_that_was_set_by_its_name() {
    let mut hand = Hand::new(NODE);
    let faster = NODE.replacen("setChangeRate = 10.0", "setChangeRate = 20.0", 1);
    assert_eq!(prepared(&hand, &faster).values(), [value("ramp.*.setChangeRate", 10.0, 20.0)]);
    hand.set([("ramp.1.setChangeRate", 12.5.into()), ("last.setChangeRate", 3.0.into())]);
    hand.step(0);
    let change = prepared(&hand, &faster);
    assert_eq!(
        change.values(),
        [
            value("ramp.0.setChangeRate", 10.0, 20.0),
            value("ramp.2.setChangeRate", 10.0, 20.0),
            value("ramp.1.setChangeRate", 12.5, 20.0),
        ]
    );
    let [tuned] = change.tuned() else { panic!("{:?}", change.tuned()) };
    assert_eq!(tuned.name, "last.setChangeRate");
    assert_eq!((tuned.value, tuned.configured), (Value::Number(3.0), Value::Number(10.0)));
}

#[test]
fn a_wire_that_comes_goes_or_moves_is_told_by_its_source() {
    let hand = Hand::new(NODE);
    let wire = |name: &str| Given::Wire { wire: name.to_owned() };
    let told = |text: &str| match prepared(&hand, text).values() {
        [ChangedValue { name, before, after, .. }] if name == "last.value" => {
            (before.clone(), after.clone())
        }
        other => panic!("{other:?}"),
    };
    let old = wire("ramp.1.delayedValue");
    let moved = NODE.replace("ramp.1.", "ramp.2.");
    assert_eq!(told(&moved), (old.clone(), wire("ramp.2.delayedValue")));
    let cut = NODE.replace("\"ramp.1.delayedValue\"", "4.5");
    assert_eq!(told(&cut), (old, Given::Value(Value::Number(4.5))));
    let hand = Hand::new(&cut);
    let values = prepared(&hand, NODE).values().to_vec();
    assert_eq!(values[0].before, Given::Value(Value::Number(4.5)));
    assert_eq!(values[0].after, wire("ramp.1.delayedValue"));
}

#[test]
fn a_file_that_has_the_values_of_now_leaves_nothing_that_was_set_different() {
    let mut hand = Hand::new(NODE);
    hand.set([("last.setChangeRate", 3.0.into())]);
    hand.step(0);
    let saved = hand.operator.save(NODE).unwrap();
    let change = prepared(&hand, &saved);
    assert_eq!(change.tuned(), []);
    assert_eq!(change.values(), [value("last.setChangeRate", 3.0, 3.0)]);
}

//! Orders on their way to a cycle and back, without a thread.

use isochrone_control::desk::{Feeds, Operator, PreparedRequest, RequestTerms, Selection};
use isochrone_engine::orders::OrderState;
use isochrone_engine::{Plan, Rules, Source};
use isochrone_model::Hold;

use super::*;

const CONFIGURATION: &str = r#"
    [node]
    name = "n"
    control = "force"
    [[task]]
    name = "t"
    period = "100ms"
    [[block]]
    name = "ramp"
    type = "LimRateOfChangeCI"
    in = { value = 25.0, setChangeRate = 10.0 }
"#;

fn release(cycle: u64) -> Release {
    let (release_ns, start_ns) = (cycle, cycle);
    Release { cycle, release_ns, start_ns, missed: 0, newly_missed: 0, follow: None }
}

fn set(operator: &mut Operator, at: Option<u64>) -> Box<Order> {
    let request = RequestTerms { at: at.map(Into::into), ..RequestTerms::default() };
    let prepared = operator.set([("ramp.value", 3.0)], request, &[0]).unwrap();
    operator.send(prepared).1.remove(0).1
}

/// Lets go of a force, which may have come to its end before it is applied.
fn release_all(operator: &mut Operator) -> Box<Order> {
    let prepared =
        operator.release(["ramp.value"], Vec::new(), RequestTerms::default(), &[0]).unwrap();
    assert!(prepared.is_release());
    operator.send(prepared).1.remove(0).1
}

fn read_ramp(operator: &Operator) -> PreparedRequest {
    let selection = Selection::of(operator.signals(), ["ramp.value"], 0, 1).unwrap();
    operator.read(selection.with_quality())
}

fn returned(sender: &mut Sender) -> Option<OrderState> {
    sender.returned().map(|returned| match returned {
        Returned::Order(order) => order.state(),
        _ => panic!("nothing else was sent"),
    })
}

#[test]
fn an_order_is_applied_in_the_cycle_that_it_names_and_comes_back() {
    let plan = Plan::new(Source::new("n.toml", CONFIGURATION), &Rules::default()).unwrap();
    let mut engine = TaskEngine::build(&plan).unwrap().pop().unwrap();
    let mut operator = Operator::new(&plan, Feeds::Program);
    let (mut applier, mut sender) = ends();
    sender.send(set(&mut operator, Some(43)));
    sender.send(set(&mut operator, None));
    assert_eq!(returned(&mut sender), None);
    applier.apply(&mut engine, &release(41));
    assert_eq!(returned(&mut sender), Some(OrderState::Applied { cycle: 41 }));
    applier.apply(&mut engine, &release(42));
    assert_eq!(returned(&mut sender), None);
    // The cycle was missed.
    applier.apply(&mut engine, &release(44));
    assert_eq!(returned(&mut sender), Some(OrderState::Applied { cycle: 44 }));
    sender.send(set(&mut operator, Some(44)));
    applier.apply(&mut engine, &release(45));
    assert_eq!(returned(&mut sender), Some(OrderState::TooLate));
}

#[test]
fn what_is_sent_between_two_cycles_is_read_there_and_applied_in_the_next() {
    let plan = Plan::new(Source::new("n.toml", CONFIGURATION), &Rules::default()).unwrap();
    let mut engine = TaskEngine::build(&plan).unwrap().pop().unwrap();
    let mut operator = Operator::new(&plan, Feeds::Program);
    let (mut applier, mut sender) = ends();
    engine.step(7);
    sender.send(set(&mut operator, None));
    let reading = read_ramp(&operator);
    sender.send(operator.send(reading).1.remove(0).1);
    applier.read_between(&engine, 7);
    assert_eq!(returned(&mut sender), Some(OrderState::Applied { cycle: 7 }));
    assert_eq!(returned(&mut sender), None, "nothing is changed between two cycles");
    applier.apply(&mut engine, &release(8));
    assert_eq!(returned(&mut sender), Some(OrderState::Applied { cycle: 8 }));
}

#[test]
fn a_cycle_that_stands_still_is_sent_no_more_than_it_can_give_back_and_releases_last() {
    let plan = Plan::new(Source::new("n.toml", CONFIGURATION), &Rules::default()).unwrap();
    let mut engine = TaskEngine::build(&plan).unwrap().pop().unwrap();
    let mut operator = Operator::new(&plan, Feeds::Program);
    let (mut applier, mut sender) = ends();
    let hold = operator
        .force([("ramp.value", 3.0)], Hold::UntilReleased, RequestTerms::default(), &[0])
        .unwrap();
    sender.send(operator.send(hold).1.remove(0).1);
    while sender.has_room() {
        sender.send(set(&mut operator, None));
    }
    while sender.has_room_to_release() {
        sender.send(release_all(&mut operator));
    }
    while sender.has_room_to_read() {
        let reading = read_ramp(&operator);
        sender.send(operator.send(reading).1.remove(0).1);
    }
    applier.apply(&mut engine, &release(0));
    applier.read(&engine, 0);
    assert!(
        !sender.has_room_to_release() && !sender.has_room_to_read(),
        "they have not come back yet"
    );
    assert_eq!(std::iter::from_fn(|| returned(&mut sender)).count(), ORDERS);
    assert!(sender.has_room() && sender.has_room_to_read());
}

//! Orders, from the key to their confirmation.

use isochrone_control::{AlarmMoment, AlarmSeverity, AlarmState, ProcessAlarm};

use super::*;

#[test]
fn a_parameter_is_set_with_enter_a_value_and_a_confirmation() {
    let mut model = plant();
    assert_eq!(press(&mut model, "p\n"), None);
    assert_shows(&mut model, &["Set a parameter", "ramp.setChangeRate (LREAL), now 5 m/s", "> "]);
    assert_eq!(press(&mut model, "fast\n"), None);
    assert_shows(&mut model, &["> fast", "a value is true, false, a number"]);
    assert_eq!(press(&mut model, "\u{8}\u{8}\u{8}\u{8}7.5\n"), None);
    assert_shows(&mut model, &["Do this?", "set ramp.setChangeRate to 7.5", "now 5 m/s"]);
    let (name, to) = ("ramp.setChangeRate".into(), "7.5 m/s".into());
    let comment = Some("too fast".to_owned());
    press(&mut model, "ctoo slow\u{1b}");
    assert_eq!((model.focus(), &model.dialog), (Focus::List, &None), "Esc leaves");
    press(&mut model, "\n7.5\nctoo fast\n");
    assert_shows(&mut model, &["Do this?", "now 5 m/s", "reason: too fast"]);
    let order = Order::Set { name, value: Value::Number(7.5), to, comment };
    assert_eq!(press(&mut model, "\n"), Some(order.clone()));
    assert_shows(&mut model, &["asked to set ramp.setChangeRate to 7.5"]);
    let before: Values = [("ramp.setChangeRate", 5.0)].into_iter().collect();
    let cycles = vec![("fast".to_owned(), 777)];
    model.take(News::Done(CompletedOrder {
        order,
        transaction: Some(12),
        before,
        cycles,
        warnings: vec![],
    }));
    assert_shows(
        &mut model,
        &["#12 from fast cycle 777: set ramp.setChangeRate to 7.5 m/s (was 5)"],
    );
}

#[test]
fn what_is_to_be_set_or_forced_is_shown_with_the_value_of_now_until_it_is_confirmed() {
    let mut model = plant();
    let set = |model: &mut Model, value: f64| {
        model.take(News::Values(read([("ramp.setChangeRate", value)])));
    };
    press(&mut model, "p\n");
    set(&mut model, 0.8);
    assert_shows(&mut model, &["ramp.setChangeRate (LREAL), now 0.8 m/s"]);
    press(&mut model, "1.15\n");
    set(&mut model, 1.33);
    assert_shows(&mut model, &["Do this?", "set ramp.setChangeRate to 1.15 m/s", "now 1.33 m/s"]);
    press(&mut model, "\u{1b}f");
    model.take(News::Values(ReadValues::default()));
    assert_shows(&mut model, &["Force a signal", "now: not read yet"]);
    press(&mut model, "2\n");
    set(&mut model, 1.5);
    assert_shows(&mut model, &["Force for how long?", "setChangeRate to 2 m/s, now 1.5 m/s"]);
    press(&mut model, "30\n");
    set(&mut model, 1.75);
    assert_shows(&mut model, &["Do this?", "now 1.75 m/s"]);
    press(&mut model, "\u{1b}4f");
    assert_eq!(model.watched(), ["ramp.delayedValue"], "no page lists it, but the question");
}

#[test]
fn undo_proposes_the_newest_set_that_stands_and_tells_the_one_that_is_typed() {
    let mut model = plant();
    press(&mut model, "u");
    assert_shows(
        &mut model,
        &["Undo which transaction?", "nothing was set since the node started"],
    );
    let undone = Entry { undone: Some(3), ..entry(4, Action::Undo, 0.0) };
    let sets = [1, 2, 3].map(|number| entry(number, Action::Set, number as f64));
    model.take(News::Journal([&sets[..], &[undone]].concat()));
    press(&mut model, "\u{1b}u");
    assert_shows(&mut model, &["> 2", "set ramp.setChangeRate 0 -> 2, by bert at 22:13:20 UTC"]);
    press(&mut model, "\u{8}1");
    assert_shows(&mut model, &["> 1", "set ramp.setChangeRate 0 -> 1, by bert"]);
    press(&mut model, "\u{8}3\n");
    assert_shows(&mut model, &["> 3", "set ramp.setChangeRate 0 -> 3", "already"]);
    press(&mut model, "3\n");
    assert_shows(&mut model, &["> 33", "the node's journal has no transaction 33"]);
    press(&mut model, "\u{8}\u{8}1\n");
    let what = "set ramp.setChangeRate 0 -> 1, by bert at 22:13:20 UTC".to_owned();
    assert_shows(
        &mut model,
        &["Do this?", "undo transaction 1: set ramp.setChangeRate 0 -> 1, by bert at 22:13:20"],
    );
    assert!(!shown(&mut model).contains("reason"), "an undo takes none");
    assert_eq!(press(&mut model, "y"), Some(Order::Undo { transaction: 1, what }));
    // Another run of the node counts anew.
    model.take(News::Joined { node: node(2), signals: Vec::new() });
    press(&mut model, "u");
    assert_shows(&mut model, &["nothing was set since the node started"]);
}

#[test]
fn limits_are_shown_and_hold_before_the_confirmation_and_what_is_protected_is_not_asked_for() {
    let mut model = Model::default();
    let limited = signal("ramp.setChangeRate", Role::Parameter, "LREAL");
    let limited = SignalDescription { limits: Some([0.2, 1.5]), ..limited };
    let protected = signal("scale.x1", Role::Parameter, "LREAL");
    let protected = SignalDescription { protected: Some(true), ..protected };
    model.take(News::Joined { node: node(1), signals: vec![limited, protected] });
    assert_shows(&mut model, &["ramp.setChangeRate  limits 0.2 to 1.5  LREAL"]);
    press(&mut model, "\n");
    assert_shows(&mut model, &["Set a parameter", "\u{2502} 0.2 to 1.5"]);
    press(&mut model, "2\n");
    assert_shows(&mut model, &["Set a parameter", "2 is outside of the limits: 0.2 to 1.5"]);
    press(&mut model, "\u{8}1.5\n");
    assert_shows(&mut model, &["Do this?"]);
    for key in ["\u{1b}↓\n", "f", "r"] {
        press(&mut model, key);
        assert_eq!(model.dialog, None, "{key:?}");
        assert_shows(&mut model, &["scale.x1  protected", "scale.x1 is protected ([[protect]]"]);
    }
}

#[test]
fn what_the_node_does_not_allow_is_neither_offered_nor_asked_for() {
    let with = |control| {
        let mut model = plant();
        model.take(News::Described(DescribeResult { control, ..node(1) }));
        model
    };
    let mut model = with(Access::Read);
    let keys = lines(&mut model, (80, 24))[23].clone();
    assert_eq!(keys, "/ search  a i p w o list  ? help  q quit");
    for key in ["p\n", "f", "r", "u"] {
        press(&mut model, key);
        assert_eq!(model.dialog, None, "{key:?}");
        assert_shows(&mut model, &["does not allow it (control = \"read\")"]);
    }
    let mut model = with(Access::Set);
    let keys = lines(&mut model, (80, 24))[23].clone();
    assert_eq!(keys, "Enter set  u undo  / search  a i p w o list  ? help  q quit");
    press(&mut model, "f");
    assert_shows(&mut model, &["does not allow it (control = \"set\")"]);
    press(&mut model, "i\n");
    assert_shows(&mut model, &["level is no parameter"]);
    assert!(!shown(&mut model).contains("f forces it"));
}

#[test]
fn a_dialog_that_is_left_gives_no_order() {
    let mut model = plant();
    for keys in ["p\n\u{1b}", "p\n7\n\u{1b}", "p\n7\nn", "f1\n\u{1b}", "f1\n5\nn"] {
        assert_eq!(press(&mut model, keys), None, "{keys:?}");
        assert_eq!((model.focus(), &model.dialog), (Focus::List, &None), "{keys:?}");
    }
}

#[test]
fn a_force_has_a_time_and_is_released_where_it_is_listed() {
    let mut model = plant();
    assert_eq!(press(&mut model, "i\nf"), None);
    assert_shows(&mut model, &["Force a signal", "level (LREAL), now 4 m/s"]);
    press(&mut model, "1.5\n");
    assert_shows(&mut model, &["Force for how long?", "level to 1.5", "until it is released"]);
    press(&mut model, "30\n");
    assert_shows(&mut model, &["force level to 1.5 m/s for 30 s"]);
    let order = press(&mut model, "\n");
    let (name, value, to) = ("level".to_owned(), Value::Number(1.5), "1.5 m/s".to_owned());
    let (hold, comment) = (Hold::Seconds(30.0), None);
    assert_eq!(order, Some(Order::Force { name, value, to, hold, comment }));
    press(&mut model, "r");
    assert_shows(&mut model, &["level is not forced"]);
    let name = "ramp.delayedValue".to_owned();
    press(&mut model, "4r");
    assert!(!shown(&mut model).contains("reason"));
    press(&mut model, "c");
    assert_shows(&mut model, &["Do this?", "release ramp.delayedValue"]);
    assert_eq!(press(&mut model, "\n"), Some(Order::Release { name }), "it has no reason");
}

#[test]
fn an_answer_that_comes_while_something_is_typed_waits_until_that_is_done() {
    let mut model = plant();
    let refused = |transaction| News::Refused {
        order: Order::Undo { transaction, what: String::new() },
        why: "it is too late".into(),
    };
    press(&mut model, "p\n7.");
    [1, 2].into_iter().for_each(|number| model.take(refused(number)));
    assert_shows(&mut model, &["Set a parameter", "> 7.", "Not done: undo transaction 2"]);
    press(&mut model, "5\n");
    assert_shows(&mut model, &["Do this?", "set ramp.setChangeRate to 7.5"]);
    assert!(press(&mut model, "\n").is_some());
    assert_shows(&mut model, &["The node says", "Not done: undo transaction 1", "too late"]);
    press(&mut model, "\n");
    assert_shows(&mut model, &["The node says", "Not done: undo transaction 2"]);
    press(&mut model, "\n");
    assert_eq!(model.dialog, None);
    press(&mut model, "a/bank");
    model.take(refused(3));
    assert_shows(&mut model, &["/bank", "300 of 304 listed"]);
    press(&mut model, "\n");
    assert_shows(&mut model, &["Not done: undo transaction 3"]);
}

#[test]
fn only_parameters_are_set() {
    let mut model = plant();
    assert_eq!(press(&mut model, "i\n"), None);
    assert_shows(&mut model, &["level is no parameter; f forces it"]);
    press(&mut model, "2f");
    assert_shows(&mut model, &["select a signal first"]);
}

#[test]
fn c_acknowledges_what_is_shown_of_the_selected_process_alarm() {
    let mut model = plant();
    let moment = AlarmMoment { cycle: 149, unix_ns: 0, value: Value::Number(1.7) };
    let high = ProcessAlarm {
        name: "high".into(),
        task: "fast".into(),
        severity: AlarmSeverity::Warning,
        text: "Tank above 1.6 m".into(),
        when: "level > 1.6".into(),
        state: AlarmState::ActiveUnacknowledged,
        evaluated: true,
        signal: "level".into(),
        value_type: "LREAL".into(),
        occurrence: 3,
        unacknowledged: 2,
        first: Some(moment),
        last: Some(moment),
    };
    let seen = ProcessAlarm { state: AlarmState::ActiveAcknowledged, ..high.clone() };
    model.take(News::ProcessAlarms(vec![high]));
    press(&mut model, "3");
    assert_shows(
        &mut model,
        &["3 Alarms (", "no. 3", "warning, active, unacknowled", "c acknowledge"],
    );
    assert_eq!(press(&mut model, "c"), None);
    assert_shows(&mut model, &["Do this?", "acknowledge high 3"]);
    let comment = None;
    let order = Order::Acknowledge { alarm: "high".into(), occurrence: 3, comment };
    assert_eq!(press(&mut model, "\n"), Some(order));
    model.take(News::ProcessAlarms(vec![seen]));
    press(&mut model, "c");
    assert_shows(&mut model, &["nothing of high is left to acknowledge"]);
}

//! Values that are read, of a cycle each, and what is looked for.

use isochrone_control::desk::*;
use isochrone_model::*;
use isochrone_testing::volume;

use crate::hand::Hand;
use crate::level::NODE;

#[test]
fn values_are_read_after_the_blocks_of_one_cycle_have_stepped() {
    let mut hand = Hand::new(NODE);
    let names = ["scale.y", "ramp.*.value", "free.value"];
    let (prepared, total) = hand.get(names, 0, 99).unwrap();
    assert_eq!(total, 4);
    hand.send(Ok(prepared));
    hand.step(0);
    hand.step(1);
    let [OrderOutcome::Read(fast), OrderOutcome::Read(slow)] = &hand.done[..] else {
        panic!("{:?}", hand.done)
    };
    let value = |name: &str, value| (name.to_owned(), Value::Number(value));
    assert_eq!(
        fast.values,
        [value("scale.y", 3.0), value("ramp.0.value", 3.0), value("ramp.1.value", 3.0)]
    );
    assert_eq!((fast.cycle, &slow.values[..]), (0, &[value("free.value", 25.0)][..]));
    let (page, total) = hand.get(names, 2, 1).unwrap();
    assert_eq!((page.tasks().collect::<Vec<_>>(), total), (vec![0], 4));
    let refused = hand.get(["scale.yy", "nobody.*"], 0, 99).unwrap_err();
    assert_eq!(refused.findings.len(), 2);
}

#[test]
fn a_signal_that_several_names_stand_for_is_read_once_where_it_stands_first() {
    let mut hand = Hand::new(NODE);
    let names = ["ramp.1.value", "ramp.*.value", "scale.y", "ramp.*.*", "scale.y"];
    let (_, total) = hand.get(names, 0, 99).unwrap();
    let (_, pins) = hand.get(["ramp.*.*"], 0, 99).unwrap();
    assert_eq!(total, pins + 1);
    let mut paged = Vec::new();
    for offset in 0..total {
        let (page, of) = hand.get(names, offset, 1).unwrap();
        assert_eq!(of, total);
        hand.send(Ok(page));
        hand.step(0);
        let Some(OrderOutcome::Read(read)) = hand.done.pop() else { panic!("{:?}", hand.done) };
        paged.extend(read.values.into_iter().map(|(name, _)| name));
    }
    assert_eq!(paged[..3], ["ramp.1.value", "ramp.0.value", "scale.y"]);
    let mut sorted = paged.clone();
    sorted.sort();
    sorted.dedup();
    assert_eq!(sorted.len(), total, "{paged:?}");
}

#[test]
fn a_misspelt_name_among_thousands_is_told_the_one_that_begins_alike() {
    let block = |n: u32| format!("[[block]]\nname = \"b{n}\"\ntype = \"SawTooth\"\n");
    let blocks: String = (0..5000).map(block).collect();
    let text = format!("[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"1s\"\n{blocks}");
    let hand = Hand::new(&text);
    let help = |name| hand.get([name], 0, 1).unwrap_err().findings[0].help.clone().unwrap();
    assert!(help("b47777.value").starts_with("did you mean \"b477"), "{}", help("b47777.value"));
    assert!(help("x.value").starts_with("there are 5000: b0, b1, b10, "), "{}", help("x.value"));
}

#[test]
fn patterns_stand_for_names_of_a_large_node_and_unknown_ones_are_each_a_finding() {
    let count = volume(900_000);
    let hand = Hand::new(&NODE.replace("count = 2", &format!("count = {count}")));
    let (_, total) = hand.get(["ramp.*1.value", "ramp.*2.value"], 0, 1).unwrap();
    assert_eq!(total, count / 5);
    let (_, all) = hand.get(["scale.*", "ramp.7.*", "ramp.*.value"], 0, 1).unwrap();
    assert!(all > count);
    let unknown: Vec<String> = (0..4096).map(|n| format!("ramp.*{n}.valeu")).collect();
    let names = || unknown.iter().map(String::as_str);
    assert_eq!(hand.get(names(), 0, 1).unwrap_err().findings.len(), 4096);
    assert_eq!(hand.prepare_release(names()).unwrap_err().findings.len(), 4096);
}

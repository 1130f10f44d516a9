//! A block that panics in a running node.

use isochrone_blocks::{Block, BlockType, CATALOGUE, Cycle};
use isochrone_engine::{Plan, Rules, Source};
use isochrone_runtime::{End, Node, NodePanicked, Outcome, TaskPanicked, hold_panic_messages};
use isochrone_testing::wait_until;

isochrone_blocks::block! {
    /// Panics at 1.
    Faulty {
        inputs {
            /// What decides it.
            "x" => x: f64 = 0.0,
        }
        outputs {
            /// The same.
            "y" => y: f64,
        }
        state { y: f64 }
        status {}
    }
}

impl Block for Faulty {
    fn step(_: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        assert!(inputs.x != 1.0, "one is too much");
        Outputs { y: inputs.x }
    }
}

/// Two tasks, of which the second has two blocks that may panic behind one that does not.
const TWO_TASKS: &str = r#"
[node]
name = "n"
[[task]]
name = "fast"
period = "1ms"
[[task]]
name = "slow"
period = "5ms"
[[block]]
name = "alone"
type = "Faulty"
task = "fast"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = 25.0, setChangeRate = 10.0 }
[[block]]
name = "first"
type = "Faulty"
task = "slow"
[[block]]
name = "second"
type = "Faulty"
task = "slow"
"#;

/// Runs the node, and sets these pins to 1 once both tasks have run.
fn panicked(pins: &[&str]) -> (Vec<TaskPanicked>, Box<Outcome>) {
    let catalogue = [CATALOGUE, &[BlockType::of::<Faulty>()]].concat();
    let rules = Rules { catalogue: &catalogue, ..Rules::default() };
    let plan = Plan::new(Source::new("n.toml", TWO_TASKS), &rules).unwrap();
    let node = Node::prepare_alone(&plan).unwrap().start();
    wait_until("both tasks have run", || {
        node.value("ramp.delayedValue").is_some() && node.value("alone.y").is_some()
    });
    let sent = node.set(pins.iter().map(|pin| (*pin, 1.0))).unwrap();
    assert!(sent.warnings.is_empty(), "a block from outside the library is not tried out");
    node.wait();
    let error = node.finish().unwrap_err();
    let said = error.to_string();
    let NodePanicked::Tasks { panics, outcome, .. } = error else { panic!("{said}") };
    assert_eq!(said.lines().count(), panics.len());
    (panics, outcome)
}

#[test]
fn a_panic_names_its_block_and_the_outcome_of_all_tasks_is_there_beside_it() {
    let (panics, outcome) = panicked(&["alone.x"]);
    let [panic] = panics.as_slice() else { panic!("{panics:?}") };
    assert_eq!((panic.task.as_str(), panic.message.as_str()), ("fast", "one is too much"));
    assert_eq!(panic.block.as_deref(), Some("\"alone\" (Faulty)"));
    assert!(panic.to_string().contains("task \"fast\" panicked in block \"alone\" (Faulty)"));
    assert_eq!(outcome.end, End::Panicked { task: "fast".into() });
    let [fast, slow] = outcome.tasks.as_slice() else { panic!("{outcome:?}") };
    assert_eq!((fast.name.as_str(), slow.name.as_str()), ("fast", "slow"));
    assert!(fast.cycles > 0 && slow.cycles > 0);
    assert_eq!((fast.lost_records, slow.lost_records), (Some(0), Some(0)));
    assert_eq!((fast.cpu_fraction, fast.allocations), (None, None), "the panic itself allocates");
}

#[test]
fn a_panic_in_a_bank_of_several_blocks_names_all_of_them() {
    let (panics, _) = panicked(&["second.x"]);
    assert_eq!(panics[0].block.as_deref(), Some("\"first\" or \"second\" (Faulty)"));
}

#[test]
fn the_panics_of_all_tasks_are_told() {
    let (panics, _) = panicked(&["alone.x", "first.x"]);
    let tasks: Vec<_> = panics.iter().map(|panic| panic.task.as_str()).collect();
    // The one may end the node before the other has read its pin.
    assert!([vec!["fast", "slow"], vec!["fast"], vec!["slow"]].contains(&tasks), "{tasks:?}");
}

#[test]
fn held_messages_say_where_in_the_source_the_panic_was() {
    hold_panic_messages();
    let (panics, _) = panicked(&["alone.x"]);
    let TaskPanicked { place: Some(place), .. } = &panics[0] else { panic!("{panics:?}") };
    assert!(place.contains("panics.rs:"), "{place}");
}

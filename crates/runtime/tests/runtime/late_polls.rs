//! A node whose ordinary thread gets no time to poll it.

use std::sync::atomic::Ordering;

use isochrone_blocks::{Block, BlockType, CATALOGUE, Cycle};
use isochrone_engine::{Plan, Rules, Source};
use isochrone_ipc::local;
use isochrone_runtime::{End, Node, Running};
use isochrone_testing::wait_until;

isochrone_blocks::block! {
    /// Counts its own cycles.
    Counter {
        inputs {
            /// Where it begins.
            "first" => first: f64 = 0.0,
        }
        outputs {
            /// The index of the cycle.
            "y" => y: f64,
        }
        state { unused: f64 }
        status {}
    }
}

impl Block for Counter {
    fn step(_: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        Outputs { y: inputs.first + cycle.index() as f64 }
    }
}

/// A node with a task of this period, and what else its task says.
fn node(period: &str, more: &str, cycles: Option<u64>) -> Running<local::Service> {
    let text = format!(
        "[node]\nname = \"n\"\n[[task]]\nname = \"fast\"\nperiod = \"{period}\"\n{more}\n\
         [[block]]\nname = \"counter\"\ntype = \"Counter\"\n"
    );
    let catalogue = [CATALOGUE, &[BlockType::of::<Counter>()]].concat();
    let rules = Rules { catalogue: &catalogue, ..Rules::default() };
    let plan = Plan::new(Source::new("n.toml", text), &rules).unwrap();
    Node::prepare_alone(&plan).unwrap().with_cycles(cycles).start()
}

/// Waits, without a poll, until a task has ended.
fn await_end(node: &Running<local::Service>) {
    let ended = node.stop_flag();
    wait_until("a task has ended", || ended.load(Ordering::Relaxed));
}

#[test]
fn cycles_whose_records_found_no_room_are_counted_and_their_records_as_lost() {
    let node = node("100us", "", Some(6_000));
    await_end(&node);
    let outcome = node.finish().unwrap();
    assert_eq!(outcome.end, End::Cycles);
    let task = &outcome.tasks[0];
    assert_eq!((task.cycles, task.lost_records), (6_000, Some(6_000 - 4_096)));
}

#[test]
fn the_first_poll_after_a_pause_shows_the_newest_cycle_and_all_values_are_of_it() {
    let mut node = node("1ms", "", Some(300));
    await_end(&node);
    let last = node.poll().records().last().map(|(_, record)| record.cycle as f64);
    assert_eq!(node.value("task.fast.cycle"), last, "each 20th cycle is shown, and the 300th");
    assert_eq!(node.value("counter.y"), last);
}

#[test]
fn values_of_a_task_of_which_nothing_was_seen_are_none() {
    let node = node("1ms", "", None);
    for name in ["task.fast.cycle", "task.fast.execution_ns", "counter.y"] {
        assert_eq!(node.value(name), None, "{name}");
    }
}

//! A node that the threads of a program share, and one that is held up by it.

use std::thread;
use std::time::Duration;

use isochrone_blocks::{Block, BlockType, CATALOGUE, Cycle};
use isochrone_engine::{Plan, Rules, Source};
use isochrone_model::{Code, Refusal};
use isochrone_runtime::{End, Events, Node, Prepared, Running};
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

/// What threads may share.
const fn is_shared<T: Send + Sync + 'static>() {}
const _: () = (is_shared::<Running>(), is_shared::<Prepared>(), is_shared::<Events>()).0;

/// A node with a task of this period, and what else its task says.
fn prepared(period: &str, more: &str, cycles: Option<u64>) -> Prepared {
    let text = format!(
        "[node]\nname = \"n\"\n[[task]]\nname = \"fast\"\nperiod = \"{period}\"\n{more}\n\
         [[block]]\nname = \"counter\"\ntype = \"Counter\"\n"
    );
    let catalogue = [CATALOGUE, &[BlockType::of::<Counter>()]].concat();
    let rules = Rules { catalogue: &catalogue, ..Rules::default() };
    let plan = Plan::new(Source::new("n.toml", text), &rules).unwrap();
    Node::prepare_alone(&plan).unwrap().with_cycles(cycles)
}

#[test]
fn threads_that_share_a_node_set_values_wait_for_its_end_and_end_it() {
    let node = prepared("1ms", "", None).start();
    thread::scope(|threads| {
        let waits = threads.spawn(|| node.wait());
        let sets: Vec<_> = (1..=4)
            .map(|first| {
                let node = &node;
                threads.spawn(move || node.set([("counter.first", f64::from(first))]).unwrap())
            })
            .collect();
        let mut numbers: Vec<_> = sets.into_iter().map(|set| set.join().unwrap().number).collect();
        wait_until("all are done", || node.journal(0).count() == 4);
        let mut done: Vec<_> = node.journal(0).map(|entry| entry.transaction).collect();
        numbers.sort_unstable();
        done.sort_unstable();
        assert_eq!(done, numbers);
        assert!(node.is_running() && !waits.is_finished());
        node.stop();
        waits.join().unwrap();
    });
    assert!(!node.is_running());
    assert_eq!(node.finish().unwrap().end, End::Asked);
}

#[test]
fn every_receiver_is_told_everything_from_then_on_and_then_that_the_node_has_ended() {
    let prepared = prepared("1ms", "", Some(200));
    let all = prepared.events();
    let node = prepared.start();
    wait_until("some cycles ran", || node.value("counter.y").is_some_and(|y| y > 20.0));
    let later = node.events();
    let cycles = |events: Events| {
        let mut is_ending = false;
        let mut cycles = Vec::new();
        for batch in events {
            assert_eq!(batch.lost, 0);
            assert!(batch.is_ending || !is_ending);
            is_ending = batch.is_ending;
            cycles.extend(batch.cycles.into_iter().map(|cycle| cycle.record));
        }
        assert!(is_ending);
        cycles
    };
    // Both are taken in time only if both are taken at once.
    let (all, later) = thread::scope(|threads| {
        let all = threads.spawn(|| cycles(all));
        let later = cycles(later);
        (all.join().unwrap(), later)
    });
    assert_eq!(all.len(), 200);
    assert!(!later.is_empty() && all.ends_with(&later), "{} cycles", later.len());
    assert!(node.events().next().is_none());
    assert_eq!(node.finish().unwrap().tasks[0].cycles, 200);
}

#[test]
fn dropping_a_node_that_was_not_started_ends_its_events() {
    let prepared = prepared("1ms", "", None);
    let events = prepared.events();
    drop(prepared);
    assert_eq!(events.count(), 0);
}

#[test]
fn the_records_of_a_second_wait_for_a_supervisor_that_is_held_up_and_what_is_lost_is_counted() {
    let prepared = prepared("100us", "", Some(25_000));
    let events = prepared.events();
    let node = prepared.start();
    let (has_ended, mut seen) = (node.stop_flag(), 0);
    // Whoever prepares a request holds it up meanwhile.
    let refused = node.send(|_, _| {
        wait_until("the task has ended", || has_ended.load(std::sync::atomic::Ordering::Relaxed));
        Err(Refusal::new(Code::Forbidden, "held up"))
    });
    assert!(refused.is_err());
    seen += events.flat_map(|batch| batch.cycles).count() as u64;
    assert!((10_000..25_000).contains(&seen), "{seen}");
    let outcome = node.finish().unwrap();
    assert_eq!(outcome.end, End::Cycles);
    let task = &outcome.tasks[0];
    assert_eq!((task.cycles, task.lost_records), (25_000, Some(25_000 - seen)));
}

#[test]
fn the_last_snapshot_is_shown_when_a_node_has_ended_and_all_its_values_are_of_one_cycle() {
    let node = prepared("1ms", "", Some(300)).start();
    node.wait();
    let cycle = node.value("task.fast.cycle");
    assert!(cycle.is_some_and(|cycle| cycle >= 299.0), "each 20th cycle is shown, and the 300th");
    assert_eq!(node.value("counter.y"), cycle);
}

#[test]
fn values_of_a_task_of_which_nothing_was_seen_are_none() {
    let node = prepared("1h", "phase = \"30min\"", None).start();
    assert!(!node.wait_within(Duration::from_millis(50)));
    for name in ["task.fast.cycle", "task.fast.execution_ns", "counter.y"] {
        assert_eq!(node.value(name), None, "{name}");
    }
}

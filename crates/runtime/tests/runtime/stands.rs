//! A task that stands is told to operators.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use isochrone_blocks::{Block, BlockType, CATALOGUE, Cycle};
use isochrone_control::{Client, DescribeParams, TaskDescription};
use isochrone_engine::{Plan, Rules, Source};
use isochrone_ipc::{IsolatedDomain, Participant, local};
use isochrone_runtime::Node;
use isochrone_testing::{PATIENCE, wait_for_ok};

/// Whether the block does not return from its step.
static IS_HELD: AtomicBool = AtomicBool::new(false);

isochrone_blocks::block! {
    /// Returns when it may.
    Door {
        inputs {
            /// What it hands on.
            "x" => x: f64 = 0.0,
        }
        outputs {
            /// The same.
            "y" => y: f64,
        }
        state { unused: f64 }
        status {}
    }
}

impl Block for Door {
    fn step(_: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        while IS_HELD.load(Ordering::Relaxed) {
            thread::sleep(Duration::from_millis(1));
        }
        Outputs { y: inputs.x }
    }
}

/// Lets the block return when the test ends, however that is: the node waits for it.
struct Release;

impl Drop for Release {
    fn drop(&mut self) {
        IS_HELD.store(false, Ordering::Relaxed);
    }
}

const NODE: &str = r#"
[node]
name = "gate"
[[task]]
name = "fast"
period = "2ms"
[[block]]
name = "door"
type = "Door"
"#;

/// Asks the node until it describes its task as wanted.
fn described(
    client: &mut Client<local::Service>,
    is_wanted: impl Fn(&TaskDescription) -> bool,
) -> TaskDescription {
    wait_for_ok("the node describes its task as expected", || {
        let task = client.call(&DescribeParams {}).unwrap().tasks.remove(0);
        if is_wanted(&task) { Ok(task) } else { Err(format!("{task:?}")) }
    })
}

#[test]
fn a_task_whose_block_does_not_return_stands_from_its_next_release_on_until_it_runs_again() {
    let domain = IsolatedDomain::new("isostand").unwrap();
    let catalogue = [CATALOGUE, &[BlockType::of::<Door>()]].concat();
    let rules = Rules { catalogue: &catalogue, ..Rules::default() };
    let plan = Plan::new(Source::new("gate.toml", NODE), &rules).unwrap();
    let participant = Participant::join_local(&plan.node, &domain).unwrap();
    let node = Node::prepare(&plan, participant).unwrap().start();
    let _release = Release;
    let operator = Participant::join_local("operator", &domain).unwrap();
    let mut client = Client::connect(&operator, "gate", PATIENCE).unwrap();

    let runs = |task: &TaskDescription| task.last_cycle.is_some() && task.stands_ns.is_none();
    described(&mut client, runs);
    IS_HELD.store(true, Ordering::Relaxed);
    let stood = described(&mut client, |task| task.stands_ns.is_some());
    assert!(stood.stands_ns > Some(1_000_000_000), "{stood:?}");
    let later = described(&mut client, |task| task.cycle > stood.cycle);
    // It is counted from the release after the last cycle, which is at most the one that was held.
    let next = |task: &TaskDescription| task.last_cycle.map(|cycle| cycle + 1);
    assert!(
        later.stands_ns > stood.stands_ns && next(&later) >= next(&stood),
        "{stood:?} {later:?}"
    );
    let due = |task: &TaskDescription| next(task).is_some_and(|next| next < task.cycle);
    assert!(due(&stood) && due(&later), "{stood:?} {later:?}");
    IS_HELD.store(false, Ordering::Relaxed);
    let ran = described(&mut client, runs);
    assert!(ran.last_cycle > stood.last_cycle);
    node.finish().unwrap();
}

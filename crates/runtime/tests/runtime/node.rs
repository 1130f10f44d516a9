//! A node in a program: set-points, ends, services of both kinds.

use crate::happened::{applied, take_until};
use isochrone_engine::{Plan, Rules, Source};
use isochrone_ipc::{Depth, FrameSubscriber, IsolatedDomain, Participant};
use isochrone_model::{Action, Entry, Hold, Value};
use isochrone_runtime::{End, Node, PrepareError, Running, SendError};
use isochrone_testing::{PATIENCE, wait_until};

const RAMP: &str = r#"
[node]
name = "ramp"
control = "force"
[[task]]
name = "fast"
period = "1ms"
[[input]]
name = "wanted"
type = "INT"
service = "test/wanted"
channel = 0
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
in = { value = "wanted", setChangeRate = 1000 }
[[block]]
name = "scale"
type = "ScaleLinear"
in = { x = 1.0, x1 = 0.0, y1 = 0.0, x2 = 5.0, y2 = 1.0, yMin = -10.0, yMax = 10.0 }
[[output]]
service = "test/out"
signals = ["ramp.delayedValue"]
"#;

fn plan(text: &str) -> Plan {
    Plan::new(Source::new("test.toml", text), &Rules::default()).unwrap()
}

#[test]
fn what_is_set_is_applied_in_a_cycle_that_is_named_without_an_allocation() {
    let prepared = Node::prepare_alone(&plan(RAMP)).unwrap();
    let events = prepared.events();
    let node = prepared.start();
    let mut applied: Vec<Entry> = Vec::new();
    let (mut numbers, mut ran) = (Vec::new(), 0);
    // Cycles that were missed do not count: the costs are those of cycles after the warm-up.
    take_until(&events, |batch| {
        ran += batch.cycles.len();
        applied.extend(batch.applied);
        if let (true, value @ 0..20) = (applied.len() == numbers.len(), numbers.len()) {
            let values = [("wanted", 7.0), ("scale.y1", value as f64)];
            numbers.push(node.set(values).unwrap().number);
        }
        applied.len() == 20 && ran > 150 && node.value("ramp.delayedValue") == Some(7.0)
    });
    assert_eq!(applied.iter().map(|applied| applied.transaction).collect::<Vec<_>>(), numbers);
    assert!(applied.is_sorted_by_key(|applied| applied.cycle), "{applied:?}");
    let befores = applied.iter().map(|applied| applied.changes[0].before);
    assert!(befores.eq([0, 0].into_iter().chain(1..19).map(|n| Value::Number(f64::from(n)))));
    assert_no_allocations(node);
}

fn assert_no_allocations(node: Running) {
    let outcome = node.finish().unwrap();
    assert_eq!(outcome.end, End::Asked);
    assert_eq!(outcome.tasks[0].allocations, Some(0));
}

#[test]
fn a_hundred_requests_a_second_of_every_kind_cost_the_cycle_no_allocation() {
    let node = Node::prepare_alone(&plan(RAMP)).unwrap().start();
    let events = node.events();
    let (mut set, mut forced, mut got, mut taken_back) = (0, 0, 0, 0);
    let (mut applied, mut expired, mut read, mut undone) = (0, 0, 0, 0);
    for turn in 0..200 {
        let value = f64::from(turn);
        let number = node.set([("scale.y1", value), ("scale.yMin", -value)]).unwrap().number;
        set += 1;
        match turn % 4 {
            0 => {
                drop(node.force([("ramp.value", 3.0)], Hold::Seconds(0.005)).unwrap());
                forced += 1;
            }
            1 => drop(node.force([("ramp.error", true)], Hold::UntilReleased).unwrap()),
            2 => drop(node.release(["ramp.error"]).unwrap()),
            _ => {
                drop(node.get(["*.*"]).unwrap());
                got += 1;
            }
        }
        // A hundred turns a second, unless the machine stalls: what has arrived by then ends the turn.
        take_until(&events, |batch| {
            for entry in batch.applied {
                applied += usize::from(entry.action == Action::Set);
                expired += usize::from(entry.action == Action::Expiry);
                undone += usize::from(entry.action == Action::Undo);
            }
            read += batch.readings.len();
            (applied, expired, read, undone) == (set, forced, got, taken_back)
        });
        // The next turn sets the same channels.
        taken_back += usize::from(node.undo(number).is_ok());
    }
    assert_eq!((set, forced, got), (200, 50, 50));
    assert!(undone > 0);
    assert_no_allocations(node);
}

#[test]
fn a_force_holds_an_output_until_its_cycle_which_is_told() {
    let node = Node::prepare_alone(&plan(RAMP)).unwrap().start();
    let events = node.events();
    let number = node.force([("ramp.delayedValue", 5.0)], Hold::Seconds(0.05)).unwrap().number;
    let entries = applied(&events, 2);
    let from = entries[0].cycle;
    assert_eq!((entries[0].action, entries[0].until_cycle), (Action::Force, Some(from + 50)));
    assert_eq!((entries[1].action, entries[1].transaction), (Action::Expiry, number));
    assert!(entries[1].cycle >= from + 50, "{entries:?}");
    assert_eq!(node.journal(0).collect::<Vec<_>>(), entries);
    assert!(node.finish().unwrap().forces.is_empty());
}

#[test]
fn a_node_that_ends_says_what_was_still_forced() {
    let node = Node::prepare_alone(&plan(RAMP)).unwrap().start();
    node.force([("wanted", 5)], Hold::UntilReleased).unwrap();
    wait_until("it is forced", || node.forces().next().is_some());
    let forces = node.finish().unwrap().forces;
    assert_eq!((forces.len(), forces[0].name.as_str()), (1, "wanted"));
}

#[test]
fn values_that_are_read_together_are_never_half_of_a_transaction() {
    let node = Node::prepare_alone(&plan(RAMP)).unwrap().start();
    let events = node.events();
    let (mut readings, mut values) = (0, 0..);
    take_until(&events, |batch| {
        for value in values.by_ref().take(20) {
            let value = f64::from(value);
            match node.set([("scale.y1", value), ("scale.yMin", -value)]) {
                Ok(_) => {}
                Err(SendError::Busy { .. }) => break,
                Err(error) => panic!("{error}"),
            }
            drop(node.get(["scale.y1", "scale.yMin"]));
        }
        for reading in batch.readings {
            let [(_, Value::Number(a)), (_, Value::Number(b))] = reading.values[..] else {
                panic!()
            };
            assert!(a == -b || (a, b) == (0.0, -10.0), "{reading:?}");
            readings += 1;
        }
        readings > 500
    });
}

#[test]
fn a_value_that_cannot_be_set_is_refused_with_the_way_out_and_nothing_is_written() {
    let node = Node::prepare_alone(&plan(RAMP)).unwrap().start();
    let events = node.events();
    let refused = |name: &str, value: f64| {
        let SendError::Refused(refusals) = node.set([("wanted", 5.0), (name, value)]).unwrap_err()
        else {
            panic!()
        };
        refusals.to_string()
    };
    let error = refused("ramp.setChangeRat", 1.0);
    assert!(error.contains("did you mean \"ramp.setChangeRate\"?"), "{error}");
    let error = refused("rmp.setChangeRate", 1.0);
    assert!(error.contains("did you mean \"ramp.setChangeRate\"?"), "{error}");
    assert!(refused("ramp.value", 1.0).contains("is wired to \"wanted\""));
    assert!(refused("ramp.delayedValue", 1.0).contains("is an output pin"));
    for value in [0.5, 40_000.0, f64::NAN] {
        let error = node.set([("wanted", value)]).unwrap_err().to_string();
        assert!(error.contains("is no INT") && error.contains("-32768 to 32767"), "{error}");
    }
    let mut batches = 0;
    take_until(&events, |batch| {
        assert!(batch.applied.is_empty());
        batches += 1;
        batches > 5 && node.value("wanted").is_some()
    });
    assert_eq!(node.value("wanted"), Some(0.0));
}

#[test]
fn a_node_allows_what_its_configuration_says_and_is_fed_all_the_same() {
    for (control, may_set) in [("off", false), ("read", false), ("set", true)] {
        let text = RAMP.replace("\"force\"", &format!("\"{control}\""));
        let node = Node::prepare_alone(&plan(&text)).unwrap().start();
        assert_eq!(node.set([("scale.y1", 1.0)]).is_ok(), may_set, "{control}");
        assert!(node.set([("wanted", 1)]).is_ok());
        let forced = node.force([("scale.y1", 1.0)], Hold::UntilReleased).unwrap_err();
        assert!(forced.to_string().contains("write control = \"force\""), "{forced}");
    }
}

#[test]
fn what_iceoryx2_allocates_for_peers_that_join_is_not_counted_as_the_nodes_own() {
    let domain = IsolatedDomain::new("isort").unwrap();
    let participant = Participant::join("ramp", &domain).unwrap();
    // It sleeps until the release, so that most peers are connected in the cycle.
    let text = RAMP.replace("period = \"1ms\"", "period = \"1ms\"\nwake = \"sleep\"");
    let node = Node::prepare(&plan(&text), participant).unwrap().start();
    let (events, mut ran) = (node.events(), 0);
    take_until(&events, |batch| {
        ran += batch.cycles.len();
        ran > 150
    });
    let peer = Participant::join("peer", &domain).unwrap();
    for _ in 0..20 {
        let mut subscriber = FrameSubscriber::open(&peer, "test/out", 1, Depth::Newest).unwrap();
        // What has a frame was connected.
        wait_until("it has a frame", || {
            subscriber.maintain();
            subscriber.newest(0).is_some()
        });
    }
    let outcome = node.finish().unwrap();
    let task = &outcome.tasks[0];
    assert!(task.connects > Some(0));
    assert_eq!(task.allocations, Some(0));
}

#[test]
fn a_node_that_ends_in_its_warm_up_has_no_costs() {
    let costs = |cycles| {
        let node = Node::prepare_alone(&plan(RAMP)).unwrap().with_cycles(Some(cycles)).start();
        node.wait();
        let task = node.finish().unwrap().tasks.remove(0);
        (task.cpu_fraction, task.allocations, task.minor_faults)
    };
    assert_eq!(costs(100), (None, None, None));
    let (cpu_fraction, allocations, minor_faults) = costs(101);
    assert!(cpu_fraction.is_some_and(|part| part > 0.0));
    assert!(allocations.is_some() && minor_faults.is_some());
}

#[test]
fn an_input_that_is_read_from_a_service_is_not_set() {
    let domain = IsolatedDomain::new("isort").unwrap();
    let participant = Participant::join_local("ramp", &domain).unwrap();
    let node = Node::prepare(&plan(RAMP), participant).unwrap().start();
    let refused = node.set([("wanted", 1.0)]).unwrap_err().to_string();
    let read = "\"wanted\" is an input, which is read from service \"test/wanted\"";
    assert!(refused.contains(read), "{refused}");
}

#[test]
fn a_node_on_local_services_publishes_inside_the_process() {
    let domain = IsolatedDomain::new("isort").unwrap();
    let application = Participant::join_local("application", &domain).unwrap();
    let mut out = FrameSubscriber::open(&application, "test/out", 1, Depth::Newest).unwrap();
    let participant = Participant::join_local("ramp", &domain).unwrap();
    let _node = Node::prepare(&plan(RAMP), participant).unwrap().start();
    wait_until("it has a frame", || out.newest(0).is_some());
    assert!(domain.files().is_empty());
}

#[test]
fn an_output_has_places_for_as_many_readers_as_the_file_says() {
    let domain = IsolatedDomain::new("isort").unwrap();
    let participant = Participant::join("ramp", &domain).unwrap();
    let text = RAMP.replace("[[output]]", "[[output]]\nreaders = 2");
    let _node = Node::prepare(&plan(&text), participant).unwrap().start();
    let peer = Participant::join("peer", &domain).unwrap();
    let join = || FrameSubscriber::open(&peer, "test/out", 1, Depth::Newest);
    let readers = [join().unwrap(), join().unwrap()];
    let refused = join().unwrap_err().to_string();
    assert!(refused.contains("its creator provided 2"), "{refused}");
    drop(readers);
}

#[test]
fn a_second_node_of_a_name_is_told_that_it_runs_already_and_by_whom() {
    let domain = IsolatedDomain::new("isort").unwrap();
    let join = || Participant::join("isochrone/ramp", &domain).unwrap();
    let first = Node::prepare(&plan(RAMP), join()).unwrap();
    let PrepareError::RunsAlready { node, other } = Node::prepare(&plan(RAMP), join()).unwrap_err()
    else {
        panic!()
    };
    assert_eq!(node, "ramp");
    assert!(other.contains(&format!("pid {}", std::process::id())), "{other}");
    drop(first);
    drop(Node::prepare(&plan(RAMP), join()).unwrap());
}

#[test]
fn a_node_that_is_to_run_no_cycles_runs_none() {
    let node = Node::prepare_alone(&plan(RAMP)).unwrap().with_cycles(Some(0)).start();
    node.wait();
    let outcome = node.finish().unwrap();
    assert_eq!((outcome.end, outcome.tasks[0].cycles), (End::Cycles, 0));
}

#[test]
fn a_node_ends_by_itself_after_the_cycles_of_its_first_task() {
    let prepared = Node::prepare_alone(&plan(RAMP)).unwrap().with_cycles(Some(30));
    let events = prepared.events();
    let node = prepared.start();
    let cycles: Vec<_> = events.flat_map(|batch| batch.cycles).collect();
    assert!(!node.is_running() || node.wait_within(PATIENCE));
    let outcome = node.finish().unwrap();
    assert_eq!((outcome.end, cycles.len()), (End::Cycles, 30));
    assert_eq!(outcome.tasks[0].cycles, 30);
}

#[test]
fn a_plan_that_was_changed_into_one_that_cannot_run_is_refused() {
    let changes: [fn(&mut Plan); 2] =
        [|plan| plan.tasks[0].settings.period_ns = 0, |plan| plan.tasks[0].name.push('\0')];
    for change in changes {
        let mut plan = plan(RAMP);
        change(&mut plan);
        assert!(matches!(Node::prepare_alone(&plan), Err(PrepareError::Build(_))));
    }
}

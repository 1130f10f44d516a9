//! Tasks that follow their data, over services of one process.

use crate::happened::take_until;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::{Plan, Rules, Source};
use isochrone_ipc::{
    Depth, FrameLayout, FramePublisher, FrameSubscriber, IsolatedDomain, Participant, SignalSpec,
    Stamp, local,
};
use isochrone_runtime::{Alarm, Node, Outcome, Running};
use isochrone_testing::wait_until;
use isochrone_timing::{Arrivals, LinkReport, Punctuality, TaskReport, warm_up_cycles};

/// Hands on what it follows, and a value beside it.
const RELAY: &str = r#"
[node]
name = "relay"
[[task]]
name = "fast"
period = "10ms"
follow = { service = "test/followed", within = "9ms" }
[[input]]
name = "x"
service = "test/followed"
[[input]]
name = "y"
service = "test/beside"
[[output]]
service = "test/out"
signals = ["x", "y"]
"#;

type Local = local::Service;

fn plan(text: &str) -> Plan {
    Plan::new(Source::new("test.toml", text), &Rules::default()).unwrap()
}

fn start(domain: &IsolatedDomain, text: &str) -> Running {
    let plan = plan(text);
    let participant = Participant::join_local(&plan.node, domain).unwrap();
    Node::prepare(&plan, participant).unwrap().start()
}

/// What telemetry shows of the task's counts.
fn count(node: &Running, of: &str) -> u64 {
    node.value(&format!("task.fast.{of}")).unwrap_or_default() as u64
}

fn report(outcome: &Outcome) -> TaskReport {
    let report = outcome.tasks[0].clone();
    assert_eq!(with_frame(&report) + report.timed_out.unwrap(), report.cycles, "{report:?}");
    report
}

/// Cycles that began with a frame.
fn with_frame(report: &TaskReport) -> u64 {
    report.followed.unwrap() + report.found_ready.unwrap()
}

/// The same as telemetry shows it.
fn count_with_frame(node: &Running) -> u64 {
    count(node, "followed") + count(node, "found_ready")
}

fn followed_link(outcome: &Outcome) -> &LinkReport {
    let mut links = outcome.links.iter();
    links.find(|link| link.service == "test/followed").unwrap()
}

/// What sends frames of one value.
struct Sender(FramePublisher<Local>);

impl Sender {
    fn open(application: &Participant<Local>, service: &str) -> Self {
        let layout =
            FrameLayout { signals: vec![SignalSpec::new("value", "LREAL")], period_ns: None };
        let mut publisher = FramePublisher::open(application, service, &layout).unwrap().plain();
        publisher.prepare();
        Self(publisher)
    }

    fn send(&mut self, value: f64) {
        self.0.maintain();
        self.0.values_mut().unwrap()[0] = value;
        self.0.send(Stamp::default(), || Monotonic.now_ns());
        self.0.prepare();
    }
}

/// What the relay sent last.
struct Answers {
    subscriber: FrameSubscriber<Local>,
    newest: [f64; 2],
}

impl Answers {
    fn open(application: &Participant<Local>) -> Self {
        let subscriber = FrameSubscriber::open(application, "test/out", 2, Depth::Newest).unwrap();
        Self { subscriber, newest: [f64::NAN; 2] }
    }

    fn newest(&mut self) -> [f64; 2] {
        self.subscriber.maintain();
        if let Some(frame) = self.subscriber.newest(Monotonic.now_ns()) {
            self.newest.copy_from_slice(frame.values());
        }
        self.newest
    }
}

#[test]
fn cycles_begin_with_the_frames_that_come() {
    let domain = IsolatedDomain::new("isofol").unwrap();
    let application = Participant::join_local("application", &domain).unwrap();
    let mut source = Sender::open(&application, "test/followed");
    let mut answers = Answers::open(&application);
    let node = start(&domain, RELAY);
    let mut sent = 0u32;
    wait_until("the frames that are wanted came", || {
        if answers.newest()[0] == f64::from(sent) || sent == 0 {
            sent += 1;
            source.send(f64::from(sent));
        }
        count_with_frame(&node) >= 150
    });
    let outcome = node.finish().unwrap();
    let report = report(&outcome);
    let link = followed_link(&outcome);
    assert_eq!(link.lost, 0);
    assert!(link.frames <= sent.into(), "{link:?}");
    assert!(with_frame(&report) <= link.frames, "a cycle takes a frame: {report:?}");
    let latency = report.follow_latency_ns.unwrap();
    assert!(latency.count > 0 && latency.count <= link.frames, "{latency:?}");
    assert_eq!(outcome.tasks[0].allocations, Some(0));
}

#[test]
fn a_cycle_for_which_nothing_comes_begins_when_its_time_is_up() {
    let domain = IsolatedDomain::new("isofol").unwrap();
    let text = RELAY.replace("\"10ms\"", "\"1ms\"").replace("\"9ms\"", "\"300us\"");
    let participant = Participant::join_local("relay", &domain).unwrap();
    let prepared = Node::prepare(&plan(&text), participant).unwrap();
    let node = prepared.with_cycles(Some(200)).start();
    node.wait();
    let report = report(&node.finish().unwrap());
    assert_eq!((report.followed, report.timed_out), (Some(0), Some(200)));
    assert!(report.follow_wait_ns.unwrap().min >= Some(300_000));
    assert_eq!(report.follow_latency_ns.unwrap().count, 0);
    assert_eq!(report.release_jitter_ns.count, 100, "the grid's jitter is measured all the same");
}

#[test]
fn an_input_beside_the_one_that_is_followed_begins_no_cycle_and_is_read_as_ever() {
    let domain = IsolatedDomain::new("isofol").unwrap();
    let application = Participant::join_local("application", &domain).unwrap();
    let mut beside = Sender::open(&application, "test/beside");
    let mut answers = Answers::open(&application);
    let node = start(&domain, RELAY);
    let mut value = 0.0;
    wait_until("the frames that are wanted came", || {
        if answers.newest()[1] == value {
            value += 1.0;
        }
        beside.send(value);
        value >= 10.0 && count(&node, "timed_out") >= 20
    });
    let report = report(&node.finish().unwrap());
    assert_eq!(with_frame(&report), 0, "{report:?}");
}

#[test]
fn a_source_that_ends_and_another_that_comes_leave_the_task_running() {
    let domain = IsolatedDomain::new("isofol").unwrap();
    let application = Participant::join_local("application", &domain).unwrap();
    let node = start(&domain, RELAY);
    for _ in 0..3 {
        let mut source = Sender::open(&application, "test/followed");
        let before = count_with_frame(&node);
        wait_until("the frames that are wanted came", || {
            source.send(1.0);
            count_with_frame(&node) > before + 10
        });
        drop(source);
        let before = count(&node, "timed_out");
        wait_until("the cycles that are wanted ran", || count(&node, "timed_out") > before + 10);
    }
    let outcome = node.finish().unwrap();
    report(&outcome);
    assert_eq!(followed_link(&outcome).restarts, Some(2));
}

#[test]
fn without_services_a_cycle_begins_with_the_value_that_the_program_gives() {
    let node = Node::prepare_alone(&plan(RELAY)).unwrap().start();
    // A value for another input, and one that is read, begin no cycle.
    for _ in 0..20 {
        node.set([("y", 1.0)]).unwrap();
        node.get(["x"]).unwrap();
        let before = count(&node, "timed_out");
        wait_until("the cycles that are wanted ran", || count(&node, "timed_out") > before);
    }
    assert_eq!(count_with_frame(&node), 0);
    for value in 1..=20 {
        node.set([("x", f64::from(value))]).unwrap();
        wait_until("the cycles that are wanted ran", || node.value("x") == Some(f64::from(value)));
    }
    let report = report(&node.finish().unwrap());
    // A value that comes in the instant in which the time is up is taken by that cycle.
    assert!((1..=20).contains(&with_frame(&report)), "{report:?}");
    assert_eq!(report.follow_latency_ns.unwrap().count, 0, "nothing was published");
}

#[test]
fn frames_that_come_after_their_cycles_gave_up_are_named_in_the_end() {
    let domain = IsolatedDomain::new("isofol").unwrap();
    let source = RELAY
        .replace("follow =", "phase = \"6ms\" # follow =")
        .replace("\"relay\"", "\"source\"")
        .replace("test/followed", "test/nothing")
        .replace("test/out", "test/followed");
    let follower = RELAY.replace("\"9ms\"", "\"2ms\"");
    let (source, node) = (start(&domain, &source), start(&domain, &follower));
    let events = node.events();
    let (mut arrivals, mut cycles) = (Arrivals::default(), 0);
    take_until(&events, |batch| {
        for cycle in batch.cycles {
            cycles += 1;
            if cycles > warm_up_cycles(10_000_000) {
                arrivals.record(&cycle.record, &cycle.follow.unwrap(), 10_000_000);
            }
        }
        cycles >= 400
    });
    let outcome = node.finish().unwrap();
    source.finish().unwrap();
    let said = outcome.alarms.iter().find_map(|alarm| match alarm {
        Alarm::LateFrames { task, service, within_ns, late, .. } => {
            assert_eq!((&task[..], &service[..], *within_ns), ("fast", "test/followed", 2_000_000));
            Some(*late)
        }
        _ => None,
    });
    // A machine that keeps the source from its CPU makes its frames come whenever it likes.
    if let Punctuality::Late(late) = arrivals.punctuality(10_000_000) {
        let said = said.unwrap_or_else(|| panic!("{outcome:?}"));
        assert_eq!(said.in_vain.is_some(), late.in_vain.is_some(), "{outcome:?}");
    }
}

#[test]
fn nodes_that_follow_each_other_all_run() {
    let domain = IsolatedDomain::new("isofol").unwrap();
    let back = RELAY
        .replace("\"relay\"", "\"back\"")
        .replace("test/followed", "test/here")
        .replace("test/out", "test/followed")
        .replace("test/here", "test/out");
    let (node, back) = (start(&domain, RELAY), start(&domain, &back));
    wait_until("the frames that are wanted came", || {
        [&node, &back].iter().all(|node| count_with_frame(node) >= 20)
    });
    for node in [node, back] {
        report(&node.finish().unwrap());
    }
}

//! The two processes of a redundant node, as far as one program can be both.

use isochrone_engine::{Plan, Rules, Source};
use isochrone_ipc::{IsolatedDomain, Participant};
use isochrone_model::{AskedBy, Code};
use isochrone_runtime::{ApplyError, IfMissed, Node, Redundancy, Running, TaskCpus, TwinRole};
use isochrone_testing::plants::CLIMB;
use isochrone_testing::wait_until;

fn start(domain: &IsolatedDomain) -> (Running, Redundancy) {
    let plan = Plan::new(Source::new("test.toml", CLIMB), &Rules::default()).unwrap();
    let participant = Participant::join("twin", domain).unwrap();
    let joined = Redundancy::join(&plan, &participant, 1000, || false).unwrap().unwrap();
    let cpus = TaskCpus::of(&plan);
    let node = Node::prepare_redundant(&plan, &cpus, None, participant, &joined).unwrap();
    (node.start(), joined)
}

#[test]
fn a_standby_takes_no_other_configuration_and_leaves_that_of_the_holder_as_it_is() {
    let domain = IsolatedDomain::new("isort").unwrap();
    let (_holder, _) = start(&domain);
    let (standby, joined) = start(&domain);
    wait_until("it stands by", || joined.role() == TwinRole::Standby);
    let text = CLIMB.replace("setChangeRate = 1000.0", "setChangeRate = 1500.0");
    let prepared = standby.prepare_apply(&text, AskedBy::default()).unwrap();
    let Err(ApplyError::Refused(refusal)) = standby.apply(prepared, IfMissed::Allow) else {
        panic!("it took it");
    };
    assert_eq!(refusal.code, Code::CannotChange);
    let says = refusal.to_string();
    assert!(says.contains("holds the node, and this one stands by"), "{says}");
    drop((standby, joined));
    let (_standby, joined) = start(&domain);
    wait_until("another one stands by", || joined.role() == TwinRole::Standby);
}

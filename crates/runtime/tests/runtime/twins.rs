//! The two processes of a redundant node, as far as one program can be both.

use isochrone_engine::{Plan, Rules, Source};
use isochrone_ipc::{Depth, FrameHeader, FrameSubscriber, IsolatedDomain, Participant};
use isochrone_model::{AskedBy, Code};
use isochrone_runtime::{ApplyError, IfMissed, Node, Redundancy, Running, TaskCpus, TwinRole};
use isochrone_testing::plants::CLIMB;
use isochrone_testing::{wait_for_some, wait_until};

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

/// A standby that is late takes over when the holder has begun the next cycle already: both run it, and the holder sent
/// it.
#[test]
fn a_cycle_that_the_other_process_has_claimed_keeps_its_number() {
    let domain = IsolatedDomain::new("isort").unwrap();
    let (_holder, _) = start(&domain);
    let peer = Participant::join("peer", &domain).unwrap();
    let seat = peer.take_seat("level", &["fast", "slow"]).unwrap();
    let mut frames = FrameSubscriber::open(&peer, "level/out", 1, Depth::All).unwrap();
    let mut next = || -> FrameHeader {
        wait_for_some("a frame", || {
            frames.maintain();
            frames.next(0).map(|frame| *frame.header())
        })
    };
    // So far ahead that a busy machine has not run it yet.
    let mut before = next();
    let claimed = before.cycle + 1000;
    assert!(seat.page().claim(seat.places()[0], claimed));
    let after = loop {
        let frame = next();
        if frame.cycle > claimed {
            break frame;
        }
        before = frame;
    };
    let ran = after.cycle - before.cycle - (after.missed - before.missed);
    assert!(ran > 1, "{before:?} {after:?}");
    assert_eq!(after.sequence - before.sequence, ran, "{before:?} {after:?}");
}

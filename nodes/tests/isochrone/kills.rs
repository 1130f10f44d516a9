//! A node that lives on while its peers are killed, at moments that nobody chose.

use std::thread;
use std::time::Duration;

use isochrone_testing::plants::{RELAY, second_relay};
use isochrone_testing::{Domain, Process, volume, wait_until};

/// Milliseconds that look random and are the same every time.
fn moments() -> impl FnMut() -> Duration {
    let mut seed: u64 = 7;
    move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        Duration::from_millis((seed >> 33) % 60)
    }
}

fn descriptors(process: &Process) -> usize {
    std::fs::read_dir(format!("/proc/{}/fd", process.id())).unwrap().count()
}

fn resident_kib(process: &Process) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", process.id())).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    line.split_whitespace().next().unwrap().parse().unwrap()
}

#[test]
fn a_node_whose_peers_are_killed_again_and_again_loses_nothing_and_grows_by_nothing() {
    let domain = Domain::new();
    // Slow enough that the observer loses nothing on a machine that is busy with other tests: it has
    // 200 cycles to look.
    let node = domain.start_node("relay.toml", &RELAY.replace("2ms", "10ms"), "");
    // It reads the relay, so that its death leaves both kinds of ports.
    domain.write("second.toml", second_relay());
    let mut observer = domain.start_until("subscribe relay/out --every 50", "x=");
    let mut moment = moments();
    let mut feed = |value: u64| {
        for arguments in
            [&format!("publish relay/in --value {value}"), "subscribe relay/out", "run second.toml"]
        {
            let victim = domain.start(arguments);
            thread::sleep(moment());
            victim.kill();
        }
        // Whoever comes after them works.
        let publisher = domain.start(&format!("publish relay/in --value {}", value + 1));
        observer.wait_for(&format!("x={}.0", value + 1));
        publisher.kill();
    };
    feed(1_000);
    let before = (descriptors(&node), domain.leftovers().len(), resident_kib(&node));
    let rounds = volume(200) as u64;
    (2..=rounds).for_each(|round| feed(round * 1_000));
    // On a busy machine the node has not let go of the last ones yet, and they left more or less behind. A
    // joiner sweeps: what they left is gone with the next one.
    wait_until(&format!("there are no more than {before:?} descriptors and files"), || {
        domain.run("publish elsewhere --value 1 --count 1").expect_code(0);
        descriptors(&node) <= before.0 + 4 && domain.leftovers().len() <= before.1 + 8
    });
    let after = resident_kib(&node);
    assert!(after <= before.2 + 4_096, "memory: {before:?}, then {after}");
    observer.stop().expect_code(0).says(&[" 0 lost"]);
    node.stop().expect_code(0);
    domain.expect_no_leftovers();
}

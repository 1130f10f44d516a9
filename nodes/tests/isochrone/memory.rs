//! A node while others fill the shared memory.

use std::process::Command;

use isochrone_testing::{Domain, Process, not_tested};

const NODE: &str = r#"
[node]
name = "wide"
[[task]]
name = "t"
period = "1ms"
[[input]]
name = "x"
service = "wide/in"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
count = 100
in = { value = "x", setChangeRate = 1.0 }
[[output]]
service = "wide/out"
signals = [SIGNALS]
"#;

/// In a shared memory of its own: a reader joins, and stops reading, so that the node's next frames
/// are ones that it never wrote to. Then nothing is left for anybody.
const SCENE: &str = r#"
mount -t tmpfs -o size=48m tmpfs /dev/shm || exit 100
"$0" run node.toml --iceoryx2-config domain.toml 2>node.err & node=$!
until grep -q "is running" node.err; do kill -0 $node || { cat node.err >&2; exit 101; }; sleep 0.01; done
"$0" subscribe wide/out --stats --csv reader.csv --iceoryx2-config domain.toml 2>reader.err & reader=$!
rows() { wc -l <reader.csv 2>/dev/null || echo 0; }
until test "$(rows)" -gt 1; do kill -0 $reader || { cat reader.err >&2; exit 102; }; sleep 0.01; done
kill -STOP $reader
cat /dev/zero > /dev/shm/full 2>/dev/null
sleep 1
kill -CONT $reader
kill -TERM $reader
wait $reader || exit 103
kill -TERM $node
wait $node
"#;

const READ_ONLY: &str = r#"
mount -t tmpfs -o ro tmpfs /dev/shm || exit 100
"$0" publish memory/out --value 1 --count 1 --iceoryx2-config domain.toml
"#;

#[test]
fn a_running_node_survives_that_others_fill_the_shared_memory() {
    let mut probe = Command::new("unshare");
    probe.args(["-rm", "mount", "-t", "tmpfs", "tmpfs", "/dev/shm"]);
    if !probe.output().is_ok_and(|probe| probe.status.success()) {
        return not_tested("a full shared memory", "no mount namespace can be had");
    }
    let domain = Domain::new();
    let signals: Vec<_> = (0..100).map(|i| format!("\"ramp.{i}.delayedValue\"")).collect();
    domain.write("node.toml", &NODE.replace("SIGNALS", &signals.join(", ")));
    let mut scene = Command::new("unshare");
    scene.args(["-rm", "sh", "-c", SCENE, env!("CARGO_BIN_EXE_isochrone")]);
    scene.current_dir(domain.path(""));
    Process::start(scene).finish().expect_code(0);
}

#[test]
fn a_shared_memory_that_is_read_only_is_named_with_the_way_out() {
    let mut probe = Command::new("unshare");
    probe.args(["-rm", "mount", "-t", "tmpfs", "tmpfs", "/dev/shm"]);
    if !probe.output().is_ok_and(|probe| probe.status.success()) {
        return not_tested("a read-only shared memory", "no mount namespace can be had");
    }
    let domain = Domain::new();
    let mut scene = Command::new("unshare");
    scene.args(["-rm", "sh", "-c", READ_ONLY, env!("CARGO_BIN_EXE_isochrone")]);
    let ran = scene.current_dir(domain.path("")).output().unwrap();
    let err = String::from_utf8_lossy(&ran.stderr);
    assert_eq!(ran.status.code(), Some(1), "{err}");
    assert!(err.contains("/dev/shm is read-only: mount -o remount,rw /dev/shm"), "{err}");
}

//! A node while others fill the shared memory.

use isochrone_testing::{Domain, Plant, mount_refusal, not_tested};

fn wide() -> Plant {
    let signals: Vec<_> = (0..100).map(|ramp| format!("ramp.{ramp}.delayedValue")).collect();
    Plant::new("wide")
        .task("t", "1ms")
        .input("x", "wide/in", "")
        .ramp("ramp", "value = \"x\", setChangeRate = 1.0")
        .with("count = 100")
        .output("wide/out", &signals)
}

/// In a shared memory of its own: a reader joins, and stops reading, so that the node's next frames
/// are ones that it never wrote to. Then nothing is left for anybody.
const SCENE: &str = r#"
mount -t tmpfs -o size=48m tmpfs /dev/shm || exit 100
"$0" run node.toml 2>node.err & node=$!
until grep -q "is running" node.err; do kill -0 $node || { cat node.err >&2; exit 101; }; sleep 0.01; done
"$0" subscribe wide/out --stats --csv reader.csv 2>reader.err & reader=$!
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
"$0" publish memory/out --value 1 --count 1
"#;

/// Whether a process may have a shared memory of its own; says so where it may not.
fn can_mount(what: &str) -> bool {
    let can = mount_refusal().is_none();
    if !can {
        not_tested(what, "no mount namespace can be had");
    }
    can
}

#[test]
fn a_running_node_survives_that_others_fill_the_shared_memory() {
    if !can_mount("a full shared memory") {
        return;
    }
    let domain = Domain::with(&[("node.toml", &wide())]);
    domain.start_by(&["unshare", "-rm", "sh", "-c", SCENE], "").finish().expect_code(0);
}

#[test]
fn a_shared_memory_that_is_read_only_is_named_with_the_way_out() {
    if !can_mount("a read-only shared memory") {
        return;
    }
    let domain = Domain::new();
    let ended = domain.start_by(&["unshare", "-rm", "sh", "-c", READ_ONLY], "").finish();
    ended.expect_code(1).says(&["/dev/shm is read-only: mount -o remount,rw /dev/shm"]);
}

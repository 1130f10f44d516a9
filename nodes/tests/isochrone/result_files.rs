//! Files of results: the old one is there until the new one is whole.

use std::fs;
use std::process::Command;

use isochrone_testing::plants::{SAW, TANK};
use isochrone_testing::{Domain, Process, mount_refusal, not_tested};
use rustix::process::{Pid, Resource, Rlimit, getrlimit, prlimit};

/// What is in a folder, without what every domain has.
fn names(domain: &Domain) -> Vec<String> {
    let entries = fs::read_dir(domain.path("")).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.filter(|name| name.contains("json")).collect()
}

#[test]
fn a_report_that_finds_no_room_leaves_the_old_one() {
    let domain = Domain::new();
    domain.write("node.json", "old");
    let node = domain.start_node("saw.toml", SAW, "--report node.json");
    let id = Pid::from_raw(node.id() as i32).unwrap();
    let limit = Rlimit { current: Some(100), maximum: getrlimit(Resource::Fsize).maximum };
    prlimit(Some(id), Resource::Fsize, limit).unwrap();
    let ended = node.stop().expect_code(1);
    assert!(ended.stderr.contains("cannot write node.json: File too large"), "{}", ended.stderr);
    assert_eq!(domain.read("node.json"), "old");
    assert_eq!(names(&domain), ["node.json"]);
}

#[test]
fn a_report_whose_writer_is_killed_before_it_is_whole_leaves_the_old_one() {
    if Command::new("strace").arg("--version").output().is_err() {
        return not_tested("a kill before the rename", "strace is not installed");
    }
    let domain = Domain::new();
    domain.write("saw.toml", SAW);
    domain.write("node.json", "old");
    let mut strace = Command::new("strace");
    let kill = "inject=rename,renameat,renameat2:error=EINTR:signal=KILL";
    strace
        .args(["-f", "-e", "trace=rename,renameat,renameat2", "-o"])
        .arg(domain.path("calls"))
        .args(["-e", kill]);
    strace.arg(env!("CARGO_BIN_EXE_isochrone")).args(["run", "saw.toml", "--cycles", "5"]);
    strace.args(["--report", "node.json", "--iceoryx2-config"]).arg(domain.config_file());
    strace.current_dir(domain.path(""));
    let ended = Process::start(strace).finish();
    if ended.stderr.contains("ptrace") {
        return not_tested("a kill before the rename", "processes cannot be traced");
    }
    assert!(!ended.status.success());
    let calls = domain.read("calls");
    let renamed = calls.lines().find(|call| call.contains("rename")).unwrap_or_default();
    assert!(renamed.contains(".node.json.") && renamed.contains("\"node.json\""), "{calls}");
    assert_eq!(domain.read("node.json"), "old");
    domain.run("run saw.toml --cycles 5 --report node.json --take-over").expect_code(0);
    assert_eq!(domain.json("node.json")["tasks"][0]["cycles"], 5);
}

/// A folder that nothing can be made in, and one that is not there.
const READ_ONLY: &str = r#"
domain=$1
refuses() {
    why=$1; shift
    "$0" run tank.toml --iceoryx2-config "$domain" "$@" 2>said && { echo "run $* is accepted" >&2; exit 101; }
    grep -q "$why" said || { echo "run $*:" >&2; cat said >&2; exit 101; }
}
mkdir disk
mount -t tmpfs tmpfs disk || exit 100
echo old >disk/level.mcap
mount -o remount,bind,ro disk || exit 100
refuses 'cannot write disk/level_0002.mcap: Read-only file system' --record disk/level.mcap
refuses 'cannot write disk/new.mcap: Read-only file system' --record disk/new.mcap
refuses 'cannot write disk/new.json: Read-only file system' --report disk/new.json
refuses 'cannot write disk/level.mcap: Read-only file system' --report disk/level.mcap
refuses 'cannot write none/level.mcap: there is no folder none' --record none/level.mcap
refuses 'cannot write none/new.json: there is no folder none' --report none/new.json
refuses 'stands for two results' --report two --record ./two
test "$(ls disk)" = level.mcap || exit 102
"#;

#[test]
fn a_folder_that_cannot_be_written_is_named_before_the_node_starts() {
    if mount_refusal().is_some() {
        return not_tested("a read-only folder", "no mount namespace can be had");
    }
    let domain = Domain::new();
    domain.write("tank.toml", TANK);
    let mut scene = Command::new("unshare");
    scene.args(["-rm", "sh", "-c", READ_ONLY, env!("CARGO_BIN_EXE_isochrone")]);
    scene.arg(domain.config_file());
    scene.current_dir(domain.folder());
    Process::start(scene).finish().expect_code(0);
}

//! What a node says that finds too little of something to start with: descriptors, threads, inodes.

#[path = "isochrone/domain/mod.rs"]
mod domain;

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::Command;

use domain::{Domain, Ended, Process, RELAY, not_tested};

/// A user who runs nothing else.
const SOMEBODY: &str = "65533";

fn domain() -> Domain {
    let domain = Domain::new();
    domain.write("node.toml", RELAY);
    domain
}

/// Adds the command of a node that runs for a moment.
fn run(mut command: Command, program: PathBuf, domain: &Domain) -> Ended {
    command.arg(program).args(["run", "node.toml", "--cycles", "5", "--iceoryx2-config"]);
    command.arg(domain.config_file()).current_dir(domain.path(""));
    Process::start(command).finish()
}

/// It runs, or it says what it has too little of, and leaves nothing behind. Returns whether it said so.
#[track_caller]
fn is_told(domain: &Domain, ended: Ended, why: &str) -> bool {
    assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
    assert_eq!(domain.leftovers(), Vec::<PathBuf>::new());
    if ended.status.success() {
        return false;
    }
    let ended = ended.expect_code(1);
    assert!(ended.stderr.contains(why), "{why}: {}", ended.stderr);
    true
}

#[test]
fn a_node_with_too_few_descriptors_is_told_the_limit_and_how_to_raise_it() {
    let domain = domain();
    let mut told = 0;
    for limit in 8.. {
        let mut shell = Command::new("sh");
        shell.args(["-c", "ulimit -n $0; exec \"$@\"", &limit.to_string()]);
        let ended = run(shell, env!("CARGO_BIN_EXE_isochrone").into(), &domain);
        let why = format!("too many open files: the limit is {limit}, raise it (ulimit -n)");
        if !is_told(&domain, ended, &why) {
            break;
        }
        told += 1;
    }
    assert!((5..60).contains(&told), "{told} limits are too low");
}

#[test]
fn a_node_that_may_start_no_more_threads_is_told_which_limit_to_raise() {
    let what = "a limit of processes";
    if Command::new("setpriv").arg("--version").output().is_err()
        || Command::new("prlimit").arg("--version").output().is_err()
    {
        return not_tested(what, "setpriv or prlimit is not installed");
    }
    let domain = domain();
    let is_root = rustix::process::getuid().is_root();
    // Nothing limits root; and where the program was built, another user may not come.
    let program = domain.path("isochrone");
    fs::copy(env!("CARGO_BIN_EXE_isochrone"), &program).unwrap();
    fs::set_permissions(domain.path(""), Permissions::from_mode(0o777)).unwrap();
    let mut told = 0;
    for limit in 1..=8 {
        let mut command = Command::new(if is_root { "setpriv" } else { "prlimit" });
        if is_root {
            command.args(["--reuid", SOMEBODY, "--regid", SOMEBODY, "--clear-groups", "prlimit"]);
        }
        command.arg(format!("--nproc={limit}"));
        let ended = run(command, program.clone(), &domain);
        told += u32::from(is_told(&domain, ended, "raise the limit of processes (ulimit -u)"));
    }
    assert!(told > 0, "one process was enough for all threads");
}

/// In a shared memory of its own, of whose inodes so many are left.
const FEW_INODES: &str = r#"
mount -t tmpfs -o nr_inodes=30 tmpfs /dev/shm || exit 100
n=0; while touch /dev/shm/used$n 2>/dev/null; do n=$((n+1)); done
left=$0; while test $left -gt 0; do left=$((left-1)); rm /dev/shm/used$left; done
exec "$@"
"#;

#[test]
fn a_node_for_whose_memory_there_are_no_inodes_is_told_what_to_remove() {
    let mut probe = Command::new("unshare");
    probe.args(["-rm", "mount", "-t", "tmpfs", "tmpfs", "/dev/shm"]);
    if !probe.output().is_ok_and(|probe| probe.status.success()) {
        return not_tested("a shared memory without inodes", "no mount namespace can be had");
    }
    let domain = domain();
    let mut told = 0;
    for left in 0..=20 {
        let mut scene = Command::new("unshare");
        scene.args(["-rm", "sh", "-c", FEW_INODES, &left.to_string()]);
        let ended = run(scene, env!("CARGO_BIN_EXE_isochrone").into(), &domain);
        if !is_told(&domain, ended, "the file system of /dev/shm has no inodes left, remove files")
        {
            break;
        }
        told += 1;
    }
    assert!((1..20).contains(&told), "{told} of 20 inodes are too few");
}

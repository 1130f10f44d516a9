//! What a node says that finds too little of something to start with: descriptors, threads, inodes, addresses.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::Command;

use isochrone_testing::plants::RELAY;
use isochrone_testing::{Domain, Ended, Process, is_full_volume, not_tested, program};

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

/// From one limit that is tried to the next.
fn stride() -> usize {
    if is_full_volume() { 1 } else { 5 }
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
    let is_too_low = |limit: &usize| {
        let mut shell = Command::new("sh");
        shell.args(["-c", "ulimit -n $0; exec \"$@\"", &limit.to_string()]);
        let ended = run(shell, program(), &domain);
        let why = format!("too many open files: the limit is {limit}, raise it (ulimit -n)");
        is_told(&domain, ended, &why)
    };
    let enough = (8..).step_by(stride()).find(|limit| !is_too_low(limit)).unwrap();
    assert!((13..68).contains(&enough), "{enough} descriptors are enough");
}

/// Runs a node for a moment under a limit of the shell.
fn run_limited(domain: &Domain, option: &str, limit: u64) -> Ended {
    let mut shell = Command::new("sh");
    shell.args(["-c", "ulimit $0 $1; shift; exec \"$@\"", option, &limit.to_string()]);
    run(shell, program(), domain)
}

#[test]
fn a_node_that_may_make_no_files_of_the_size_of_its_memory_is_told_which_limit_to_raise() {
    let domain = domain();
    // In blocks of 512 bytes; a page is what the smallest files need to hold a sentence.
    let limits = (3..).map(|power| 1 << power);
    let is_too_low =
        |limit: &u64| is_told(&domain, run_limited(&domain, "-f", *limit), "raise it (ulimit -f)");
    let enough = limits.into_iter().find(|limit| !is_too_low(limit)).unwrap();
    assert!((64..1 << 24).contains(&enough), "{enough} blocks are enough");
}

#[test]
fn a_node_with_too_few_addresses_is_told_which_limit_to_raise() {
    let domain = domain();
    let starts = |limit: &u64| {
        let mut shell = Command::new("sh");
        shell.args(["-c", "ulimit -v $0; exec \"$@\"", &limit.to_string()]);
        shell.arg(program()).arg("--version").output().unwrap().status.success()
    };
    let least = (1..).map(|step| step * 4096).find(starts).unwrap();
    let is_too_low = |limit: &u64| {
        let ended = run_limited(&domain, "-v", *limit);
        // Where an allocation of its own fails, the program ends at once, and the next one tidies up.
        ended.stderr.contains("memory allocation of")
            || is_told(&domain, ended, "raise the limit (ulimit -v)")
    };
    let enough = (0..).map(|step| least + step * 2048).find(|limit| !is_too_low(limit)).unwrap();
    assert!(enough > least, "{enough} kB are enough, where {least} start the program");
}

#[test]
fn a_program_runs_on_a_small_stack() {
    let domain = domain();
    for limit in [64, 512] {
        let ended = run_limited(&domain, "-s", limit).expect_code(0);
        assert!(ended.stdout.contains("relay/out"), "{}", ended.stdout);
    }
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
    fs::copy(isochrone_testing::program(), &program).unwrap();
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
    let are_too_few = |left: &usize| {
        let mut scene = Command::new("unshare");
        scene.args(["-rm", "sh", "-c", FEW_INODES, &left.to_string()]);
        let ended = run(scene, program(), &domain);
        is_told(&domain, ended, "the file system of /dev/shm has no inodes left, remove files")
    };
    let enough = (0..=20).step_by(stride()).find(|left| !are_too_few(left)).unwrap();
    assert!(enough > 0, "no inode is enough");
}

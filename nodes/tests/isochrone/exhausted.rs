//! What a node says that finds too little of something to start with: descriptors, threads, inodes, addresses.

use std::fmt::Debug;
use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::Command;

use isochrone_testing::plants::RELAY;
use isochrone_testing::{
    Domain, Ended, Process, is_full_volume, mount_refusal, not_tested, program,
};
use rustix::process::Signal;

/// A user who runs nothing else.
const SOMEBODY: &str = "65533";

fn domain() -> Domain {
    Domain::with(&[("node.toml", RELAY)])
}

/// Adds the command of a node that runs for a moment.
fn run(mut command: Command, program: PathBuf, domain: &Domain) -> Ended {
    command.arg(program).args(["run", "node.toml", "--cycles", "5"]).current_dir(domain.folder());
    command.env("ICEORYX2_CONFIG", domain.config_file());
    Process::start(command).finish()
}

/// From one limit that is tried to the next.
fn stride() -> usize {
    if is_full_volume() { 1 } else { 5 }
}

/// It runs, or it says what it has too little of, and leaves nothing behind. The error is what it said.
#[track_caller]
fn is_enough(domain: &Domain, ended: Ended, why: &str) -> Result<(), String> {
    assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
    assert_eq!(domain.leftovers(), Vec::<PathBuf>::new(), "{}: {}", ended.status, ended.stderr);
    if ended.status.success() {
        return Ok(());
    }
    let ended = ended.expect_code(1).says(&[why]);
    Err(ended.stderr)
}

/// The first limit that is enough.
#[track_caller]
fn first<T: Debug>(
    limits: impl IntoIterator<Item = T>,
    is_enough: impl Fn(&T) -> Result<(), String>,
) -> T {
    let mut last = None;
    for limit in limits {
        match is_enough(&limit) {
            Ok(()) => return limit,
            Err(said) => last = Some((limit, said)),
        }
    }
    panic!("no limit was enough; the last one, and what was said: {last:?}")
}

#[test]
fn a_node_with_too_few_descriptors_is_told_the_limit_and_how_to_raise_it() {
    let domain = domain();
    let enough = first((8..68).step_by(stride()), |limit| {
        let why = format!("too many open files: the limit is {limit}, raise it (ulimit -n)");
        is_enough(&domain, run_limited(&domain, "-n", *limit), &why)
    });
    assert!(enough > 12, "{enough} descriptors are enough");
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
    let enough = first((3..24).map(|power| 1 << power), |limit| {
        is_enough(&domain, run_limited(&domain, "-f", *limit), "raise it (ulimit -f)")
    });
    assert!(enough >= 64, "{enough} blocks are enough");
}

/// Limits of addresses that are tried: a program that a gigabyte does not start is another one than this.
const MOST_STEPS: u64 = 256;

#[test]
fn a_node_with_too_few_addresses_is_told_which_limit_to_raise() {
    let domain = domain();
    let least = first((1..MOST_STEPS).map(|step| step * 4096), |limit| {
        let mut shell = Command::new("sh");
        shell.args(["-c", "ulimit -v $0; exec \"$@\"", &limit.to_string()]);
        let output = shell.arg(program()).arg("--version").output().unwrap();
        if output.status.success() { Ok(()) } else { Err(format!("{output:?}")) }
    });
    let enough = first((0..MOST_STEPS).map(|step| least + step * 2048), |limit| {
        let ended = run_limited(&domain, "-v", *limit);
        // Where an allocation of its own fails, or the stack cannot grow, of which the kernel tells with SIGSEGV
        // alone, the program ends at once. The next one that gets so far tidies up.
        let is_of_stack = ended.status.signal() == Some(Signal::SEGV.as_raw());
        if is_of_stack || ended.stderr.contains("memory allocation of") {
            domain.run("list");
            return Err(ended.stderr);
        }
        is_enough(&domain, ended, "raise the limit (ulimit -v)")
    });
    assert!(enough > least, "{enough} kB are enough, where {least} start the program");
}

#[test]
fn a_node_with_too_little_room_for_data_is_told_which_limit_to_raise() {
    let domain = domain();
    let mut told = 0;
    for step in 1..=8 {
        let ended = run_limited(&domain, "-d", step * 2000);
        if ended.stderr.contains("cannot start ") {
            ended.says(&["raise the limit (ulimit -d)"]);
            told += 1;
        }
    }
    // One whose own allocation fails ends at once. The next one tidies up.
    domain.run("list");
    assert!(told > 0, "no limit kept a thread from starting");
}

#[test]
fn who_receives_nothing_for_a_limit_of_file_sizes_is_told_which_one_to_raise() {
    let domain = Domain::new();
    let _publisher = domain.publish("plant/level --value 1");
    let limited = ["sh", "-c", "ulimit -f 8; exec \"$0\" \"$@\""];
    for verb in ["subscribe plant/level", "record plant/level -o out.mcap"] {
        let ended = domain.start_by(&limited, &format!("{verb} --seconds 1")).finish();
        ended.expect_code(1).says(&["raise it (ulimit -f)"]);
    }
}

#[test]
fn a_program_runs_on_a_small_stack() {
    let domain = domain();
    for limit in [64, 512] {
        run_limited(&domain, "-s", limit).expect_code(0).prints(&["relay/out"]);
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
    let program = domain.copy_program();
    fs::set_permissions(domain.path(""), Permissions::from_mode(0o777)).unwrap();
    let mut told = 0;
    for limit in 1..=8 {
        let mut command = Command::new(if is_root { "setpriv" } else { "prlimit" });
        if is_root {
            command.args(["--reuid", SOMEBODY, "--regid", SOMEBODY, "--clear-groups", "prlimit"]);
        }
        command.arg(format!("--nproc={limit}"));
        let ended = run(command, program.clone(), &domain);
        let is_told =
            is_enough(&domain, ended, "raise the limit of processes (ulimit -u)").is_err();
        told += u32::from(is_told);
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
    if mount_refusal().is_some() {
        return not_tested("a shared memory without inodes", "no mount namespace can be had");
    }
    let domain = domain();
    let enough = first((0..=20).step_by(stride()), |left| {
        let mut scene = Command::new("unshare");
        scene.args(["-rm", "sh", "-c", FEW_INODES, &left.to_string()]);
        let ended = run(scene, program(), &domain);
        is_enough(&domain, ended, "the file system of /dev/shm has no inodes left, remove files")
    });
    assert!(enough > 0, "no inode is enough");
}

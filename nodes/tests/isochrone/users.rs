//! One domain that processes of several users use, one after the other.

use std::fs::{self, Permissions};
use std::os::unix::fs::{PermissionsExt, chown, symlink};
use std::path::PathBuf;
use std::process::Command;

use isochrone_testing::plants::RELAY;
use isochrone_testing::{Domain, Ended, Process, not_tested};
use rustix::fs::{CWD, FileType, mknodat};

const NOBODY: u32 = 65_534;

/// A domain to which anybody may come, with a program that anybody may run: where that was built, another user may
/// not come.
fn open_to_all() -> Domain {
    let domain = Domain::with(&[("node.toml", RELAY)]);
    fs::set_permissions(domain.path(""), Permissions::from_mode(0o777)).unwrap();
    domain.copy_program();
    domain
}

/// Starts a node in the domain, as `nobody` or as root.
fn start(domain: &Domain, is_root: bool, more: &[&str]) -> Process {
    let own = domain.path("isochrone");
    let mut command = Command::new(if is_root { own.as_os_str() } else { "setpriv".as_ref() });
    if !is_root {
        let user = NOBODY.to_string();
        command.args(["--reuid", &user, "--regid", &user, "--clear-groups"]).arg(own);
    }
    command.args(["run", "node.toml"]).args(more).current_dir(domain.folder());
    Process::start(command.env("ICEORYX2_CONFIG", domain.config_file()))
}

/// The same, to the end of the node.
fn run(domain: &Domain, is_root: bool) -> Ended {
    start(domain, is_root, &["--cycles", "20"]).finish()
}

#[test]
fn a_domain_of_another_user_is_refused_by_name_and_left_as_it_is() {
    if !rustix::process::getuid().is_root() {
        return not_tested("a domain of another user", "only root can be several");
    }
    if Command::new("setpriv").arg("--version").output().is_err() {
        return not_tested("a domain of another user", "setpriv is not installed");
    }
    for (owner_is_root, owner, other) in [(false, "(65534)", "(0)"), (true, "(0)", "(65534)")] {
        let domain = open_to_all();
        run(&domain, owner_is_root).expect_code(0);
        domain.expect_no_leftovers();
        run(&domain, !owner_is_root).expect_code(1).says(&[
            owner,
            other,
            "iceoryx2 belongs to user",
            "choose another root-path",
        ]);
        domain.expect_no_leftovers();
        run(&domain, owner_is_root).expect_code(0);
    }
}

#[test]
fn names_in_shared_memory_that_another_user_takes_hinder_nobody_but_the_one_of_the_counter() {
    if !rustix::process::getuid().is_root()
        || Command::new("setpriv").arg("--version").output().is_err()
    {
        return not_tested("names that another user takes", "it takes root and setpriv");
    }
    let domain = open_to_all();
    let mut first = start(&domain, false, &[]);
    first.wait_for("is running");
    let is_takeable = |path: &PathBuf| {
        path.starts_with("/dev/shm") && !path.to_string_lossy().ends_with("global_mgmt")
    };
    let names: Vec<_> = domain.leftovers().into_iter().filter(is_takeable).collect();
    let roots = domain.prefix().to_owned() + "isochrone.roots";
    assert!(names.len() > 3 && names.iter().any(|name| name.ends_with(&roots)), "{names:?}");
    first.stop().expect_code(0);
    domain.expect_no_leftovers();

    // Of root, which nobody else can remove.
    for mode in [0o600, 0o666] {
        for name in &names {
            fs::write(name, [0; 16]).unwrap();
            fs::set_permissions(name, Permissions::from_mode(mode)).unwrap();
        }
        run(&domain, false).expect_code(0);
        assert!(names.iter().all(|name| fs::read(name).unwrap() == [0; 16]));
        names.iter().for_each(|name| fs::remove_file(name).unwrap());
        domain.expect_no_leftovers();
    }
    let theirs = domain.write("theirs", "untouched");
    fs::set_permissions(&theirs, Permissions::from_mode(0o666)).unwrap();
    let link = PathBuf::from("/dev/shm").join(&roots);
    symlink(&theirs, &link).unwrap();
    run(&domain, false).expect_code(0);
    fs::remove_file(&link).unwrap();
    assert_eq!(domain.read("theirs"), "untouched");

    let pipe = link;
    mknodat(CWD, &pipe, FileType::Fifo, 0o666.into(), 0).unwrap();
    fs::set_permissions(&pipe, Permissions::from_mode(0o666)).unwrap();
    run(&domain, false).expect_code(0);
    fs::remove_file(&pipe).unwrap();
}

#[test]
fn a_node_counter_that_another_user_made_beforehand_is_refused_by_name() {
    if !rustix::process::getuid().is_root() {
        return not_tested("a counter of another user", "only root can be several");
    }
    let domain = Domain::with(&[("node.toml", RELAY)]);
    let peer = domain.publish("relay/in --value 1");
    let is_counter = |path: &PathBuf| path.to_string_lossy().ends_with("global_mgmt");
    let counter = domain.leftovers().into_iter().find(is_counter).unwrap();
    assert_eq!(fs::metadata(&counter).unwrap().permissions().mode() & 0o777, 0o600);
    peer.signal(rustix::process::Signal::TERM);
    peer.finish().expect_code(0);

    fs::write(&counter, [0; 16]).unwrap();
    chown(&counter, Some(NOBODY), Some(NOBODY)).unwrap();
    let refused = domain.run("run node.toml --cycles 20").expect_code(1);
    let told = format!("{} belongs to user", counter.display());
    assert!(refused.stderr.contains(&told), "{}", refused.stderr);
    fs::remove_file(&counter).unwrap();
}

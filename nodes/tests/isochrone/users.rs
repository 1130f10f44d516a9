//! One domain that processes of several users use, one after the other.

use std::fs::{self, Permissions};
use std::os::unix::fs::{PermissionsExt, chown};
use std::path::PathBuf;
use std::process::Command;

use isochrone_testing::plants::RELAY;
use isochrone_testing::{Domain, Ended, Process, not_tested};

const NOBODY: u32 = 65_534;

/// Runs a node in the domain to its end, as `nobody` or as root.
fn run(domain: &Domain, is_root: bool, file: &str) -> Ended {
    let program = domain.path("isochrone");
    let mut command = if is_root {
        Command::new(program)
    } else {
        let mut command = Command::new("setpriv");
        let user = NOBODY.to_string();
        command.args(["--reuid", &user, "--regid", &user, "--clear-groups"]).arg(program);
        command
    };
    command.args(["run", file, "--cycles", "20", "--iceoryx2-config"]).arg(domain.config_file());
    command.current_dir(domain.path(""));
    Process::start(command).finish()
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
        let domain = Domain::new();
        domain.write("node.toml", RELAY);
        fs::set_permissions(domain.path(""), Permissions::from_mode(0o777)).unwrap();
        // Where the program was built, another user may not come.
        fs::copy(env!("CARGO_BIN_EXE_isochrone"), domain.path("isochrone")).unwrap();

        run(&domain, owner_is_root, "node.toml").expect_code(0);
        assert_eq!(domain.leftovers(), Vec::<PathBuf>::new());
        let refused = run(&domain, !owner_is_root, "node.toml").expect_code(1);
        for told in [owner, other, "iceoryx2 belongs to user", "choose another root-path"] {
            assert!(refused.stderr.contains(told), "{told}: {}", refused.stderr);
        }
        assert_eq!(domain.leftovers(), Vec::<PathBuf>::new());
        run(&domain, owner_is_root, "node.toml").expect_code(0);
    }
}

#[test]
fn a_node_counter_that_another_user_made_beforehand_is_refused_by_name() {
    if !rustix::process::getuid().is_root() {
        return not_tested("a counter of another user", "only root can be several");
    }
    let domain = Domain::new();
    domain.write("node.toml", RELAY);
    let mut peer = domain.start("publish relay/in --value 1");
    peer.wait_for("publishing");
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

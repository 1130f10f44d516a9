//! One domain that processes of several users use, one after the other.

mod domain;

use std::fs::{self, Permissions};
use std::os::unix::fs::{PermissionsExt, chown};
use std::path::PathBuf;
use std::process::Command;

use domain::{Domain, Ended, Process, not_tested};

const NOBODY: u32 = 65_534;

const NODE: &str = r#"
[node]
name = "relay"
[[task]]
name = "t"
period = "2ms"
[[input]]
name = "x"
service = "relay/in"
[[output]]
service = "relay/out"
signals = ["x"]
"#;

/// Runs a node in the domain to its end, as `nobody` or as root.
fn run(domain: &Domain, is_root: bool, file: &str) -> Ended {
    let program = domain.path("isochrone");
    let mut command = match is_root {
        true => Command::new(program),
        false => {
            let mut command = Command::new("setpriv");
            let user = NOBODY.to_string();
            command.args(["--reuid", &user, "--regid", &user, "--clear-groups"]).arg(program);
            command
        }
    };
    command.args(["run", file, "--cycles", "20", "--iceoryx2-config"]).arg(domain.config_file());
    command.current_dir(domain.path(""));
    Process::start(command).finish()
}

#[test]
fn a_node_run_by_root_leaves_nothing_in_a_domain_of_another_user() {
    if !rustix::process::getuid().is_root() {
        return not_tested("users that take turns", "only root can be several");
    }
    if Command::new("setpriv").arg("--version").output().is_err() {
        return not_tested("users that take turns", "setpriv is not installed");
    }
    for real_time in ["", "priority = 80"] {
        let domain = Domain::new();
        domain.write("ordinary.toml", NODE);
        domain.write("root.toml", &NODE.replace("\"2ms\"", &format!("\"2ms\"\n{real_time}")));
        fs::set_permissions(domain.path(""), Permissions::from_mode(0o755)).unwrap();
        fs::create_dir(domain.path("iceoryx2")).unwrap();
        chown(domain.path("iceoryx2"), Some(NOBODY), Some(NOBODY)).unwrap();
        // Where the program was built, another user may not come.
        fs::copy(env!("CARGO_BIN_EXE_isochrone"), domain.path("isochrone")).unwrap();

        run(&domain, false, "ordinary.toml").expect_code(0);
        run(&domain, true, "root.toml").expect_code(0);
        assert_eq!(domain.leftovers(), Vec::<PathBuf>::new(), "{real_time}");
        run(&domain, false, "ordinary.toml").expect_code(0);
        assert_eq!(domain.leftovers(), Vec::<PathBuf>::new(), "{real_time}");
    }
}

//! The Debian package, installed, upgraded, removed and purged on a machine under systemd. `bash .ci/reach deb` builds it.

use isochrone_testing::{Domain, not_tested, wait_until};

use crate::booted::Machine;

const PROGRAM: &str = r#"
#include <isochrone.h>
int main(void) { return isochrone_now_ns() == 0; }
"#;

/// Everything that has the name of the package, apart from the package itself, and its user.
const TRACES: &str = "find /etc /usr /var /run /dev/shm -xdev -name '*isochrone*' ! -path /var/cache/isochrone.deb | sort
                      getent passwd isochrone || true";

/// How a test of a shell ends.
fn is_so(machine: &Machine, script: &str) -> bool {
    machine.output(&["sh", "-c", script]).unwrap().status.success()
}

#[test]
fn the_package_runs_a_node_lets_it_run_over_an_upgrade_and_keeps_what_is_yours_until_it_is_purged()
{
    let what = "the Debian package";
    let Some(package) = std::env::var_os("ISOCHRONE_TEST_PACKAGE") else {
        return not_tested(what, "ISOCHRONE_TEST_PACKAGE names none: run `bash .ci/reach deb`");
    };
    if !rustix::process::geteuid().is_root() {
        return not_tested(what, "it needs root");
    }
    let domain = Domain::new();
    let Some(machine) = Machine::boot(&domain.path("disk")) else {
        return not_tested(what, "systemd does not boot in namespaces here");
    };
    let file = "/var/cache/isochrone.deb";
    let traces = || machine.run(&["sh", "-c", TRACES]);
    let before = traces();
    machine.put(file, "644", &std::fs::read(package).unwrap());
    machine.run(&["dpkg", "-i", file]);
    machine.run(&["systemctl", "enable", "--now", "isochrone@level"]);
    assert!(machine.plant("list").contains("level"));
    let user = "id -u isochrone; ps -o user= -C isochrone; stat -c '%U:%G %a' /etc/isochrone";
    let of_user = machine.run(&["sh", "-c", user]);
    let of_user: Vec<_> = of_user.lines().collect();
    assert!(of_user[0].parse::<u32>().unwrap() < 1000, "logind spares system users: {of_user:?}");
    assert_eq!(of_user[1..], ["isochrone", "root:isochrone 2775"]);
    machine.plant("set level ramp.setChangeRate=5");
    machine.plant("save level --in-place");

    for (script, says) in [
        ("isochrone-ros2 --version", "isochrone-ros2 "),
        ("man -w isochrone-run", "isochrone-run.1"),
        ("man -w isochrone-ros2", "isochrone-ros2.1"),
        ("pkg-config --modversion isochrone", env!("CARGO_PKG_VERSION")),
        (
            "ls /usr/share/bash-completion/completions /usr/share/zsh/vendor-completions",
            "_isochrone",
        ),
        ("ls /usr/share/doc/isochrone/docs", "service.md"),
    ] {
        let printed = machine.run(&["sh", "-c", script]);
        assert!(printed.contains(says), "{script}: {printed}");
    }
    machine.put("/var/cache/program.c", "644", PROGRAM.as_bytes());
    machine.run(&[
        "sh",
        "-c",
        "cc /var/cache/program.c $(pkg-config --cflags --libs isochrone) -o /var/cache/program && /var/cache/program",
    ]);

    let process = || machine.run(&["systemctl", "show", "-P", "MainPID", "isochrone@level"]);
    let running = process();
    let said = machine.run(&["dpkg", "-i", file]);
    assert!(said.contains("until they are restarted: isochrone@level.service"), "{said}");
    assert_eq!(process(), running);
    machine.run(&["systemctl", "restart", "isochrone@level"]);
    assert_eq!(machine.plant("get level ramp.setChangeRate"), "5\n", "what was saved is read");

    machine.put("/etc/isochrone/mine.toml", "644", b"# A plant of one's own.\n");
    machine.run(&["dpkg", "-r", "isochrone"]);
    wait_until("the node has ended", || !is_so(&machine, "pidof isochrone"));
    assert!(!is_so(&machine, "test -e /usr/bin/isochrone"));
    let kept = "/etc/isochrone/iceoryx2.toml /etc/isochrone/level.toml /var/lib/isochrone/level/level.jsonl";
    machine.run(&["sh", "-c", &format!("ls {kept}")]);

    machine.run(&["dpkg", "-P", "isochrone"]);
    for gone in kept.split(' ').chain(["/var/lib/isochrone", "/run/isochrone"]) {
        assert!(!is_so(&machine, &format!("test -e {gone}")), "{gone}");
    }
    machine.run(&["ls", "/etc/isochrone/mine.toml"]);
    assert!(traces().contains("isochrone:x:"), "it is still somebody's");

    machine.run(&["rm", "-r", "/etc/isochrone"]);
    machine.run(&["dpkg", "-i", file]);
    machine.run(&["systemctl", "start", "isochrone@level"]);
    machine.run(&["systemctl", "stop", "isochrone@level"]);
    machine.run(&["dpkg", "-P", "isochrone"]);
    assert_eq!(traces(), before);
}

//! A machine under systemd, which boots in namespaces of its own, on an overlay of this one.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use isochrone_testing::{Process, wait_for_some, wait_until};

/// The program as the services' user, in their domain.
pub(crate) const AS_USER: &str = "setpriv --reuid isochrone --regid isochrone --init-groups env HOME=/tmp \
                                  ICEORYX2_CONFIG=/etc/isochrone/iceoryx2.toml isochrone";

/// Boots from the folders that stand in the variables. Of this machine it starts no service but those that are part of
/// systemd itself.
const BOOT: &str = r#"
mount --make-rprivate / &&
mount -t overlay overlay -o lowerdir=/,upperdir="$upper",workdir="$work" "$root" &&
mount -t proc proc "$root/proc" && mount -t sysfs sysfs "$root/sys" &&
mount -t tmpfs tmpfs "$root/run" && mount -t tmpfs tmpfs "$root/tmp" &&
mount --rbind /dev "$root/dev" && mount -t tmpfs tmpfs "$root/dev/shm" &&
mount --bind "$units" "$root/etc/systemd/system" &&
mount -t cgroup2 none "$root/sys/fs/cgroup" || exit 77
exec chroot "$root" env -i container=other PATH=/usr/sbin:/usr/bin:/sbin:/bin \
  /lib/systemd/systemd --system --unit=multi-user.target --log-target=null
"#;

/// A machine that can be switched off.
pub(crate) struct Machine {
    disk: PathBuf,
    running: Process,
}

impl Machine {
    /// `None` where such a machine cannot be had.
    pub(crate) fn boot(disk: &Path) -> Option<Self> {
        let mut command = Command::new("unshare");
        command.args(["-pmCuin", "--fork", "--kill-child", "sh", "-c", BOOT]);
        for name in ["upper", "work", "root", "units"] {
            let folder = disk.join(name);
            std::fs::create_dir_all(&folder).unwrap();
            command.env(name, folder);
        }
        let running = Process::start(command);
        let mut machine = Self { disk: disk.to_owned(), running };
        let is_up = wait_for_some("systemd runs or cannot", || {
            if machine.running.is_over() {
                return Some(false);
            }
            let state = machine.output(&["systemctl", "is-system-running"]).ok()?;
            let state = String::from_utf8(state.stdout).unwrap();
            ["running", "degraded"].contains(&state.trim()).then_some(true)
        });
        is_up.then_some(machine)
    }

    /// Its first process.
    fn init(&self) -> Option<String> {
        let id = self.running.id();
        let children = std::fs::read_to_string(format!("/proc/{id}/task/{id}/children")).ok()?;
        children.split_whitespace().next().map(str::to_owned)
    }

    pub(crate) fn command(&self, program: &[&str]) -> Command {
        let mut command = Command::new("nsenter");
        let init = self.init().unwrap_or_default();
        command.args(["-t", &init, "-m", "-p", "-C", "-u", "-i", "-n", "-r", "-w", "env"]);
        command.arg("PATH=/usr/sbin:/usr/bin:/sbin:/bin").args(program).stdin(Stdio::null());
        command
    }

    pub(crate) fn output(&self, program: &[&str]) -> std::io::Result<Output> {
        self.command(program).output()
    }

    #[track_caller]
    pub(crate) fn run(&self, program: &[&str]) -> String {
        let Output { status, stdout, stderr } = self.output(program).unwrap();
        let stderr = String::from_utf8_lossy(&stderr);
        assert!(status.success(), "{program:?}: {stderr}");
        String::from_utf8(stdout).unwrap()
    }

    /// Runs the program as docs/service.md operates a node.
    #[track_caller]
    pub(crate) fn plant(&self, arguments: &str) -> String {
        let words: Vec<_> =
            AS_USER.split_whitespace().chain(arguments.split_whitespace()).collect();
        self.run(&words)
    }

    /// Puts a file into its place.
    #[track_caller]
    pub(crate) fn put(&self, path: &str, mode: &str, bytes: &[u8]) {
        // What is written below the overlay's upper folder would not be seen at once.
        let from = self.disk.join("file");
        std::fs::write(&from, bytes).unwrap();
        let from = std::fs::File::open(from).unwrap();
        let mut install = self.command(&["install", "-m", mode, "/dev/stdin", path]);
        assert!(install.stdin(from).status().unwrap().success(), "{path}");
    }

    /// Switches it off, in order or at once, and on again.
    pub(crate) fn reboot(mut self, in_order: bool) -> Self {
        if in_order {
            // It says nothing any more when it is off.
            let _ = self.output(&["systemctl", "reboot"]);
        } else {
            let init = self.init().unwrap();
            assert!(Command::new("kill").args(["-9", &init]).status().unwrap().success());
        }
        wait_until("the machine is off", || self.running.is_over());
        Self::boot(&self.disk).unwrap()
    }
}

//! A plant under systemd's unit, over reboots: systemd boots in namespaces of its own, on an overlay of this machine.

use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use isochrone_testing::{
    Domain, Process, is_full_volume, not_tested, program, wait_for_some, wait_until,
};
use serde_json::Value;

/// Three inputs with ranges and units, two ramps, a variable, two alarms, a task each of 10 and 100 ms.
const PLANT: &str = r#"
[node]
name = "plant"
control = "force"
retain = true
[[task]]
name = "fast"
period = "10ms"
[[task]]
name = "slow"
period = "100ms"
[[input]]
name = "level"
service = "plant/sensors"
signal = "level"
range = [0.0, 10.0]
unit = "m"
task = "fast"
[[input]]
name = "flow"
service = "plant/sensors"
signal = "flow"
range = [0.0, 50.0]
unit = "l/s"
task = "fast"
[[input]]
name = "temperature"
service = "plant/sensors"
signal = "temperature"
range = [-20.0, 120.0]
unit = "degC"
task = "slow"
[[variable]]
name = "setpoint"
initial = 1.0
unit = "m"
task = "fast"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = "setpoint", setChangeRate = 1000.0 }
[[block]]
name = "heat"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = 1e9, setChangeRate = 1.0 }
[[alarm]]
name = "high_level"
when = "level > 1.6"
for = "100ms"
hysteresis = 0.1
[[alarm]]
name = "hot"
when = "heat.delayedValue > 0.5"
severity = "critical"
[[output]]
service = "plant/out"
task = "fast"
signals = ["ramp.delayedValue", "level", "flow"]
[[output]]
service = "plant/slow"
task = "slow"
signals = ["heat.delayedValue", "temperature"]
"#;

const STATE: &str = "/var/lib/isochrone/plant/plant.state";
const SENSORS: &str =
    "time_s,level [m],flow [l/s],temperature [degC]\n0.0,2.0,7.5,21\n0.01,2.0,7.5,21\n";

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
struct Machine {
    disk: PathBuf,
    running: Process,
}

impl Machine {
    /// `None` where such a machine cannot be had.
    fn boot(disk: &Path) -> Option<Self> {
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

    fn command(&self, program: &[&str]) -> Command {
        let mut command = Command::new("nsenter");
        let init = self.init().unwrap_or_default();
        command.args(["-t", &init, "-m", "-p", "-C", "-u", "-i", "-n", "-r", "-w", "env"]);
        command.arg("PATH=/usr/sbin:/usr/bin:/sbin:/bin").args(program).stdin(Stdio::null());
        command
    }

    fn output(&self, program: &[&str]) -> std::io::Result<Output> {
        self.command(program).output()
    }

    #[track_caller]
    fn run(&self, program: &[&str]) -> String {
        let Output { status, stdout, stderr } = self.output(program).unwrap();
        let stderr = String::from_utf8_lossy(&stderr);
        assert!(status.success(), "{program:?}: {stderr}");
        String::from_utf8(stdout).unwrap()
    }

    /// As docs/service.md operates the node.
    #[track_caller]
    fn plant(&self, arguments: &str) -> String {
        let user = "setpriv --reuid isochrone --regid isochrone --init-groups env HOME=/tmp \
                    ICEORYX2_CONFIG=/etc/isochrone/iceoryx2.toml isochrone";
        let words: Vec<_> = user.split_whitespace().chain(arguments.split_whitespace()).collect();
        self.run(&words)
    }

    #[track_caller]
    fn values(&self, names: &str) -> Vec<f64> {
        let values = self.plant(&format!("get plant {names}"));
        values.lines().map(|line| line.parse().unwrap()).collect()
    }

    /// As docs/service.md installs it.
    fn install(&self) {
        self.run(&[
            "useradd",
            "--system",
            "--no-create-home",
            "--shell",
            "/usr/sbin/nologin",
            "isochrone",
        ]);
        self.run(&["install", "-d", "-g", "isochrone", "-m", "2775", "/etc/isochrone"]);
        let packaging = Path::new(env!("CARGO_MANIFEST_DIR")).join("../packaging");
        let of_packaging = |name| std::fs::read(packaging.join(name)).unwrap();
        for (path, mode, bytes) in [
            ("/usr/bin/isochrone", "755", std::fs::read(program()).unwrap()),
            ("/etc/isochrone/iceoryx2.toml", "644", of_packaging("iceoryx2.toml")),
            ("/etc/isochrone/plant.toml", "644", PLANT.into()),
            ("/etc/isochrone/sensors.csv", "644", SENSORS.into()),
            ("/etc/systemd/system/isochrone@.service", "644", of_packaging("isochrone@.service")),
        ] {
            // What is written below the overlay's upper folder would not be seen at once.
            let from = self.disk.join("file");
            std::fs::write(&from, bytes).unwrap();
            let from = std::fs::File::open(from).unwrap();
            let mut install = self.command(&["install", "-m", mode, "/dev/stdin", path]);
            assert!(install.stdin(from).status().unwrap().success(), "{path}");
        }
        self.run(&["systemctl", "daemon-reload"]);
    }

    fn feed(&self) -> Process {
        let publish = "setpriv --reuid isochrone --regid isochrone --init-groups env HOME=/tmp \
                       ICEORYX2_CONFIG=/etc/isochrone/iceoryx2.toml isochrone \
                       publish plant/sensors --csv /etc/isochrone/sensors.csv --count 1000000";
        let words: Vec<_> = publish.split_whitespace().collect();
        Process::start(self.command(&words).process_group(0))
    }

    /// Switches it off, in order or at once, and on again.
    fn reboot(mut self, in_order: bool) -> Self {
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

#[test]
fn a_plant_under_systemd_goes_on_after_a_reboot_and_after_a_loss_of_power_with_all_but_its_forces()
{
    let what = "a reboot under systemd";
    if !is_full_volume() || !rustix::process::geteuid().is_root() {
        return not_tested(what, "it needs root and ISOCHRONE_TEST_VOLUME=full");
    }
    let domain = Domain::new();
    let Some(mut machine) = Machine::boot(&domain.path("disk")) else {
        return not_tested(what, "systemd does not boot in namespaces here");
    };
    machine.install();
    machine.run(&["systemctl", "enable", "--now", "isochrone@plant"]);
    let feed = machine.feed();
    let alarms = |machine: &Machine| machine.plant("alarms plant --process");
    wait_until("both alarms", || alarms(&machine).matches("unacknowledged").count() == 2);
    machine.plant("set plant setpoint=5.5 heat.setChangeRate=3");
    machine.plant("ack plant high_level");
    machine.plant("force --hold plant ramp.setChangeRate=7");
    wait_until("the ramp has arrived", || machine.values("ramp.delayedValue") == [5.5]);
    drop(feed);

    let retained = |machine: &Machine| -> f64 {
        let state = machine.run(&["isochrone", "state", STATE, "--json"]);
        let state: Value = serde_json::from_str(&state).unwrap();
        state["values"]["heat.delayedValue"].as_f64().unwrap()
    };
    for in_order in [true, false] {
        // An orderly end retains what its last cycle computed, any other what stood in the file.
        let heat =
            if in_order { machine.values("heat.delayedValue")[0] } else { retained(&machine) };
        machine = machine.reboot(in_order);
        let names = "setpoint ramp.delayedValue heat.setChangeRate ramp.setChangeRate level flow temperature";
        assert_eq!(machine.values(names), [5.5, 5.5, 3.0, 1000.0, 2.0, 7.5, 21.0]);
        assert!(machine.values("heat.delayedValue")[0] >= heat, "after {heat}");
        let alarms = alarms(&machine);
        let row = |name| alarms.lines().find(|line| line.starts_with(name)).unwrap();
        assert!(row("high_level").contains("active, acknowledged"), "{alarms}");
        assert!(row("hot").contains("active, unacknowledged"), "{alarms}");
    }
}

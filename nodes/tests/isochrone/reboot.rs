//! A plant under systemd's unit, over reboots.

use std::os::unix::process::CommandExt;
use std::path::Path;

use isochrone_testing::{Domain, Process, is_full_volume, not_tested, program, wait_until};
use serde_json::Value;

use crate::booted::{AS_USER, Machine};

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

/// As docs/service.md installs it without the package.
fn install(machine: &Machine) {
    machine.run(&[
        "useradd",
        "--system",
        "--no-create-home",
        "--shell",
        "/usr/sbin/nologin",
        "isochrone",
    ]);
    machine.run(&["install", "-d", "-g", "isochrone", "-m", "2775", "/etc/isochrone"]);
    let packaging = Path::new(env!("CARGO_MANIFEST_DIR")).join("../packaging");
    let of_packaging = |name| std::fs::read(packaging.join(name)).unwrap();
    for (path, mode, bytes) in [
        ("/usr/bin/isochrone", "755", std::fs::read(program()).unwrap()),
        ("/etc/isochrone/iceoryx2.toml", "644", of_packaging("iceoryx2.toml")),
        ("/etc/isochrone/plant.toml", "644", PLANT.into()),
        ("/etc/isochrone/sensors.csv", "644", SENSORS.into()),
        ("/etc/systemd/system/isochrone@.service", "644", of_packaging("isochrone@.service")),
    ] {
        machine.put(path, mode, &bytes);
    }
    machine.run(&["systemctl", "daemon-reload"]);
}

fn feed(machine: &Machine) -> Process {
    let publish = "publish plant/sensors --csv /etc/isochrone/sensors.csv --count 1000000";
    let words: Vec<_> = AS_USER.split_whitespace().chain(publish.split_whitespace()).collect();
    Process::start(machine.command(&words).process_group(0))
}

fn values(machine: &Machine, names: &str) -> Vec<f64> {
    let values = machine.plant(&format!("get plant {names}"));
    values.lines().map(|line| line.parse().unwrap()).collect()
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
    install(&machine);
    machine.run(&["systemctl", "enable", "--now", "isochrone@plant"]);
    let feed = feed(&machine);
    let alarms = |machine: &Machine| machine.plant("alarms plant --process");
    wait_until("both alarms", || alarms(&machine).matches("unacknowledged").count() == 2);
    machine.plant("set plant setpoint=5.5 heat.setChangeRate=3");
    machine.plant("ack plant high_level");
    machine.plant("force --hold plant ramp.setChangeRate=7");
    wait_until("the ramp has arrived", || values(&machine, "ramp.delayedValue") == [5.5]);
    drop(feed);

    let retained = |machine: &Machine| -> f64 {
        let state = machine.run(&["isochrone", "state", STATE, "--json"]);
        let state: Value = serde_json::from_str(&state).unwrap();
        state["values"]["heat.delayedValue"].as_f64().unwrap()
    };
    for in_order in [true, false] {
        // An orderly end retains what its last cycle computed, any other what stood in the file.
        let heat =
            if in_order { values(&machine, "heat.delayedValue")[0] } else { retained(&machine) };
        machine = machine.reboot(in_order);
        let names = "setpoint ramp.delayedValue heat.setChangeRate ramp.setChangeRate level flow temperature";
        assert_eq!(values(&machine, names), [5.5, 5.5, 3.0, 1000.0, 2.0, 7.5, 21.0]);
        assert!(values(&machine, "heat.delayedValue")[0] >= heat, "after {heat}");
        let alarms = alarms(&machine);
        let row = |name| alarms.lines().find(|line| line.starts_with(name)).unwrap();
        assert!(row("high_level").contains("active, acknowledged"), "{alarms}");
        assert!(row("hot").contains("active, unacknowledged"), "{alarms}");
    }
}

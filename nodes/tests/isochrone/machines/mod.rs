//! Two machines, as far as one can be two: network namespaces with a cable between them, a domain each, and
//! another boot id on the far one where a test wants it.

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

use isochrone_testing::{Domain, Process, not_tested, wait_until};

const PROGRAM: &str = "iox2-link-tunnel-zenoh";
const STEM: &str = "isolink";
/// Capabilities by their numbers: to set up networks, and to mount.
const NEEDED: u64 = 1 << 12 | 1 << 21;

/// A domain in a network namespace.
pub(crate) struct Machine {
    pub(crate) domain: Domain,
    network: String,
    /// The boot id that its processes read, if it has one of its own.
    boot_id: Option<PathBuf>,
}

/// Whose clock the far machine has.
#[derive(Clone, Copy)]
pub(crate) enum Boot {
    /// That of the near one: one-way times can be measured.
    Same,
    Another,
}

/// The near machine at 10.77.0.1 and the far one at 10.77.0.2, with links that carry services.
pub(crate) struct Machines {
    pub(crate) near: Machine,
    pub(crate) far: Machine,
}

impl Machines {
    /// `None`, and a word about it, where this machine cannot be two or the link is not installed.
    pub(crate) fn connect(boot: Boot) -> Option<Self> {
        let may = capabilities() & NEEDED == NEEDED;
        let lacks = if !may {
            Some("it takes the rights of root to set up networks")
        } else if !run("ip", &["-V"]) {
            Some("ip (iproute2) is not installed")
        } else if !can_be_several() {
            Some("no network namespace is to be had")
        } else if link().is_none() {
            Some("iox2-link-tunnel-zenoh is not installed")
        } else {
            None
        };
        if let Some(why) = lacks {
            assert!(!may || std::env::var_os("CI").is_none(), "{why}");
            not_tested("two machines", why);
            return None;
        }
        remove_dead();
        let machines = Self { near: Machine::new("a", None), far: Machine::new("b", Some(boot)) };
        let ends = [(&machines.near, "10.77.0.1/24"), (&machines.far, "10.77.0.2/24")];
        let [near, far] = ends.map(|(machine, _)| machine.network.as_str());
        let pair = [
            "link", "add", "eth0", "netns", near, "type", "veth", "peer", "name", "eth0", "netns",
            far,
        ];
        assert!(run("ip", &pair));
        for (machine, address) in ends {
            let network = machine.network.as_str();
            assert!(run("ip", &["-n", network, "addr", "add", address, "dev", "eth0"]));
            assert!(run("ip", &["-n", network, "link", "set", "eth0", "up"]));
        }
        Some(machines)
    }

    /// The links on both sides, connected and with their ends of the services.
    pub(crate) fn link(&self, services: &str) -> [Process; 2] {
        let link = link().unwrap().display().to_string();
        let start = |machine: &Machine, way: &str| {
            machine.start(&format!("link --link {link} {way} {services}"))
        };
        let mut links =
            [start(&self.near, "--listen 10.77.0.1"), start(&self.far, "--connect 10.77.0.1")];
        links.iter_mut().for_each(|link| link.wait_for("connected with 10.77.0."));
        for machine in [&self.near, &self.far] {
            for service in services.split_whitespace() {
                wait_until("the link reads and writes", || machine.has_link_at(service));
            }
        }
        links
    }
}

impl Machine {
    fn new(side: &str, boot: Option<Boot>) -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let network = format!("{STEM}-{}-{number}{side}", std::process::id());
        assert!(run("ip", &["netns", "add", &network]), "no network namespace to be had");
        let domain = Domain::new();
        let boot_id = matches!(boot, Some(Boot::Another))
            .then(|| domain.write("boot_id", "4a1e0c5e-0000-4000-8000-000000000002\n"));
        Self { domain, network, boot_id }
    }

    /// Whether a link reads and writes a service here.
    fn has_link_at(&self, service: &str) -> bool {
        let listed = self.start("list --json").finish().expect_code(0).json();
        let services = listed["services"].as_array().unwrap();
        let Some(found) = services.iter().find(|found| found["name"] == service) else {
            return false;
        };
        ["publishers", "subscribers"].iter().all(|ends| {
            let mut nodes = found[ends].as_array().unwrap().iter();
            nodes.any(|node| PROGRAM.starts_with(node["program"].as_str().unwrap()))
        })
    }

    /// Starts the program on this machine, in its domain.
    pub(crate) fn start(&self, arguments: &str) -> Process {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", &self.network]).current_dir(self.domain.path(""));
        if let Some(boot_id) = &self.boot_id {
            let mount = "mount --bind \"$0\" /proc/sys/kernel/random/boot_id && exec \"$@\"";
            command.args(["sh", "-c", mount]).arg(boot_id);
        }
        command.arg(env!("CARGO_BIN_EXE_isochrone")).args(arguments.split_whitespace());
        if !arguments.starts_with("check") {
            command.arg("--iceoryx2-config").arg(self.domain.config_file());
        }
        Process::start(command)
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        run("ip", &["netns", "del", &self.network]);
    }
}

/// Whether networks can be made and joined here; containers may have the rights and lack the mounts.
fn can_be_several() -> bool {
    static CAN: OnceLock<bool> = OnceLock::new();
    *CAN.get_or_init(try_to_be_several)
}

fn try_to_be_several() -> bool {
    let network = format!("{STEM}-{}-probe", std::process::id());
    let can = run("ip", &["netns", "add", &network])
        && run("ip", &["netns", "exec", &network, "true"])
        && run(
            "ip",
            &["-n", &network, "link", "add", "eth0", "type", "veth", "peer", "name", "eth1"],
        );
    run("ip", &["netns", "del", &network]);
    can
}

/// Those of tests that were killed.
fn remove_dead() {
    for entry in std::fs::read_dir("/run/netns").into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let pid =
            name.strip_prefix(STEM).and_then(|rest| rest.split('-').nth(1)?.parse::<u32>().ok());
        if pid.is_some_and(|pid| !PathBuf::from(format!("/proc/{pid}")).exists()) {
            run("ip", &["netns", "del", &name]);
        }
    }
}

/// The link's program: where the gate installs it, or on the path.
fn link() -> Option<PathBuf> {
    let tools = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/tools/bin");
    let path = std::env::var_os("PATH").unwrap_or_default();
    let places = [PathBuf::from(tools)].into_iter().chain(std::env::split_paths(&path));
    places.map(|place| place.join(PROGRAM)).find(|program| program.is_file())
}

fn run(program: &str, arguments: &[&str]) -> bool {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

fn capabilities() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let effective = status.lines().find_map(|line| line.strip_prefix("CapEff:")).unwrap();
    u64::from_str_radix(effective.trim(), 16).unwrap()
}

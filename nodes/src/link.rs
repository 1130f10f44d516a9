//! `link`: services of another machine, through iceoryx2's own link.

mod address;
mod connections;
mod folder;
mod output;
mod program;
mod running;
mod way;
mod writers;

use std::io::ErrorKind;
use std::net::TcpListener;
use std::path::PathBuf;

use isochrone_ipc::{KeptService, layout_service_name};
use isochrone_timing::units::counted;

use self::address::{HostPort, Local};
use self::folder::Folder;
use self::running::TunnelProcess;
use self::way::Way;
use self::writers::Writers;
use crate::base::failure::Failure;
use crate::base::{configuration, domain, stop, terminal};

/// Exchange frames with another machine
///
/// Runs iceoryx2's link over zenoh, in this domain, until it is told to end. Start it on both machines with
/// the same services: on one with --listen, on the other with --connect. The frames of the named services
/// cross it in both directions, with the layouts that announce their signals. If the link's program dies, it
/// is started again.
///
/// Nodes cannot be operated through it (`set`, `top` and the like); use ssh for that. Time stamps of another
/// machine do not compare with the clock here: the age of its values counts from their arrival, and there is no
/// one-way latency.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone link --listen 192.168.7.1 plant/level plant/valve\n  \
    isochrone link --connect 192.168.7.1 plant/level plant/valve\n\n\
    The link's program is installed by\n  \
    cargo install iceoryx2-integrations-zenoh-link-tunnel-cli@0.10.0 --locked\n\n\
    Nothing is encrypted, and whoever reaches the port can read and write the services: listen on an address of \
    a network that you trust, go through a VPN or ssh, or name a configuration with TLS (--zenoh).\n\n\
    A service has one link on each machine. To exchange one with several machines, have each of them connect to the \
    one that listens.\n\n\
    Ends with 1 if the link's program ends as soon as it is started, four times in a row, or if another link carries \
    one of the services, and with 2 if the program is not installed."
)]
#[command(group = clap::ArgGroup::new("way").required(true).args(["listen", "connect", "zenoh"]))]
pub(crate) struct Args {
    /// Services to exchange
    #[arg(required = true, value_name = "SERVICE")]
    service: Vec<String>,
    /// Wait for the other machine at this IP address of this one (default port: 7447)
    #[arg(long, value_name = "ADDRESS[:PORT]")]
    listen: Option<Local>,
    /// Connect to the machine that listens; tries again until it answers (default port: 7447)
    #[arg(long, value_name = "HOST[:PORT]")]
    connect: Option<HostPort>,
    /// Connect as a configuration file of zenoh says, for TLS or other transports
    #[arg(long, value_name = "FILE")]
    zenoh: Option<PathBuf>,
    /// Program of the link; default: iox2-link-tunnel-zenoh on the path or beside this program
    #[arg(long, value_name = "PROGRAM")]
    link: Option<PathBuf>,
    /// How often the link looks for new frames, in ms: each look takes CPU time and each frame waits for the
    /// next
    #[arg(long, value_name = "MS", default_value = "1", value_parser = clap::value_parser!(u64).range(1..=100), allow_negative_numbers = true)]
    poll: u64,
    #[command(flatten)]
    domain: domain::Args,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let services = services(&args.service)?;
    let way = way(args)?;
    let program = program::find(args.link.as_deref())?;
    let domain = args.domain.find()?;
    let stop = stop::on_signal(None)?;
    let participant =
        isochrone_ipc::Participant::join("isochrone/link", &domain).map_err(Failure::found)?;
    let (mut kept, mut written) = (Vec::new(), Vec::new());
    let mut allowed = Vec::new();
    for service in &services {
        let opened = KeptService::open(&participant, service).map_err(Failure::found)?;
        if let Some(pid) = opened.other_of_name(&participant).map_err(Failure::found)? {
            return Err(Failure::found(carried_already(service, pid)));
        }
        if let Some(shortfall) = opened.shortfall() {
            terminal::note(&format!(
                "warning: service \"{service}\" loses frames that arrive in a burst: {shortfall}"
            ));
        }
        kept.push(opened);
        written.push(Writers::open(&participant, service)?);
        allowed.extend([service.clone(), layout_service_name(service).map_err(Failure::usage)?]);
    }
    let folder = Folder::create(&domain)?;
    let carried = match services.as_slice() {
        [service] => format!("\"{service}\""),
        services => format!("{} ({})", counted(services.len(), "service"), services.join(", ")),
    };
    terminal::note(&format!("the link {way} and carries {carried}. Press Ctrl-C to end it."));
    let mut link = TunnelProcess::new(program, allowed, args.poll, way, folder);
    while !stop.is_due() {
        link.look_after(&domain, &participant)?;
        written.iter_mut().for_each(|service| service.look(&participant));
        std::thread::sleep(running::LOOK_INTERVAL);
    }
    link.end()
}

/// A second link would send what the first one receives, and the first what the second one receives: in a circle of
/// machines frames would go round for ever.
fn carried_already(service: &str, pid: u32) -> String {
    format!(
        "another `isochrone link` of this domain, process {pid}, carries service \"{service}\" already; a service \
         has one link on each machine. To reach several machines, have each of them connect to this one, which \
         listens"
    )
}

/// The services, each once.
fn services(named: &[String]) -> Result<Vec<String>, Failure> {
    let mut services = Vec::new();
    for service in named {
        configuration::service_name(service)?;
        if service.contains(['*', '?']) {
            return Err(Failure::usage(format!(
                "\"{service}\" has a wildcard: the link would carry every service that it fits; name each \
                 service (`isochrone list --names` shows those that there are)"
            )));
        }
        if let Some(node) = operated_by(service) {
            return Err(Failure::usage(format!(
                "node \"{node}\" is operated by service \"{service}\", which no link carries; use ssh: ssh HOST \
                 isochrone top {node}"
            )));
        }
        if !services.contains(service) {
            services.push(service.clone());
        }
    }
    Ok(services)
}

/// The node that a service operates, if that is what it is for.
fn operated_by(service: &str) -> Option<&str> {
    let node = service.strip_prefix("isochrone/")?.strip_suffix("/control")?;
    (isochrone_control::service_name(node) == service).then_some(node)
}

fn way(args: &Args) -> Result<Way, Failure> {
    match (args.listen, &args.connect, &args.zenoh) {
        (Some(local), ..) => {
            check_free(local)?;
            if local.0.ip().is_unspecified() {
                terminal::note(&format!(
                    "warning: {} is every address of this machine: whoever reaches one of them can read and \
                     write the services; name the address of a network that you trust",
                    local.0.ip()
                ));
            }
            Ok(Way::Listen(local))
        }
        (_, Some(host), _) => Ok(Way::Connect(host.clone())),
        (.., file) => {
            let file = file.as_deref().unwrap_or_else(|| "".as_ref());
            let readable = std::fs::File::open(file).and_then(|_| file.canonicalize());
            readable.map(Way::File).map_err(|cause| {
                Failure::usage(format!("cannot read {}: {cause}; see --zenoh", file.display()))
            })
        }
    }
}

/// The link's program does not say why it cannot listen.
fn check_free(local: Local) -> Result<(), Failure> {
    let why = match TcpListener::bind(local.0).map_err(|cause| (cause.kind(), cause)) {
        Ok(_) => return Ok(()),
        Err((ErrorKind::AddrInUse, _)) => {
            "another program listens there; end it, or name another port on both machines"
                .to_owned()
        }
        Err((ErrorKind::AddrNotAvailable, _)) => {
            "this machine has no such address; `ip address` shows those it has".to_owned()
        }
        Err((ErrorKind::PermissionDenied, _)) => {
            "that takes root below port 1024; name a higher port".to_owned()
        }
        Err((_, cause)) => cause.to_string(),
    };
    Err(Failure::usage(format!("cannot listen on {local}: {why}")))
}

//! Running under a service manager: the state of the node is sent to systemd as described in sd_notify(3).
//!
//! All of it happens in the program's main thread. That also looks at the stop flag, so telling never blocks: what the
//! manager has no room for is told at the next look. (The crate sd-notify 0.5 blocks, and knows no abstract sockets.)

mod progress;

use std::env;
use std::ffi::OsStr;
use std::io::{self, ErrorKind};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::process;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::Plan;
use isochrone_runtime::Running;
use isochrone_timing::CycleRecord;

use self::progress::{Progress, Task};
use crate::base::terminal;

/// The node as a service.
pub(crate) struct Service {
    /// None where people start the node by hand.
    manager: Option<Manager>,
    progress: Progress,
}

impl Service {
    /// Finds the service manager in the environment. `epoch_ns` is when the tasks' grid begins.
    pub(crate) fn find(plan: &Plan, node: &Running) -> Self {
        let variable = |name| env::var_os(name).filter(|value| !value.is_empty());
        let manager = variable("NOTIFY_SOCKET").and_then(|socket| Manager::at(&socket));
        let number = |name| variable(name).and_then(|value| value.to_str()?.parse::<u64>().ok());
        let is_ours = variable("WATCHDOG_PID").is_none()
            || number("WATCHDOG_PID") == Some(process::id().into());
        let watchdog_us = number("WATCHDOG_USEC").filter(|us| *us > 0 && is_ours);
        let epoch_ns = node.epoch_ns();
        let tasks = plan.tasks.iter().zip(node.first_cycles()).map(|(task, first_cycle)| {
            let settings = &task.settings;
            let due_ns = epoch_ns.saturating_add(settings.phase_ns);
            Task::new(settings.period_ns, due_ns, first_cycle)
        });
        Self { manager, progress: Progress::new(tasks.collect(), watchdog_us) }
    }

    /// Notes the newest cycle of a task.
    pub(crate) fn note(&mut self, task: usize, newest: &CycleRecord) {
        self.progress.note(task, newest);
    }

    /// Notes that another process runs the cycles, and that this one is ready to take over or is not.
    pub(crate) fn stand_by(&mut self, is_ready: bool) {
        self.progress.stand_by(is_ready, Monotonic.now_ns());
    }

    /// Tells the manager what it is to know by now; to be called again and again.
    pub(crate) fn tell(&mut self) {
        let Some(manager) = &mut self.manager else { return };
        let now_ns = Monotonic.now_ns();
        let news = self.progress.news(now_ns);
        if news.is_any() && manager.tell(&self.progress.message(news)) {
            self.progress.note_sent(news, now_ns);
        }
    }

    /// Tells that the node is ending. If this is lost, the end itself tells it.
    pub(crate) fn stopping(&mut self) {
        if let Some(manager) = &mut self.manager {
            manager.tell(&format!("STOPPING=1\nSTATUS={}\n", self.progress.status()));
        }
    }
}

/// The manager's end of the line.
struct Manager {
    socket: UnixDatagram,
    address: SocketAddr,
    has_warned: bool,
}

impl Manager {
    fn at(name: &OsStr) -> Option<Self> {
        let opened = Self::open(name);
        opened.map_err(|error| warn(&name.to_string_lossy(), &error)).ok()
    }

    fn open(name: &OsStr) -> io::Result<Self> {
        let address = match name.as_bytes() {
            [b'@', name @ ..] => SocketAddr::from_abstract_name(name)?,
            [b'/', ..] => SocketAddr::from_pathname(name)?,
            // Such as vsock:, for a machine that is the service.
            _ => return Err(io::Error::new(ErrorKind::Unsupported, "neither a path nor abstract")),
        };
        let socket = UnixDatagram::unbound()?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket, address, has_warned: false })
    }

    /// Sends a message; returns whether it went out. Each goes to the address anew, so a manager
    /// that comes back is found again.
    fn tell(&mut self, message: &str) -> bool {
        match self.socket.send_to_addr(message.as_bytes(), &self.address) {
            Ok(_) => true,
            Err(error) if error.kind() == ErrorKind::WouldBlock => false,
            Err(error) => {
                if !std::mem::replace(&mut self.has_warned, true) {
                    warn(&format!("{:?}", self.address), &error);
                }
                false
            }
        }
    }
}

/// The node does its work unwatched, too.
fn warn(socket: &str, error: &io::Error) {
    terminal::note(&format!(
        "warning: the service manager cannot be told anything at {socket}: {error}\n  remedy: \
         unset NOTIFY_SOCKET where nobody listens"
    ));
}

//! The link's program while it runs: started again when it ends, and watched for whom it is connected with.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use isochrone_ipc::{Domain, Participant, ipc};
use isochrone_processes::Child;
use isochrone_timing::units::{counted, duration};

use super::address::HostPort;
use super::connections;
use super::folder::Folder;
use super::output::Output;
use super::way::Way;
use crate::base::failure::Failure;
use crate::base::terminal;

pub(super) const LOOK_INTERVAL: Duration = Duration::from_millis(100);
/// A program that has run this long was started properly.
const WELL: Duration = Duration::from_secs(2);
/// How often it is started before it counts as one that does not work: a node of iceoryx2 may fail to start while
/// others join or leave the domain.
const FIRST_STARTS: u32 = 4;
/// Before it is started again: at first, and at most.
const PAUSE: [Duration; 2] = [Duration::from_millis(100), Duration::from_secs(5)];
/// A connection that lasts for less was none between two links: they give up after 10 s without an answer.
const HANDSHAKE: Duration = Duration::from_secs(12);
/// How long the other side may take to answer before that is reported.
const ANSWER: Duration = Duration::from_secs(3);
/// Between two looks at connections and words.
const NEWS_INTERVAL: Duration = Duration::from_millis(200);
/// Between two warnings about dropped frames.
const DROPS_INTERVAL: Duration = Duration::from_secs(10);

/// The link's program and its state.
pub(super) struct TunnelProcess {
    program: PathBuf,
    services: Vec<String>,
    poll_ms: u64,
    way: Way,
    folder: Folder,
    process: Option<Process>,
    /// Whether it has ever run properly.
    was_well: bool,
    /// How often it has ended, or could not be started, before that.
    failed_starts: u32,
    pause: Duration,
    due: Instant,
    /// Whom it is connected with, and since when.
    far_ends: BTreeMap<SocketAddr, Instant>,
    /// Since when nobody answers; `None` once that was said.
    alone_since: Option<Instant>,
    /// Frames that it dropped, as far as that was not said.
    dropped: u64,
    drops_noted: Option<Instant>,
}

struct Process {
    child: Child,
    output: Output,
    since: Instant,
    looked: Instant,
}

impl TunnelProcess {
    pub(super) fn new(
        program: PathBuf,
        services: Vec<String>,
        poll_ms: u64,
        way: Way,
        folder: Folder,
    ) -> Self {
        let (now, pause) = (Instant::now(), PAUSE[0]);
        let alone_since = Some(now);
        let far_ends = BTreeMap::new();
        Self {
            program,
            services,
            poll_ms,
            way,
            folder,
            process: None,
            was_well: false,
            failed_starts: 0,
            pause,
            due: now,
            far_ends,
            alone_since,
            dropped: 0,
            drops_noted: None,
        }
    }

    /// Starts the program if it does not run, and says what is new.
    ///
    /// # Errors
    /// It cannot be started, or has never run for as long as a program does that works, several times in a row.
    pub(super) fn look_after(
        &mut self,
        domain: &Domain,
        participant: &Participant<ipc::Service>,
    ) -> Result<(), Failure> {
        let Some(process) = &mut self.process else {
            if Instant::now() < self.due {
                return Ok(());
            }
            // Its remains occupy places of publishers, and it does not clean up itself.
            participant.clean_up();
            match self.start(domain) {
                Ok(process) => self.process = Some(process),
                Err(failure) if self.is_final() => return Err(failure),
                Err(failure) => {
                    let why = failure.report().map(ToString::to_string).unwrap_or_default();
                    self.put_off(&why);
                }
            }
            return Ok(());
        };
        if let Some(status) = process.child.ended()? {
            return self.note_end(status);
        }
        if process.since.elapsed() >= WELL {
            (self.was_well, self.pause) = (true, PAUSE[0]);
        }
        if process.looked.elapsed() >= NEWS_INTERVAL {
            process.looked = Instant::now();
            let news = process.output.news();
            news.iter().for_each(|line| tracing::warn!("the link says: {line}"));
            self.dropped += process.output.dropped();
            let pid = process.child.id();
            self.note_connections(pid);
            self.note_dropped(DROPS_INTERVAL);
        }
        Ok(())
    }

    /// Ends the program.
    pub(super) fn end(mut self) -> Result<(), Failure> {
        if let Some(process) = &mut self.process {
            process.child.end()?;
            self.dropped += process.output.dropped();
        }
        self.note_dropped(Duration::ZERO);
        Ok(())
    }

    fn start(&self, domain: &Domain) -> Result<Process, Failure> {
        self.folder.write(domain, &self.way)?;
        let mut child = Child::start_bound("the link", self.program.as_os_str(), |command| {
            command.arg("--reactive").arg("--poll").arg(self.poll_ms.to_string());
            for service in &self.services {
                command.arg("--allow").arg(service);
            }
            command.arg("--zenoh-config").arg(self.folder.zenoh_file(&self.way));
            // A Ctrl-C of the terminal is for us; we end it in order.
            command.current_dir(self.folder.path()).process_group(0);
            command
                .env("IOX2_LOG_LEVEL", "warn")
                .env("RUST_BACKTRACE", "0")
                .env("RUST_LIB_BACKTRACE", "0");
            command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped())
        })?;
        let output = Output::of(&mut child);
        let now = Instant::now();
        tracing::info!("the link runs as process {}", child.id());
        Ok(Process { child, output, since: now, looked: now })
    }

    fn note_end(&mut self, status: ExitStatus) -> Result<(), Failure> {
        let Some(process) = self.process.take() else { return Ok(()) };
        let ran = process.since.elapsed();
        // Its last words may still be on their way.
        thread::sleep(LOOK_INTERVAL);
        let program = self.program.display().to_string();
        let said = process.output.last();
        self.dropped += process.output.dropped();
        if ran < WELL && self.is_final() {
            let see = match &self.way {
                Way::File(file) => format!(
                    "see what zenoh makes of {}: the syntax, the addresses and the paths of its certificates",
                    file.display()
                ),
                Way::Listen(_) | Way::Connect(_) => {
                    "see that it is iceoryx2's link over zenoh 0.10.0".to_owned()
                }
            };
            return Err(Failure::found(format!(
                "{program} ended as soon as it was started ({status}), {FIRST_STARTS} times in a row; {see}{said}"
            )));
        }
        self.put_off(&format!("{program} ended ({status}){said}"));
        self.far_ends.clear();
        self.alone_since = Some(Instant::now());
        Ok(())
    }

    /// Counts a start that came to nothing; whether that was one too many.
    fn is_final(&mut self) -> bool {
        self.failed_starts += 1;
        !self.was_well && self.failed_starts >= FIRST_STARTS
    }

    /// Says why it does not run, and has it started again later.
    fn put_off(&mut self, why: &str) {
        let pause = duration(self.pause.as_secs_f64() * 1e9);
        terminal::note(&format!("warning: {why}\nit is started again in {pause}"));
        self.due = Instant::now() + self.pause;
        self.pause = (2 * self.pause).min(PAUSE[1]);
    }

    fn note_connections(&mut self, pid: u32) {
        let far_ends = connections::of(pid, self.way.port());
        let was_alone = self.far_ends.is_empty();
        self.far_ends.retain(|far_end, since| {
            let is_there = far_ends.contains(far_end);
            if !is_there {
                note_loss(*far_end, since.elapsed());
            }
            is_there
        });
        for far_end in far_ends {
            self.far_ends.entry(far_end).or_insert_with(|| {
                terminal::note(&format!("connected with {far_end}"));
                Instant::now()
            });
        }
        if !self.far_ends.is_empty() {
            self.was_well = true;
            self.alone_since = None;
        } else if !was_alone {
            self.alone_since = Some(Instant::now());
        }
        if self.alone_since.is_some_and(|since| since.elapsed() >= ANSWER) {
            self.alone_since = None;
            self.note_silence();
        }
    }

    /// Says how many frames were dropped, not more often than at an interval.
    fn note_dropped(&mut self, interval: Duration) {
        if self.dropped == 0 || self.drops_noted.is_some_and(|noted| noted.elapsed() < interval) {
            return;
        }
        terminal::note(&format!(
            "warning: the link dropped {} that had arrived: 64 of a service waited already, because its \
             program got too little CPU time",
            counted(std::mem::take(&mut self.dropped), "frame")
        ));
        self.drops_noted = Some(Instant::now());
    }

    fn note_silence(&self) {
        match &self.way {
            Way::Connect(host) => {
                let host = host.clone();
                // To look its name up may take long.
                thread::spawn(move || terminal::note(&silence(&host)));
            }
            Way::Listen(_) => terminal::note("nobody is connected; the link keeps waiting"),
            Way::File(file) => terminal::note(&format!(
                "no TCP connection yet; the link keeps trying. See that the link on the other machine runs, that \
                 no firewall is in the way, and what {} says of addresses and certificates",
                file.display()
            )),
        }
    }
}

fn note_loss(far_end: SocketAddr, after: Duration) {
    let hint = if after < HANDSHAKE {
        "if this goes on, see that a link runs at the other end, over the same transport"
    } else {
        "frames cross again once it is back"
    };
    terminal::note(&format!("warning: the connection with {far_end} is lost; {hint}"));
}

/// Why a host may not answer.
fn silence(host: &HostPort) -> String {
    match host.look_up() {
        Ok(()) => format!(
            "warning: {host} does not answer; the link keeps trying. See that `isochrone link --listen` runs there \
             and that no firewall blocks TCP port {}",
            host.port
        ),
        Err(cause) => format!(
            "warning: {host} cannot be found ({cause}); the link keeps trying. See that the name is right, or give \
             the address"
        ),
    }
}

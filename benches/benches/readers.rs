//! What a reader costs and how soon it sees a frame, for each way to wait.
//!
//! A real-time thread sends at a fixed rate, a reader on another CPU takes the frames. The latency is from
//! `publish_ns` to the reader's clock once it has the frame; the CPU time is that of the reader's thread.
//!
//! - `naps`: the reader sleeps for 100 us between its looks.
//! - `spin`: it never sleeps.
//! - `wait`: it sleeps until the next frame is due (`FrameWait`).
//! - `event`: it blocks in an iceoryx2 listener. The thread that sends must not notify, so an ordinary
//!   thread of its node does, which waits for the frames as `wait` does; its CPU time is shown beside.
//!
//! ```text
//! cargo bench -p isochrone-benches --bench readers -- --rounds 8 --seconds 4
//! ```
//!
//! The arms take turns, forth and back. The machine needs two CPUs, and root or the right to SCHED_FIFO.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use clap::{Parser, ValueEnum};
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::SignalHandlingMode;
use iceoryx2::service::ipc_threadsafe;
use isochrone_benches::{Failure, take_turns, us};
use isochrone_cyclic::{
    Clock, Cyclic, Margin, Monotonic, Pinning, Schedule, ThreadRequest, Wake, prepare_thread,
    thread_usage,
};
use isochrone_ipc::{
    Depth, FrameLayout, FramePublisher, FrameSubscriber, IsolatedDomain, Participant, SignalSpec,
    Stamp, ipc,
};
use isochrone_runtime::FrameWait;
use isochrone_timing::Distribution;

#[derive(Parser)]
struct Args {
    /// Turns of each arm at each rate
    #[arg(long, default_value_t = 8)]
    rounds: usize,
    /// Length of a turn
    #[arg(long, default_value_t = 4.0)]
    seconds: f64,
    /// Frames per second
    #[arg(long, value_delimiter = ',', default_value = "100,1000,4000")]
    rates: Vec<u64>,
    /// Ways to wait
    #[arg(long, value_delimiter = ',', default_value = "naps,spin,wait,event")]
    arms: Vec<Way>,
    /// CPU of the thread that sends
    #[arg(long, default_value_t = 1)]
    cpu: usize,
    /// CPU of the reader, and of the thread that notifies
    #[arg(long, default_value_t = 0)]
    reader_cpu: usize,
    /// Only see whether every arm runs
    #[arg(long)]
    test: bool,
    /// Given by `cargo bench`
    #[arg(long, hide = true)]
    bench: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Way {
    Naps,
    Spin,
    Wait,
    Event,
}

const SERVICE: &str = "bench/frames";
const PRIORITY: u8 = 80;
const NAP: Duration = Duration::from_micros(100);
/// Frames are not counted before connections are made and rhythms learned.
const WARM_UP_NS: u64 = 300_000_000;
/// How long a thread waits before it sees whether the turn is over.
const SLICE: Duration = Duration::from_millis(20);

struct Arm {
    way: Way,
    rate_hz: u64,
    latency: Distribution,
    lost: u64,
    read_ns: u64,
    reader: Spent,
    notifier: Spent,
}

/// What a thread used.
#[derive(Default)]
struct Spent {
    cpu_ns: u64,
    sleeps: u64,
}

impl Spent {
    fn add(&mut self, other: &Self) {
        self.cpu_ns += other.cpu_ns;
        self.sleeps += other.sleeps;
    }
}

fn main() -> Result<(), Failure> {
    let mut args = Args::parse();
    if args.test {
        (args.rounds, args.seconds) = (1, 0.1);
    }
    let mut arms: Vec<Arm> = Vec::new();
    for rate_hz in &args.rates {
        arms.extend(args.arms.iter().map(|way| Arm::new(*way, *rate_hz)));
    }
    take_turns(args.rounds, &mut arms, |arm| arm.turn(&args))?;
    print(&args, &arms);
    Ok(())
}

impl Arm {
    fn new(way: Way, rate_hz: u64) -> Self {
        let latency = Distribution::new();
        let (reader, notifier) = Default::default();
        Self { way, rate_hz: rate_hz.max(1), latency, lost: 0, read_ns: 0, reader, notifier }
    }

    fn turn(&mut self, args: &Args) -> Result<(), Failure> {
        let domain = IsolatedDomain::new("bench")?;
        let over = Arc::new(AtomicBool::new(false));
        let (rate_hz, way) = (self.rate_hz, self.way);
        // There before the other threads join: iceoryx2's own nodes do not wait for those.
        let mut event = (way == Way::Event).then(|| Event::open(&domain)).transpose()?;
        let listener = event.as_mut().and_then(|event| event.listener.take());
        let notifier = event.as_mut().and_then(|event| event.notifier.take());
        let spent = thread::scope(|scope| -> Result<Option<Spent>, Failure> {
            let sender = scope.spawn(|| send(&domain, rate_hz, args.cpu, &over));
            let notify = |notifier| notify(&domain, args.reader_cpu, &over, &notifier);
            let notifier = notifier.map(|notifier| scope.spawn(move || notify(notifier)));
            let reader = scope.spawn(|| self.read(&domain, args, listener));
            let read = reader.join();
            over.store(true, Ordering::Relaxed);
            let sent = sender.join();
            let notified = notifier.map(thread::ScopedJoinHandle::join).transpose();
            let panicked = |_| "a thread panicked";
            read.map_err(panicked)??;
            sent.map_err(panicked)??;
            notified.map_err(panicked)?.transpose()
        })?;
        self.notifier.add(&spent.unwrap_or_default());
        Ok(())
    }

    fn read(
        &mut self,
        domain: &IsolatedDomain,
        args: &Args,
        listener: Option<Listener<Shared>>,
    ) -> Result<(), Failure> {
        on_cpu(args.reader_cpu);
        let participant = Participant::<ipc::Service>::join("reader", domain)?;
        let subscriber = FrameSubscriber::open(&participant, SERVICE, 1, Depth::All)?;
        let mut subscriber = subscriber.for_this_thread();
        let wait = (self.way == Way::Wait).then(FrameWait::in_this_thread);
        let begin_ns = Monotonic.now_ns() + WARM_UP_NS;
        let end_ns = begin_ns + (args.seconds * 1e9) as u64;
        let mut before = None;
        let mut now_ns = Monotonic.now_ns();
        while now_ns < end_ns {
            while let Some(frame) = subscriber.next(now_ns) {
                now_ns = Monotonic.now_ns();
                if before.is_some() {
                    self.latency.record(now_ns.saturating_sub(frame.header().publish_ns));
                }
            }
            if let Some(listener) = &listener {
                listener.timed_wait(|_| {}, SLICE).map_err(|e| format!("the listener: {e}"))?;
            } else if let Some(wait) = &wait {
                wait.sleep_until_ns(subscriber.next_look_ns(Monotonic.now_ns()));
            } else if self.way == Way::Naps {
                thread::sleep(NAP);
            }
            now_ns = Monotonic.now_ns();
            if before.is_none() && now_ns >= begin_ns {
                before = Some((now_ns, thread_usage(), subscriber.counters().lost));
            }
        }
        let Some((began_ns, usage, lost)) = before else { return Ok(()) };
        let used = thread_usage().since(usage);
        self.reader.add(&Spent { cpu_ns: used.cpu_ns, sleeps: used.voluntary_switches });
        self.read_ns += Monotonic.now_ns() - began_ns;
        self.lost += subscriber.counters().lost - lost;
        Ok(())
    }
}

/// Sends at the rate until it is over.
fn send(
    domain: &IsolatedDomain,
    rate_hz: u64,
    cpu: usize,
    over: &Arc<AtomicBool>,
) -> Result<(), Failure> {
    let participant = Participant::<ipc::Service>::join("sender", domain)?;
    let period_ns = 1_000_000_000 / rate_hz;
    let signals = vec![SignalSpec::new("value", "LREAL")];
    let layout = FrameLayout { signals, period_ns: Some(period_ns) };
    let mut publisher = FramePublisher::open(&participant, SERVICE, &layout)?.plain();
    let request = ThreadRequest { priority: Some(PRIORITY), cpu: Pinning::Named(cpu) };
    let grant = prepare_thread(request);
    grant.refusals.iter().for_each(|refusal| eprintln!("{refusal}: {}", refusal.remedy()));
    let schedule = Schedule::every(period_ns, Wake::Hybrid(Margin::DEFAULT));
    let mut cyclic = Cyclic::new(Monotonic, schedule, Monotonic.now_ns() + period_ns, over.clone());
    while let Some(release) = cyclic.wait() {
        let stamp =
            Stamp { cycle: release.cycle, release_ns: release.release_ns, ..Stamp::default() };
        publisher.send(stamp, || Monotonic.now_ns());
        publisher.prepare();
        cyclic.finished(Monotonic.now_ns());
    }
    Ok(())
}

/// What an ordinary thread of the sending node would do: wait for each frame, and wake the readers.
fn notify(
    domain: &IsolatedDomain,
    cpu: usize,
    over: &AtomicBool,
    notifier: &Notifier<Shared>,
) -> Result<Spent, Failure> {
    on_cpu(cpu);
    let participant = Participant::<ipc::Service>::join("notifier", domain)?;
    let subscriber = FrameSubscriber::open(&participant, SERVICE, 1, Depth::Newest)?;
    let mut subscriber = subscriber.for_this_thread();
    let wait = FrameWait::in_this_thread();
    let begin_ns = Monotonic.now_ns() + WARM_UP_NS;
    let mut before = None;
    while !over.load(Ordering::Relaxed) {
        let now_ns = Monotonic.now_ns();
        if before.is_none() && now_ns >= begin_ns {
            before = Some(thread_usage());
        }
        if wait.next(&mut subscriber, now_ns + SLICE.as_nanos() as u64).is_some() {
            notifier.notify().map_err(|e| format!("the notifier: {e}"))?;
        }
    }
    let used = thread_usage().since(before.unwrap_or_default());
    Ok(Spent { cpu_ns: used.cpu_ns, sleeps: used.voluntary_switches })
}

/// Ports that other threads may use than the one that opens them.
type Shared = ipc_threadsafe::Service;

/// The event of the service.
struct Event {
    listener: Option<Listener<Shared>>,
    notifier: Option<Notifier<Shared>>,
    _node: Node<Shared>,
}

impl Event {
    fn open(domain: &IsolatedDomain) -> Result<Self, Failure> {
        let node = NodeBuilder::new()
            .config(domain.config())
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Shared>()
            .map_err(|cause| format!("a node for the event: {cause}"))?;
        let service = node.service_builder(&SERVICE.try_into()?).event().create()?;
        let listener = Some(service.listener_builder().create()?);
        let notifier = Some(service.notifier_builder().create()?);
        Ok(Self { listener, notifier, _node: node })
    }
}

/// Keeps an ordinary thread on a CPU.
fn on_cpu(cpu: usize) {
    let mut set = rustix::thread::CpuSet::new();
    set.set(cpu);
    if let Err(cause) = rustix::thread::sched_setaffinity(None, &set) {
        eprintln!("a thread stays where it is instead of on CPU {cpu}: {cause}");
    }
}

impl fmt::Display for Arm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let quantile = |quantile| us(self.latency.quantile(quantile));
        let cpu = |spent: &Spent| 100.0 * spent.cpu_ns as f64 / self.read_ns.max(1) as f64;
        let sleeps = |spent: &Spent| spent.sleeps as f64 / self.latency.count().max(1) as f64;
        write!(
            f,
            "{:>7}  {:<6}{:>8}{:>6}{:>10}{:>10}{:>10}{:>12}{:>9.2}{:>9.2}",
            self.rate_hz,
            format!("{:?}", self.way).to_lowercase(),
            self.latency.count(),
            self.lost,
            quantile(0.5),
            quantile(0.9),
            quantile(0.99),
            quantile(1.0),
            cpu(&self.reader),
            sleeps(&self.reader),
        )?;
        if self.way == Way::Event {
            write!(f, "{:>9.2}", cpu(&self.notifier))?;
        }
        Ok(())
    }
}

fn print(args: &Args, arms: &[Arm]) {
    println!(
        "from publish to read in us, {} turns of {} s each, alternating; CPU in %",
        args.rounds, args.seconds
    );
    println!(
        "{:>7}  {:<6}{:>8}{:>6}{:>10}{:>10}{:>10}{:>12}{:>9}{:>9}{:>9}",
        "Hz", "", "frames", "lost", "p50", "p90", "p99", "max", "CPU", "sleeps", "notifier"
    );
    arms.iter().for_each(|arm| println!("{arm}"));
    println!("sleeps: per frame");
}

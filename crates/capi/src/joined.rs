//! A participant of a domain, and its ordinary thread.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use isochrone_ipc::{
    FrameLayout, LayoutAnnouncer, LayoutWatcher, OpenError, Participant, RealTime, ToldLayouts, ipc,
};
use nix::sys::signal::{SigSet, SigmaskHow};

/// Between two looks for readers, announcements and failed connections.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// A participant. All ports that were opened with it keep it.
///
/// Its thread does what a port must not do in a cycle: it announces layouts, hears those of others, and makes good
/// failed connections.
pub(crate) struct Joined {
    pub(crate) participant: Arc<RealTime<ipc::Service>>,
    /// `None`: it ends.
    orders: Option<Sender<Order>>,
    thread: Option<JoinHandle<()>>,
    numbers: AtomicU64,
    pub(crate) process: u32,
}

enum Order {
    Begin { number: u64, service: String, work: Work, begun: SyncSender<Result<(), OpenError>> },
    End(u64),
}

/// What the thread is to do for a port.
enum Work {
    Announce(FrameLayout),
    Hear(ToldLayouts),
}

/// What it does, with ports of its own.
enum Task {
    Announcing(LayoutAnnouncer<ipc::Service>),
    Hearing(LayoutWatcher<ipc::Service>, ToldLayouts),
}

/// The work of the thread for a port, which ends with this.
pub(crate) struct Tended {
    number: u64,
    joined: Arc<Joined>,
}

impl Joined {
    pub(crate) fn new(participant: RealTime<ipc::Service>) -> io::Result<Self> {
        let participant = Arc::new(participant);
        let (orders, received) = channel();
        let tended = Arc::clone(&participant);
        // A signal is for a thread of the program: it may interrupt a sleep there.
        let before = SigSet::all().thread_swap_mask(SigmaskHow::SIG_SETMASK)?;
        let thread = thread::Builder::new().name("isochrone".to_owned());
        let thread = thread.spawn(move || tend(&tended, &received));
        before.thread_set_mask()?;
        let numbers = AtomicU64::new(0);
        let (orders, thread, process) = (Some(orders), Some(thread?), std::process::id());
        Ok(Self { participant, orders, thread, numbers, process })
    }

    /// Announces the layout of a service until the result is dropped.
    pub(crate) fn announce(
        self: &Arc<Self>,
        service: &str,
        layout: &FrameLayout,
    ) -> Result<Tended, OpenError> {
        self.begin(service, Work::Announce(layout.clone()))
    }

    /// Tells what is announced of a service until the result is dropped.
    pub(crate) fn hear(
        self: &Arc<Self>,
        service: &str,
        told: &ToldLayouts,
    ) -> Result<Tended, OpenError> {
        self.begin(service, Work::Hear(told.clone()))
    }

    fn begin(self: &Arc<Self>, service: &str, work: Work) -> Result<Tended, OpenError> {
        let number = self.numbers.fetch_add(1, Ordering::Relaxed);
        let (begun, is_begun) = sync_channel(1);
        let order = Order::Begin { number, service: service.to_owned(), work, begun };
        let sent = self.orders.as_ref().is_some_and(|orders| orders.send(order).is_ok());
        let answer = if sent { is_begun.recv().ok() } else { None };
        let ended = || {
            let domain = self.participant.ordinary().domain();
            let cause = "the thread of the participant has ended; join again".to_owned();
            Err(OpenError::Failed { service: service.to_owned(), domain, cause })
        };
        answer.unwrap_or_else(ended)?;
        Ok(Tended { number, joined: Arc::clone(self) })
    }
}

impl Drop for Joined {
    fn drop(&mut self) {
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            // Of a panic it has spoken itself.
            let _ = thread.join();
        }
    }
}

impl Drop for Tended {
    fn drop(&mut self) {
        if let Some(orders) = &self.joined.orders {
            let _ = orders.send(Order::End(self.number));
        }
    }
}

/// The thread.
fn tend(participant: &RealTime<ipc::Service>, orders: &Receiver<Order>) {
    let ordinary = participant.ordinary();
    let mut tasks: Vec<(u64, Task)> = Vec::new();
    loop {
        match orders.recv_timeout(LOOK_INTERVAL) {
            Ok(Order::Begin { number, service, work, begun }) => {
                let task = Task::begin(ordinary, &service, work);
                let _ = begun.send(task.map(|task| tasks.push((number, task))));
            }
            Ok(Order::End(number)) => {
                let ending = tasks.extract_if(.., |(of, _)| *of == number);
                ending.for_each(|(_, task)| task.end(ordinary));
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
        tasks.iter_mut().for_each(|(_, task)| task.tend(ordinary));
        participant.tend();
    }
}

impl Task {
    fn begin(
        participant: &Participant<ipc::Service>,
        service: &str,
        work: Work,
    ) -> Result<Self, OpenError> {
        Ok(match work {
            Work::Announce(layout) => Self::Announcing(LayoutAnnouncer::open(
                participant,
                service,
                participant.name(),
                &layout,
            )?),
            Work::Hear(told) => Self::Hearing(LayoutWatcher::open(participant, service)?, told),
        })
    }

    fn end(self, participant: &Participant<ipc::Service>) {
        // For a reader that came just now: it may have been given frames.
        if let Self::Announcing(mut announcer) = self {
            announcer.tend_at_end(participant);
        }
    }

    fn tend(&mut self, participant: &Participant<ipc::Service>) {
        match self {
            Self::Announcing(announcer) => announcer.tend(participant),
            Self::Hearing(watcher, told) => {
                if watcher.look(participant) {
                    told.tell(watcher);
                }
            }
        }
    }
}

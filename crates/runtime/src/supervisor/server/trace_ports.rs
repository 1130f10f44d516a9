//! The services of traces. A thread of their own takes rows out of the rings of the cycles and publishes each as a
//! frame.
//!
//! The supervisor cannot do that. Opening a service waits for the lock of the domain, which a process that starts
//! holds, for as long as it is stopped if it is, and a port stays in the thread that opened it. Also, rows that
//! waited during a search of names by the supervisor would reach a reader faster than it can take them.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    FrameLayout, FramePublisher, LayoutAnnouncer, OpenError, RealTime, Service, Stamp,
};

use crate::rows::{self, RowReceiver};
use crate::timing_channels;
use crate::traces::Tracer;

/// Between two looks at the rings.
const TURN: Duration = Duration::from_millis(5);
/// The same after a look that did not take all rows.
const SHORT_TURN: Duration = Duration::from_millis(2);
/// Frames that may wait for a reader: at 4 kHz, for 128 ms.
const WAITING_FRAMES: usize = 512;
/// The most rows that are published at a time, so that a reader that looks in between loses none.
const BURST: usize = WAITING_FRAMES / 2;
/// The time that a ring holds, unless that takes too much memory.
const RING_NS: u64 = 1_000_000_000;
const RING_BYTES: usize = 4 << 20;

/// A request to open a trace.
pub(super) struct Opening {
    pub(super) number: u64,
    pub(super) service: String,
    pub(super) node: String,
    /// The channels of the timing, then the signals.
    pub(super) layout: FrameLayout,
    pub(super) period_ns: u64,
    /// The slots of the signals.
    pub(super) slots: Box<[usize]>,
}

/// The result: the tracer for the cycle, or why there is none.
pub(super) struct OpenedTrace {
    pub(super) number: u64,
    pub(super) tracer: Result<Box<Tracer>, OpenError>,
}

/// Opens traces on request and publishes them, until no more requests can come.
pub(super) fn publish<S: Service>(
    participant: &RealTime<S>,
    jobs: &Receiver<Opening>,
    tell: &Sender<OpenedTrace>,
) {
    let mut open: Vec<Ports<S>> = Vec::new();
    let mut turn = TURN;
    loop {
        let job = if open.is_empty() {
            jobs.recv().map_err(RecvTimeoutError::from)
        } else {
            jobs.recv_timeout(turn)
        };
        match job {
            Ok(opening) => {
                let number = opening.number;
                let opened = Ports::open(participant, opening);
                let tracer = opened.map(|(ports, tracer)| {
                    open.push(ports);
                    tracer
                });
                let _ = tell.send(OpenedTrace { number, tracer });
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                open.iter_mut().for_each(|ports| while !ports.publish() {});
                return;
            }
        }
        let mut is_done = true;
        for ports in &mut open {
            ports.tend(participant);
            is_done &= ports.publish();
        }
        turn = if is_done { TURN } else { SHORT_TURN };
        open.retain(|ports| !ports.rows.is_over());
    }
}

/// The service of a trace.
struct Ports<S: Service> {
    rows: RowReceiver,
    row: Box<[f64]>,
    publisher: FramePublisher<S>,
    announcer: LayoutAnnouncer<S>,
}

impl<S: Service> Ports<S> {
    fn open(participant: &RealTime<S>, opening: Opening) -> Result<(Self, Box<Tracer>), OpenError> {
        let Opening { number, service, node, layout, period_ns, slots } = opening;
        let participant = participant.ordinary();
        let publisher =
            FramePublisher::open_with_room(participant, &service, &layout, WAITING_FRAMES)?;
        let announcer = LayoutAnnouncer::open(participant, &service, &node, &layout)?;
        let width = slots.len();
        let count = rows::rows_within(RING_NS, period_ns, width, RING_BYTES);
        let (sender, rows) = rows::ends(width, count);
        let row = vec![0.0; width].into();
        let tracer = Box::new(Tracer::new(number, slots, sender));
        Ok((Self { rows, row, publisher, announcer }, tracer))
    }

    /// Connects to readers, and tells new ones the layout.
    fn tend(&mut self, participant: &RealTime<S>) {
        self.announcer.tend(participant.ordinary());
        self.publisher.prepare();
    }

    /// Publishes waiting rows, up to the most at a time; whether those were all.
    fn publish(&mut self) -> bool {
        for _ in 0..BURST {
            let Some(cycle) = self.rows.pop(&mut self.row) else { return true };
            if let Some(channels) = self.publisher.values_mut() {
                let timing = channels.len() - self.row.len();
                let (timing, signals) = channels.split_at_mut(timing);
                timing
                    .iter_mut()
                    .zip(timing_channels::values(&cycle))
                    .for_each(|(to, value)| *to = value);
                signals.copy_from_slice(&self.row);
            }
            let record = cycle.record;
            let stamp = Stamp {
                cycle: record.cycle,
                release_ns: record.release_ns,
                missed: record.missed,
                ..Stamp::default()
            };
            // A reader notices a missing frame by the cycle numbers.
            self.publisher.send(stamp, || Monotonic.now_ns());
            self.publisher.prepare();
        }
        false
    }
}

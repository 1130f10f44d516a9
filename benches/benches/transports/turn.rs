//! One turn, as each of the two processes sees it.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use isochrone_benches::Failure;
use isochrone_cyclic::{Clock, Cyclic, Margin, Monotonic, Schedule, Wake};
use isochrone_timing::Distribution;

use crate::message::{END, Wire, read, room, write};

/// Half of the time there and back, after the warm-up. Nothing is lost: the bench would not end.
pub(crate) fn ping(
    wire: &mut dyn Wire,
    values: usize,
    from_ns: u64,
    end_ns: u64,
    samples: &mut Distribution,
) -> Result<u64, Failure> {
    let (mut words, mut back) = (room(values), room(values));
    let mut sequence = 0;
    let mut now_ns = Monotonic.now_ns();
    while now_ns < end_ns {
        let sent_ns = Monotonic.now_ns();
        write(&mut words, sequence, sent_ns);
        wire.send(&words)?;
        wire.receive(&mut back)?;
        let returned = read(&back)?;
        now_ns = Monotonic.now_ns();
        if returned.0 != sequence {
            return Err(format!("message {} came back instead of {sequence}", returned.0).into());
        }
        sequence += 1;
        if sent_ns >= from_ns {
            samples.record(now_ns.saturating_sub(sent_ns) / 2);
        }
    }
    write(&mut words, END, sequence);
    wire.send(&words)?;
    Ok(0)
}

/// Sends every message back until the turn is over.
pub(crate) fn echo(wire: &mut dyn Wire, values: usize) -> Result<(), Failure> {
    let mut words = room(values);
    loop {
        wire.receive(&mut words)?;
        match read(&words)? {
            (END, _) => return Ok(()),
            (sequence, sent_ns) => write(&mut words, sequence, sent_ns),
        }
        wire.send(&words)?;
    }
}

/// From just before the values are written until they all are read, after the warm-up. Returns how
/// many messages were lost.
pub(crate) fn receive(
    wire: &mut dyn Wire,
    values: usize,
    from_ns: u64,
    samples: &mut Distribution,
) -> Result<u64, Failure> {
    let mut words = room(values);
    let mut lost = 0;
    let mut next = 0;
    loop {
        wire.receive(&mut words)?;
        let received = read(&words)?;
        let now_ns = Monotonic.now_ns();
        let (sequence, sent_ns) = match received {
            (END, sent) => {
                return Ok(lost + sent.saturating_sub(next));
            }
            message => message,
        };
        if sent_ns >= from_ns {
            lost += sequence.saturating_sub(next);
            samples.record(now_ns.saturating_sub(sent_ns));
        }
        next = sequence + 1;
    }
}

/// Sends at absolute instants.
pub(crate) fn send(
    wire: &mut dyn Wire,
    values: usize,
    period_ns: u64,
    start_ns: u64,
    end_ns: u64,
) -> Result<(), Failure> {
    let schedule = Schedule::every(period_ns, Wake::Hybrid(Margin::default()));
    let stop = Arc::new(AtomicBool::new(false));
    let mut cyclic = Cyclic::new(Monotonic, schedule, start_ns, stop);
    let mut words = room(values);
    let mut sequence = 0;
    while cyclic.wait().is_some_and(|release| release.release_ns < end_ns) {
        write(&mut words, sequence, Monotonic.now_ns());
        wire.send(&words)?;
        sequence += 1;
    }
    write(&mut words, END, sequence);
    wire.send(&words)
}

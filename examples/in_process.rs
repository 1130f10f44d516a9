//! Frames between two threads of one process: the same ports as between processes, only the
//! service variant differs.
//!
//! With `local::Service` nothing leaves the process. Write `ipc::Service` instead (and start the
//! two ends as two programs), and the same lines talk through shared memory.
//!
//! ```text
//! cargo run --release -p isochrone-examples --bin in_process
//! ```
#![allow(clippy::print_stdout, reason = "showing values is what this program is for")]

use std::error::Error;
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Depth, Domain, FrameLayout, FramePublisher, FrameSubscriber, Participant, SignalSpec, Stamp,
    local,
};

const FRAMES: u64 = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let participant = Participant::<local::Service>::join("in_process", &Domain::find()?)?;
    // What a frame holds. Between processes a LayoutAnnouncer tells the readers; here both ends know.
    let signals = ["level", "level_in_percent"].map(|name| SignalSpec::new(name, "LREAL"));
    let layout = FrameLayout { signals: signals.into(), period_ns: Some(1_000_000) };
    // Either end may come first. The reader does here, so that it misses no frame.
    let mut subscriber = FrameSubscriber::open(&participant, "plant/level", 2, Depth::All)?;

    thread::scope(|scope| {
        let writer = scope.spawn(|| publish(&participant, &layout).map_err(|e| e.to_string()));
        loop {
            let last_look = writer.is_finished();
            while let Some(frame) = subscriber.next(Monotonic.now_ns()) {
                // The values stand where the writer put them: nothing was copied.
                let (header, values) = (frame.header(), frame.values());
                println!("frame {} of cycle {}: {values:?}", header.sequence, header.cycle);
            }
            if last_look {
                break;
            }
            thread::sleep(Duration::from_millis(1));
        }
        writer.join().map_err(|_| "the writer panicked")?
    })?;
    let counters = subscriber.counters();
    println!("received {}, errors {}", counters.received, counters.receive_errors);
    Ok(())
}

fn publish(
    participant: &Participant<local::Service>,
    layout: &FrameLayout,
) -> Result<(), Box<dyn Error>> {
    // A port belongs to the thread that opens it.
    let mut publisher = FramePublisher::open(participant, "plant/level", layout)?.plain();
    for cycle in 0..FRAMES {
        let release_ns = Monotonic.now_ns();
        if let Some([level, percent]) = publisher.values_mut() {
            *level = 0.425 * cycle as f64;
            *percent = *level / 1.7 * 100.0;
        }
        let stamp = Stamp { cycle, release_ns, ..Stamp::default() };
        if !publisher.send(stamp, || Monotonic.now_ns()) {
            return Err(format!("frame {cycle} was not sent: {:?}", publisher.counters()).into());
        }
        // The slack of the cycle: get the next frame ready, so that sending it is quick.
        publisher.prepare();
        thread::sleep(Duration::from_millis(1));
    }
    Ok(())
}

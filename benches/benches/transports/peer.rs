//! The process at the other end, and how it is led.

use std::io::{BufRead, BufReader, Write, stdin, stdout};
use std::process::{ChildStdin, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use isochrone_benches::Failure;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_processes::Child;

use crate::{cpu, turn, watchdog};

/// How much longer than planned a turn may take.
const PATIENCE: Duration = Duration::from_secs(10);
/// What the peer says when it has opened its end, and after each turn.
const DONE: &str = "done\n";

/// A turn for the peer.
pub(crate) struct Order {
    pub(crate) start_ns: u64,
    pub(crate) end_ns: u64,
    /// 0: send back what comes.
    pub(crate) period_ns: u64,
}

/// The peer, as the measuring process sees it; killed when dropped.
pub(crate) struct Peer {
    child: Child,
    orders: Option<ChildStdin>,
    replies: BufReader<ChildStdout>,
    watched: Option<Arc<AtomicBool>>,
}

impl Peer {
    /// Starts it, and waits until its end is open.
    pub(crate) fn start(arm: &str, place: &str, values: usize) -> Result<Self, Failure> {
        let mut command = Command::new(std::env::current_exe()?);
        command.args(["peer", arm, place, &values.to_string()]);
        let piped = command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = Child::start("the peer", piped)?;
        let orders = child.stdin();
        let replies = BufReader::new(child.stdout().ok_or("the peer has no stdout")?);
        let mut peer = Self { child, orders, replies, watched: None };
        peer.finish()?;
        Ok(peer)
    }

    /// Orders a turn.
    pub(crate) fn order(&mut self, order: &Order) -> Result<(), Failure> {
        let planned_ns = order.end_ns.saturating_sub(Monotonic.now_ns());
        self.watched = Some(watchdog(Duration::from_nanos(planned_ns) + PATIENCE));
        let orders = self.orders.as_mut().ok_or("the peer was dismissed")?;
        Ok(writeln!(orders, "{} {} {}", order.start_ns, order.end_ns, order.period_ns)?)
    }

    /// Waits for the end of what it does.
    pub(crate) fn finish(&mut self) -> Result<(), Failure> {
        let mut line = String::new();
        self.replies.read_line(&mut line)?;
        if let Some(watched) = self.watched.take() {
            watched.store(true, Ordering::Relaxed);
        }
        if line == DONE { Ok(()) } else { Err("the peer has ended; it said why above".into()) }
    }

    /// Lets it leave, so that it takes along what it has opened.
    pub(crate) fn dismiss(&mut self) {
        drop(self.orders.take());
        let _ = self.child.wait();
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
    }
}

/// The peer itself: a turn for each line, until there are no more.
pub(crate) fn serve(arm: &str, place: &str, values: usize) -> Result<(), Failure> {
    let mut wire = crate::connect(arm, place, values)?;
    let _pinned = cpu::pin(1)?;
    let done = || -> Result<(), Failure> {
        stdout().write_all(DONE.as_bytes())?;
        Ok(stdout().flush()?)
    };
    done()?;
    for line in stdin().lock().lines() {
        let line = line?;
        let numbers = line.split(' ').map(str::parse).collect::<Result<Vec<u64>, _>>()?;
        let [start_ns, end_ns, period_ns] = numbers[..] else { return Err("a bad order".into()) };
        match period_ns {
            0 => turn::echo(wire.as_mut(), values)?,
            _ => turn::send(wire.as_mut(), values, period_ns, start_ns, end_ns)?,
        }
        done()?;
    }
    Ok(())
}

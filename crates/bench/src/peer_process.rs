//! A process of this program that a bench starts beside itself, and orders about line by line: both ends.

use std::fmt::Display;
use std::io::{BufRead, BufReader, Write};
use std::process::{ChildStdin, ChildStdout, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use isochrone_processes::{Child, Company};
use serde::Serialize;

use crate::BenchError;

/// How long the process may take to leave, so that it takes its ports along.
const LEAVING: Duration = Duration::from_secs(3);

/// The process, as the bench sees it. It leaves when this is dropped.
pub(crate) struct PeerProcess {
    // Closed first: that tells it to leave.
    orders: Option<ChildStdin>,
    replies: BufReader<ChildStdout>,
    process: Child,
}

impl PeerProcess {
    /// Starts `bench` with this verb and gives the first order.
    pub(crate) fn start(
        company: &Company,
        verb: &str,
        setup: &impl Serialize,
    ) -> Result<Self, BenchError> {
        let mut process =
            company.start_with(&["bench", verb], |command| command.stdin(Stdio::piped()))?;
        let (Some(orders), Some(replies)) = (process.stdin(), process.stdout()) else {
            return Err(gone("it has no pipes"));
        };
        let mut peer = Self { orders: Some(orders), replies: BufReader::new(replies), process };
        peer.order(setup)?;
        Ok(peer)
    }

    /// Gives an order.
    pub(crate) fn order(&mut self, order: &impl Serialize) -> Result<(), BenchError> {
        let text = serde_json::to_string(order).map_err(gone)?;
        // If it has ended, its last words say why, and they are read next.
        let _ = self.orders.as_mut().map(|orders| writeln!(orders, "{text}"));
        Ok(())
    }

    /// The next line that it says; empty when it has ended.
    pub(crate) fn reply(&mut self) -> Result<String, BenchError> {
        let mut line = String::new();
        self.replies.read_line(&mut line).map_err(gone)?;
        Ok(line)
    }

    /// Gives no more orders: it says what it has to say, and ends.
    pub(crate) fn dismiss(&mut self) {
        drop(self.orders.take());
    }

    /// Fails unless it still runs.
    pub(crate) fn check(&mut self) -> Result<(), BenchError> {
        Ok(self.process.check()?)
    }
}

impl Drop for PeerProcess {
    fn drop(&mut self) {
        self.dismiss();
        let _ = self.process.wait_within(LEAVING);
    }
}

/// The process at the other end has ended.
pub(crate) fn gone(why: impl Display) -> BenchError {
    BenchError::Failed(format!("the process at the other end has ended: {why}"))
}

/// In the process: reads orders in the background. Their end is the end of whoever started us: that ends us too.
pub(crate) fn read_orders(
    orders: impl BufRead + Send + 'static,
    stop: Arc<AtomicBool>,
) -> Receiver<String> {
    let (sender, lines) = channel();
    thread::spawn(move || {
        for line in orders.lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                break;
            }
        }
        stop.store(true, Ordering::Relaxed);
    });
    lines
}

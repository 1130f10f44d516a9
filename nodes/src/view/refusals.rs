//! Connections for which there is no place: one thread refuses all of them.
//!
//! What is closed before it was read is reset, and the browser sees no answer. So each is read until it has asked,
//! answered, and read until its other end closes it.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use super::response::Response;
use super::threads::start_thread;
use crate::failure::Failure;

/// Most connections that are refused at a time; what comes beyond is closed without a word.
const MOST: usize = 256;
/// How long one may take to ask, and then to be closed.
const PATIENCE: Duration = Duration::from_millis(500);
/// Between two looks at those that are refused.
const LOOK_INTERVAL: Duration = Duration::from_millis(2);
/// Most that is read of one at a look.
const PART: usize = 64 * 1024;

/// Starts the thread; it ends with the sender.
pub(super) fn start(response: &Response) -> Result<SyncSender<TcpStream>, Failure> {
    let (sender, refused) = sync_channel(MOST);
    let bytes = response.bytes(false);
    start_thread("view-refuse", move || run(&refused, &bytes))?;
    Ok(sender)
}

fn run(refused: &Receiver<TcpStream>, response: &[u8]) {
    let mut refusals: Vec<Refusal> = Vec::new();
    loop {
        let next = if refusals.is_empty() {
            refused.recv().map_err(|_| RecvTimeoutError::Disconnected)
        } else {
            refused.recv_timeout(LOOK_INTERVAL)
        };
        match next {
            Ok(stream) if refusals.len() < MOST => refusals.extend(Refusal::of(stream)),
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
        refusals.retain_mut(|refusal| refusal.goes_on(response));
    }
}

struct Refusal {
    stream: TcpStream,
    deadline: Instant,
    is_answered: bool,
}

impl Refusal {
    fn of(stream: TcpStream) -> Option<Self> {
        stream.set_nonblocking(true).ok()?;
        Some(Self { stream, deadline: Instant::now() + PATIENCE, is_answered: false })
    }

    /// Reads what has come, and answers it; whether there is more to wait for.
    fn goes_on(&mut self, response: &[u8]) -> bool {
        let mut part = [0; PART];
        let is_over = Instant::now() >= self.deadline;
        match self.stream.read(&mut part) {
            Ok(0) => return false,
            Ok(_) => {}
            Err(error) if error.kind() == ErrorKind::Interrupted => return true,
            Err(error) if error.kind() != ErrorKind::WouldBlock => return false,
            Err(_) if !is_over => return true,
            Err(_) => {}
        }
        if self.is_answered {
            return !is_over;
        }
        self.is_answered = true;
        self.deadline = Instant::now() + PATIENCE;
        // An answer of some hundred bytes has room in any socket.
        let sent = self.stream.write_all(response);
        sent.and_then(|()| self.stream.shutdown(Shutdown::Write)).is_ok()
    }
}

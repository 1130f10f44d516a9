//! Messages of the demo's processes while another one draws on the terminal.

use std::io::{BufRead, BufReader};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use isochrone_processes::Child;

use crate::terminal;

/// What each says once it runs.
const READY: &str = "Press Ctrl-C to end it";
/// Messages that something works, or works again.
const GOOD_NEWS: &str = " INFO ";

/// The lines of processes whose stderr is piped, until they are said.
pub(super) struct Messages {
    processes: usize,
    held: Arc<Mutex<MessageBuffer>>,
}

#[derive(Default)]
struct MessageBuffer {
    lines: Vec<String>,
    ready: usize,
}

impl Messages {
    /// Reads along in the background.
    pub(super) fn of<const COUNT: usize>(processes: [&mut Child; COUNT]) -> Self {
        let held = Arc::new(Mutex::new(MessageBuffer::default()));
        for pipe in processes.into_iter().filter_map(Child::stderr) {
            let held = Arc::clone(&held);
            thread::spawn(move || {
                let lines = BufReader::new(pipe).lines().map_while(Result::ok);
                for line in lines {
                    let mut held = held.lock().unwrap_or_else(PoisonError::into_inner);
                    held.ready += usize::from(line.contains(READY));
                    if !line.contains(GOOD_NEWS) {
                        held.lines.push(line);
                    }
                }
            });
        }
        Self { processes: COUNT, held }
    }

    /// Whether all have said that they run.
    pub(super) fn are_ready(&self) -> bool {
        self.held.lock().unwrap_or_else(PoisonError::into_inner).ready >= self.processes
    }

    /// Says what is held.
    pub(super) fn say(&self) {
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        held.lines.drain(..).for_each(|line| terminal::note(&line));
    }
}

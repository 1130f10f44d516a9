//! The output of a process, while it prints it.

use std::io::{BufRead, BufReader, Read};
use std::process::{ChildStderr, ChildStdout};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// For a pipe that has nobody at its other end any more.
const PATIENCE: Duration = Duration::from_millis(500);

/// What a process printed so far.
#[derive(Debug, Clone, Default)]
pub struct Output(Arc<Mutex<Printed>>);

#[derive(Debug, Default)]
struct Printed {
    feed: Feed,
    errors: String,
    open_pipes: u32,
}

/// The frames that a subscriber wrote as CSV.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Feed {
    /// How many.
    pub rows: u64,
    /// The last channel of the last one.
    pub last: Option<f64>,
}

impl Output {
    /// Collects what comes out of the pipes of a process.
    pub fn of(stdout: Option<ChildStdout>, stderr: Option<ChildStderr>) -> Self {
        let output = Self::default();
        if let Some(stdout) = stdout {
            let rows = output.clone();
            output.collect(stdout, move |line| rows.take_row(line));
        }
        if let Some(stderr) = stderr {
            let errors = output.clone();
            output.collect(stderr, move |line| errors.lock().errors += &format!("{line}\n"));
        }
        output
    }

    /// The frames so far.
    pub fn feed(&self) -> Feed {
        self.lock().feed
    }

    /// The standard error so far.
    pub fn errors(&self) -> String {
        self.lock().errors.clone()
    }

    /// The standard error of a process that has ended, also what its pipe still held.
    pub fn last_words(&self) -> String {
        let since = Instant::now();
        while self.lock().open_pipes > 0 && since.elapsed() < PATIENCE {
            thread::sleep(Duration::from_millis(1));
        }
        self.errors().trim_end().replace('\n', " | ")
    }

    /// A header, and whatever else is no number, is no frame.
    fn take_row(&self, line: &str) {
        let value = line.rsplit_once(',').and_then(|(_, value)| value.parse().ok());
        if let Some(value) = value {
            let feed = &mut self.lock().feed;
            *feed = Feed { rows: feed.rows + 1, last: Some(value) };
        }
    }

    fn lock(&self) -> MutexGuard<'_, Printed> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn collect(&self, pipe: impl Read + Send + 'static, take: impl Fn(&str) + Send + 'static) {
        self.lock().open_pipes += 1;
        let output = self.clone();
        thread::spawn(move || {
            for line in BufReader::new(pipe).lines() {
                let Ok(line) = line else { break };
                take(&line);
            }
            output.lock().open_pipes -= 1;
        });
    }
}

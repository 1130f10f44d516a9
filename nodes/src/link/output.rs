//! The output of the link's program.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use isochrone_processes::Child;

/// Of what it says, for people.
const KEPT: usize = 20;
/// Its message for each frame that it drops because 64 wait already.
const DROPPED: &str = "An arrival was dropped, the inbox is full";

/// Its output: the last lines, the unread lines, and how many frames it dropped.
#[derive(Clone, Default)]
pub(super) struct Output(Arc<Mutex<OutputLines>>);

#[derive(Default)]
struct OutputLines {
    last: VecDeque<String>,
    news: Vec<String>,
    dropped: u64,
    /// Whether the lines are those of a backtrace.
    is_backtrace: bool,
}

impl Output {
    /// Reads what a program says, in the background.
    pub(super) fn of(program: &mut Child) -> Self {
        let output = Self::default();
        if let Some(stdout) = program.stdout() {
            output.read(stdout);
        }
        if let Some(stderr) = program.stderr() {
            output.read(stderr);
        }
        output
    }

    fn read(&self, pipe: impl Read + Send + 'static) {
        let output = self.clone();
        thread::spawn(move || {
            let lines = BufReader::new(pipe).split(b'\n').map_while(Result::ok);
            lines.for_each(|line| output.note(String::from_utf8_lossy(&line).trim_end()));
        });
    }

    fn note(&self, line: &str) {
        let Some(text) = message(line) else { return };
        let mut said = self.said();
        // Where in the program it ended tells its users nothing.
        said.is_backtrace = match text {
            "Stack backtrace:" | "stack backtrace:" => true,
            text => said.is_backtrace && is_of_backtrace(text),
        };
        if said.is_backtrace {
            return;
        }
        if text == DROPPED {
            said.dropped += 1;
            return;
        }
        // Messages that are repeated for each frame are kept once.
        if said.last.iter().any(|last| last == text) {
            return;
        }
        said.last.push_back(text.to_owned());
        said.news.push(text.to_owned());
        if said.last.len() > KEPT {
            said.last.pop_front();
        }
    }

    /// The lines since the last call.
    pub(super) fn news(&self) -> Vec<String> {
        std::mem::take(&mut self.said().news)
    }

    /// How many frames it has dropped since the last look.
    pub(super) fn dropped(&self) -> u64 {
        std::mem::take(&mut self.said().dropped)
    }

    /// The last lines, indented.
    pub(super) fn last(&self) -> String {
        match self.said().last.iter().map(|line| format!("\n  {line}")).collect::<String>() {
            said if said.is_empty() => "; it said nothing".into(),
            said => format!("; it said:{said}"),
        }
    }

    fn said(&self) -> MutexGuard<'_, OutputLines> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What a line tells. iceoryx2 writes where a message comes from in a line before it, with a number:
/// `260 [W] "iceoryx2_…::push"`, and then `| the message`.
fn message(line: &str) -> Option<&str> {
    let is_origin = line.split_once(" [").is_some_and(|(number, rest)| {
        number.bytes().all(|byte| byte.is_ascii_digit()) && rest.get(1..3) == Some("] ")
    });
    let text = line.strip_prefix("| ").unwrap_or(line).trim();
    (!is_origin && !text.is_empty()).then_some(text)
}

/// `3: iox2_link_tunnel_zenoh::main`, or `at ./csu/libc-start.c:360:3`.
fn is_of_backtrace(text: &str) -> bool {
    let number = text.split_once(": ").map_or("", |(number, _)| number);
    text.starts_with("at ")
        || (!number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dropped_frames_are_counted_and_other_words_kept_once() {
        let output = Output::default();
        for line in [
            "260 [W] \"iceoryx2_integrations_zenoh_link_carrier::inbox::Inbox::push\"",
            "| An arrival was dropped, the inbox is full",
            "261 [W] \"x\"",
            "| An arrival was dropped, the inbox is full",
            "",
            "| Discovery failed: x",
            "| Discovery failed: x",
        ] {
            output.note(line);
        }
        assert_eq!((output.dropped(), output.dropped()), (2, 0));
        assert_eq!(output.news(), ["Discovery failed: x"]);
        assert_eq!(output.last(), "; it said:\n  Discovery failed: x");
        assert!(output.news().is_empty());
    }

    #[test]
    fn a_backtrace_is_left_out_and_what_stands_around_it_is_not() {
        let output = Output::default();
        for line in [
            "Error: CreationError::Session",
            "",
            "Stack backtrace:",
            "   0: anyhow::error::<impl core::convert::From<E> for anyhow::Error>::from",
            "   1: __libc_start_call_main",
            "             at ./csu/../sysdeps/nptl/libc_start_call_main.h:58:16",
            "the end",
            "  2: two",
        ] {
            output.note(line);
        }
        assert_eq!(output.news(), ["Error: CreationError::Session", "the end", "2: two"]);
    }

    #[test]
    fn of_many_words_the_last_are_kept() {
        let output = Output::default();
        (0..100).for_each(|line| output.note(&format!("line {line}")));
        assert_eq!(output.last().lines().count(), 1 + KEPT);
        assert!(output.last().ends_with("line 99"));
    }
}

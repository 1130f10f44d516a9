//! The thread that writes a journal hangs, or panics.

use std::fmt::{Debug, Write};
use std::fs;
use std::path::Path;
use std::sync::{Condvar, Mutex, Once};
use std::thread;

use crate::happened::take_until;
use crate::journalled;
use isochrone_model::{Code, Hold};
use isochrone_runtime::{Alarm, Events, Outcome, Running, SendError};
use isochrone_testing::wait_for_some;
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::subscriber::Interest;
use tracing::{Event, Metadata, Subscriber};

/// The log of the program: where the thread of a journal has something to say, the log hangs or panics, as the
/// name of the file says.
struct Log;

/// The paths of journals whose threads hang, and what wakes them.
static HANGING: Mutex<Vec<String>> = Mutex::new(Vec::new());
static RELEASED: Condvar = Condvar::new();

impl Subscriber for Log {
    /// Other threads of this program may be the first to come by.
    fn register_callsite(&self, _: &'static Metadata<'static>) -> Interest {
        Interest::sometimes()
    }

    fn enabled(&self, _: &Metadata<'_>) -> bool {
        thread::current().name() == Some("journal")
    }

    fn event(&self, event: &Event<'_>) {
        let mut text = Text(String::new());
        event.record(&mut text);
        assert!(!text.0.contains("panics.jsonl"), "the log is closed");
        let mut hanging = HANGING.lock().unwrap();
        let is_of = |path: &&String| text.0.contains(path.as_str());
        while hanging.iter().find(is_of).is_some() {
            hanging = RELEASED.wait(hanging).unwrap();
        }
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, _: &Field, value: &dyn Debug) {
        write!(self.0, "{value:?}").unwrap();
    }
}

/// A node whose journal is in this file, with a force in it.
fn start(path: &Path) -> (Running, Told) {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| tracing::subscriber::set_global_default(Log).unwrap());
    let node = journalled::start(path);
    let mut told = Told { events: node.events(), applied: Vec::new(), unwritten: Vec::new() };
    let force = node.force([("raw", 7.0)], Hold::UntilReleased).unwrap().number;
    told.wait(force);
    assert!(told.unwritten.is_empty(), "{:?}", told.unwritten);
    (node, told)
}

/// Has the thread say something: what is left of the file is no journal.
fn cut(path: &Path) {
    fs::OpenOptions::new().write(true).open(path).unwrap().set_len(20).unwrap();
}

/// Transactions that were told to have happened.
struct Told {
    events: Events,
    applied: Vec<u64>,
    unwritten: Vec<u64>,
}

impl Told {
    /// Waits until a transaction is told.
    fn wait(&mut self, transaction: u64) {
        let Self { events, applied, unwritten } = self;
        take_until(events, |batch| {
            applied.extend(batch.applied.iter().map(|entry| entry.transaction));
            unwritten.extend(batch.unwritten);
            applied.contains(&transaction)
        });
    }

    /// Releases the force, which is done though the journal does not have it.
    fn release(&mut self, node: &Running) {
        let release = node.release(["raw"]).unwrap().number;
        self.wait(release);
        assert!(self.unwritten.contains(&release));
        assert_eq!(node.forces().count(), 0);
    }

    /// Sets a parameter until that is refused; returns the last that was done, and why it is refused.
    fn set_until_refused(&mut self, node: &Running) -> (u64, String) {
        let (mut rate, mut last) = (3.0, 0);
        let refused = wait_for_some("it is refused", || {
            rate += 1.0;
            match node.set([("ramp.setChangeRate", rate)]) {
                Ok(sent) => {
                    last = sent.number;
                    // One is on its way at a time: the thread is behind with it where it hangs.
                    self.wait(last);
                    None
                }
                Err(SendError::Refused(refused)) => {
                    assert_eq!(refused.code, Code::Forbidden);
                    Some(refused.to_string())
                }
                Err(error) => panic!("{error}"),
            }
        });
        (last, refused)
    }
}

fn incomplete(outcome: &Outcome) -> &str {
    let reason = outcome.alarms.iter().find_map(|alarm| match alarm {
        Alarm::JournalIncomplete { reason } => Some(reason.as_str()),
        _ => None,
    });
    reason.unwrap_or_else(|| panic!("{:?}", outcome.alarms))
}

#[test]
fn a_journal_whose_thread_hangs_holds_up_neither_the_answers_nor_the_end_of_the_node() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hangs.jsonl");
    let (node, mut told) = start(&path);
    HANGING.lock().unwrap().push(path.display().to_string());
    cut(&path);
    let (last, refused) = told.set_until_refused(&node);
    assert!(refused.contains("hangs.jsonl has not been written for a second"), "{refused}");
    assert!(told.unwritten.contains(&last), "{last} is not in {:?}", told.unwritten);
    told.release(&node);

    let outcome = node.finish().unwrap();
    let reason = incomplete(&outcome);
    assert!(reason.contains("its end was not written within 5 s"), "{reason}");
    HANGING.lock().unwrap().clear();
    RELEASED.notify_all();
}

#[test]
fn a_journal_whose_thread_has_panicked_has_changes_refused_until_the_node_is_started_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("panics.jsonl");
    let (node, mut told) = start(&path);
    let whole = fs::read_to_string(&path).unwrap();

    cut(&path);
    let (_, refused) = told.set_until_refused(&node);
    let why =
        "panics.jsonl cannot be written (the thread that writes it panicked: the log is closed";
    assert!(refused.contains(why), "{refused}");
    told.release(&node);

    let outcome = node.finish().unwrap();
    let reason = incomplete(&outcome);
    assert!(reason.contains("incomplete: the thread that writes it panicked"), "{reason}");
    assert_eq!(fs::read_to_string(&path).unwrap(), whole[..20], "nothing is added");
    // The file is free, and what was lost cannot be taken for the end of the run.
    // A program that another test is just starting has it for a moment, too.
    wait_for_some("it is free", || fs::File::open(&path).unwrap().try_lock().ok());
    assert!(!whole.contains("{\"end\""));
}

//! A node in a program that is recorded in a file of the program's making: one that hangs, one that is full.

use std::io::{self, Write};
use std::sync::{Arc, Condvar, Mutex};

use isochrone_engine::{Plan, Rules, Source};
use isochrone_recording::{Item, Mark, Reader};
use isochrone_runtime::{Alarm, Node, Outcome, Prepared, RecordingFile, RecordingOutcome, Running};
use isochrone_testing::plants::SAW;
use isochrone_testing::wait_until;

/// A file in memory, on a disk that the test has in its hand.
#[derive(Clone, Default)]
struct Disk(Arc<(Mutex<State>, Condvar)>);

#[derive(Default)]
struct State {
    bytes: Vec<u8>,
    hangs: bool,
    /// How many bytes there is room for, where it is not enough.
    room: Option<usize>,
    is_cut: bool,
}

impl Disk {
    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.0.0.lock().unwrap());
        self.0.1.notify_all();
    }

    fn len(&self) -> usize {
        self.0.0.lock().unwrap().bytes.len()
    }
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let state = self.0.0.lock().unwrap();
        let mut state = self.0.1.wait_while(state, |state| state.hangs).unwrap();
        let room = state.room.map_or(bytes.len(), |room| room - state.bytes.len().min(room));
        if room == 0 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        let written = bytes.len().min(room);
        state.bytes.extend_from_slice(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl RecordingFile for Disk {
    fn cut(&mut self, bytes: u64) -> u64 {
        self.change(|state| {
            state.bytes.truncate(bytes as usize);
            state.is_cut = true;
        });
        bytes
    }
}

fn prepared() -> Prepared {
    let plan =
        Plan::new(Source::new("test.toml", SAW.replace("2ms", "1ms")), &Rules::default()).unwrap();
    Node::prepare_alone(&plan).unwrap()
}

/// How many cycles have run. Those that a busy machine lets it miss do not count.
fn cycles(node: &Running) -> f64 {
    let value = |name: &str| node.value(name).unwrap_or_default();
    value("task.t.cycle") - value("task.t.missed")
}

fn run_to(node: &Running, many: f64) {
    wait_until("it has run so far", || cycles(node) >= many);
}

/// What stands in the file: how many rows, and how many are said to be lost; its cycles are in order.
fn read(disk: &Disk, is_closed: bool) -> (u64, u64) {
    let bytes = disk.0.0.lock().unwrap().bytes.clone();
    let mut reader = Reader::open(&bytes[..]).unwrap();
    let (mut rows, mut lost) = (0, 0);
    while let Some(item) = reader.next_item().unwrap() {
        match item {
            Item::Row(row) => {
                let ran = row.head.cycle - row.head.missed;
                assert_eq!(ran, rows + lost + row.head.lost);
                (rows, lost) = (rows + 1, lost + row.head.lost);
            }
            Item::Mark(mark) if mark.kind == Mark::LOST => lost += mark.count,
            _ => {}
        }
    }
    let condition = reader.condition();
    assert_eq!((condition.is_closed, condition.damaged), (is_closed, 0));
    (rows, lost)
}

fn ended(outcome: Outcome) -> (RecordingOutcome, u64, Vec<String>) {
    let told = outcome.alarms.iter().filter_map(|alarm| match alarm {
        Alarm::RecordingIncomplete { reason } => Some(reason.clone()),
        _ => None,
    });
    (outcome.recording.unwrap(), outcome.tasks[0].cycles, told.collect())
}

#[test]
fn a_disk_that_hangs_costs_cycles_that_are_counted_and_marked_and_the_node_nothing() {
    let disk = Disk::default();
    let node = prepared().with_recording("out.mcap", disk.clone()).unwrap().start();
    run_to(&node, 100.0);
    disk.change(|state| state.hangs = true);
    // The ring holds four seconds, and the thread hands everything to the system once a second.
    run_to(&node, 6000.0);
    disk.change(|state| state.hangs = false);
    run_to(&node, 6500.0);
    let (recording, cycles, told) = ended(node.finish().unwrap());
    let (rows, lost) = read(&disk, true);
    assert!(lost > 0);
    assert_eq!((recording.cycles, recording.lost), (rows, lost));
    assert_eq!(rows + lost, cycles);
    assert_eq!(told.len(), 1);
    assert!(
        told[0].starts_with(&format!("the recording out.mcap lacks {lost} cycles")),
        "{told:?}"
    );
}

#[test]
fn a_disk_that_is_full_ends_the_recording_with_a_whole_file_and_the_node_runs_on() {
    let disk = Disk::default();
    let prepared = prepared().with_recording("out.mcap", disk.clone()).unwrap();
    disk.change(|state| state.room = Some(state.bytes.len() + 60_000));
    let node = prepared.start();
    wait_until("the recording is cut", || disk.0.0.lock().unwrap().is_cut);
    run_to(&node, cycles(&node) + 200.0);
    let (recording, cycles, told) = ended(node.finish().unwrap());
    let (rows, lost) = read(&disk, false);
    assert_eq!((recording.cycles, recording.bytes), (rows, disk.len() as u64));
    assert!(rows > 0 && lost == 0);
    assert_eq!(recording.lost, cycles - rows);
    assert!(recording.lost >= 200);
    assert_eq!(told, [recording.incomplete.unwrap()]);
    assert!(
        told[0].contains("cannot be written") && told[0].contains("goes on without it"),
        "{told:?}"
    );
}

//! A journal file: what a node writes, and what is read again.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::Path;

use isochrone_model::{Action, AskedBy, Entry, Hold};
use isochrone_runtime::journal::{Journal, JournalError, JournalLines, Line, RunHeader};
use isochrone_runtime::{IfMissed, Node, Running};
use isochrone_testing::wait_for_some;

use crate::journalled::{NODE, plan, start};

/// What a file has of a run.
pub(crate) struct Run {
    pub(crate) header: RunHeader,
    pub(crate) entries: Vec<Entry>,
    pub(crate) has_end: bool,
}

impl Run {
    pub(crate) fn transactions(&self) -> Vec<u64> {
        self.entries.iter().map(|entry| entry.transaction).collect()
    }
}

/// The runs of a file, and the number of a last line that is incomplete.
pub(crate) fn read(path: &Path) -> Result<(Vec<Run>, Option<usize>), JournalError> {
    let mut lines = JournalLines::open(path)?;
    let mut runs: Vec<Run> = Vec::new();
    for line in &mut lines {
        match (line?.1, runs.last_mut()) {
            (Line::Run(header), _) => {
                runs.push(Run { header, entries: Vec::new(), has_end: false });
            }
            (Line::Entry(entry), Some(run)) => run.entries.push(entry),
            (Line::End(_), Some(run)) => run.has_end = true,
            (line, _) => panic!("{line:?}"),
        }
    }
    Ok((runs, lines.cut_line()))
}

pub(crate) fn runs(path: &Path) -> Vec<Run> {
    read(path).unwrap().0
}

pub(crate) fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// Waits until something is in the journal of a running node.
pub(crate) fn await_entry(node: &Running, is_it: impl Fn(&Entry) -> bool) -> Entry {
    wait_for_some("it is in the journal", || node.journal(0).find(&is_it))
}

/// Runs a node that is set once; returns the transaction's number.
pub(crate) fn run_once(path: &Path) -> u64 {
    let node = start(path);
    let number = node.set([("ramp.setChangeRate", 2.5)]).unwrap().number;
    await_entry(&node, |entry| entry.transaction == number);
    node.finish().unwrap();
    number
}

fn refused(path: &Path) -> String {
    Journal::open(path, &plan(NODE)).unwrap_err().to_string()
}

#[test]
fn what_is_done_is_read_again_as_it_was_with_who_and_when() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    let node = start(&path);
    let set = node.set([("ramp.setChangeRate", 2.5)]).unwrap().number;
    node.set([("raw", 4.0)]).unwrap();
    let force = node.force([("raw", 7.0)], Hold::Seconds(0.003)).unwrap().number;
    await_entry(&node, |entry| entry.action == Action::Expiry);
    let undo = node.undo(set).unwrap().number;
    await_entry(&node, |entry| entry.transaction == undo);
    let written: Vec<Entry> = node.journal(0).collect();
    node.finish().unwrap();

    let (runs, cut_line) = read(&path).unwrap();
    let [run] = &runs[..] else { panic!("{} runs", runs.len()) };
    assert_eq!((run.header.run, run.has_end, cut_line), (1, true, None));
    assert_eq!(run.header.sha256, plan(NODE).source.sha256());
    let actions = run.transactions();
    assert_eq!(actions, [set, force, force, undo], "what the program feeds is no operation");
    for entry in &run.entries {
        let is_it = |it: &&Entry| (it.sequence, it.cycle) == (entry.sequence, entry.cycle);
        let known = written.iter().find(is_it).unwrap();
        let names = known.changes.iter().map(|change| &change.name);
        assert!(entry.changes.iter().map(|change| &change.name).eq(names), "{entry:?}");
        assert_eq!((entry.unix_ns, &*entry.task), (known.unix_ns, "fast"));
    }
}

#[test]
fn runs_follow_each_other_in_a_file_and_transactions_are_counted_on() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    let numbers = [run_once(&path), run_once(&path), run_once(&path)];
    assert!(numbers.is_sorted_by(|a, b| a < b), "{numbers:?}");
    let runs = runs(&path);
    assert_eq!(runs.iter().flat_map(Run::transactions).collect::<Vec<_>>(), numbers);
    assert_eq!(runs.iter().map(|run| run.header.run).collect::<Vec<_>>(), [1, 2, 3]);
}

#[test]
fn a_line_that_a_killed_node_has_not_finished_is_left_out_and_taken_away() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    run_once(&path);
    // A node that is killed has not written that the run ended.
    let whole = fs::read_to_string(&path).unwrap();
    let whole = whole.split_once("{\"end\"").unwrap().0.to_owned();
    fs::write(&path, &whole).unwrap();
    let add = |text: &[u8]| {
        OpenOptions::new().append(true).open(&path).unwrap().write_all(text).unwrap();
    };
    add(b"{\"entry\":{\"sequence\":2,\"transa");
    let (before, cut_line) = read(&path).unwrap();
    assert_eq!((cut_line, before[0].entries.len()), (Some(3), 1));
    let journal = Journal::open(&path, &plan(NODE)).unwrap();
    assert!(journal.had_cut_line());
    assert_eq!(journal.run(), 2);
    drop(journal);
    assert_eq!(fs::read_to_string(&path).unwrap(), whole);
    run_once(&path);
    assert_eq!(runs(&path).len(), 2);
    // A last line that lacks nothing but its end is a line.
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.trim_end()).unwrap();
    run_once(&path);
    assert_eq!(runs(&path).len(), 3);
}

#[test]
fn a_file_that_is_no_journal_is_neither_read_nor_written_to() {
    let folder = folder();
    let path = folder.path().join("level.toml");
    for (text, told) in [
        (NODE, ":1: no line of a journal: "),
        (
            "{\"missed\":{\"task\":\"fast\",\"first\":1,\"last\":2}}\n",
            ":1: no line of a journal: the first line must be that of a run",
        ),
        (
            "{\"run\":{\"format\":2,\"run\":7,\"version\":\"9.0.0\"}}\n",
            ":1: run 7 has format 2, and this program knows format 1; use the version that wrote it, 9.0.0, or begin another file",
        ),
    ] {
        fs::write(&path, text).unwrap();
        let read = read(&path).err().unwrap().to_string();
        assert!(read.contains(told), "{read}");
        assert_eq!(refused(&path), read);
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
    }
    fs::write(&path, "").unwrap();
    let told = read(&path).err().unwrap().to_string();
    assert!(told.contains("has no runs"), "{told}");
}

#[test]
fn what_earlier_versions_wrote_of_missed_cycles_is_passed_over() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    run_once(&path);
    let text = fs::read_to_string(&path).unwrap();
    let missed = r#"{"missed":{"task":"fast","first":1,"last":2}}"#;
    let unclear = r#"{"unclear":{"task":"fast","first":1,"last":2,"missed":1}}"#;
    fs::write(&path, text.replace("{\"end\"", &format!("{missed}\n{unclear}\n{{\"end\""))).unwrap();
    let lines = JournalLines::open(&path).unwrap().map(|line| line.unwrap().1);
    assert_eq!(lines.filter(|line| matches!(line, Line::Missed(_))).count(), 2);
    assert_eq!(Journal::open(&path, &plan(NODE)).unwrap().run(), 2);
}

#[test]
fn a_line_in_the_middle_that_is_broken_is_named() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    run_once(&path);
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("{\"entry\"", "{\"enrty\"")).unwrap();
    let told = read(&path).err().unwrap().to_string();
    assert!(told.contains("j.jsonl:2: no line of a journal: unknown variant `enrty`"), "{told}");
}

#[test]
fn a_journal_has_one_writer_at_a_time() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    let node = start(&path);
    assert!(refused(&path).contains("another node writes the journal"));
    node.finish().unwrap();
    Journal::open(&path, &plan(NODE)).unwrap();
}

#[test]
fn a_journal_that_no_node_has_begun_leaves_nothing() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    drop(Journal::open(&path, &plan(NODE)).unwrap());
    assert!(!path.exists());
}

#[test]
fn a_place_that_cannot_be_written_is_refused_before_the_node_starts() {
    let folder = folder();
    assert!(refused(folder.path()).starts_with("cannot write the journal"));
    assert!(refused(&folder.path().join("none/j.jsonl")).contains("No such file"));
    let full = Journal::open(Path::new("/dev/full"), &plan(NODE)).unwrap();
    let prepared = Node::prepare_alone(&plan(NODE)).unwrap();
    let told = prepared.with_journal(full).unwrap_err().to_string();
    assert!(told.contains("/dev/full") && told.contains("No space left"), "{told}");
}

#[test]
fn a_change_of_the_configuration_is_written_with_its_text() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    let node = start(&path);
    let next = NODE.replace("10.0", "11.0");
    let prepared = node.prepare_apply(&next, AskedBy::default()).unwrap();
    node.apply(prepared, IfMissed::Allow).unwrap();
    await_entry(&node, |entry| entry.action == Action::Apply);
    node.finish().unwrap();
    let [run] = &runs(&path)[..] else { panic!() };
    let configurations = run.entries.iter().map(|entry| entry.configuration.as_deref());
    assert_eq!(configurations.collect::<Vec<_>>(), [Some(next.as_str())]);
}

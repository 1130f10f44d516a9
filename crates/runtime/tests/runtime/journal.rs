//! A journal file: what a node writes, and what is read again.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::Path;

use isochrone_model::{Action, AskedBy, Entry, Hold};
use isochrone_runtime::journal::{Journal, JournalError, JournalLines, Line, RunHeader};
use isochrone_runtime::{Alarm, IfMissed, Node, Running};
use isochrone_testing::{wait_for_ok, wait_for_some, wait_until};

use crate::happened::take_until;
use crate::journalled::{NODE, plan, start};

/// What a file has of a run.
struct Run {
    header: RunHeader,
    entries: Vec<Entry>,
    has_end: bool,
}

impl Run {
    fn transactions(&self) -> Vec<u64> {
        self.entries.iter().map(|entry| entry.transaction).collect()
    }
}

/// The runs of a file, and the number of a last line that is incomplete.
fn read(path: &Path) -> Result<(Vec<Run>, Option<usize>), JournalError> {
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

fn runs(path: &Path) -> Vec<Run> {
    read(path).unwrap().0
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// Waits until something is in the journal of a running node.
fn await_entry(node: &Running, is_it: impl Fn(&Entry) -> bool) -> Entry {
    wait_for_some("it is in the journal", || node.journal(0).find(&is_it))
}

/// Runs a node that is set once; returns the transaction's number.
fn run_once(path: &Path) -> u64 {
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

/// Waits until a file has the entry of a transaction.
fn await_line(path: &Path, transaction: u64) {
    let line = format!("\"transaction\":{transaction},");
    wait_until(&format!("{} has {line}", path.display()), || {
        fs::read_to_string(path).is_ok_and(|text| text.contains(&line))
    });
}

/// Sets a parameter, and waits until that is in the file.
fn set(node: &Running, path: &Path, rate: f64) -> u64 {
    let number = node.set([("ramp.setChangeRate", rate)]).unwrap().number;
    await_line(path, number);
    number
}

fn truncate(path: &Path, length: u64) {
    OpenOptions::new().write(true).open(path).unwrap().set_len(length).unwrap();
}

#[test]
fn a_file_that_is_renamed_removed_or_emptied_is_followed_by_another() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    run_once(&path);
    let node = start(&path);
    let first = set(&node, &path, 2.0);
    let renamed = folder.path().join("renamed");
    fs::rename(&path, &renamed).unwrap();
    let second = set(&node, &path, 3.0);
    assert_eq!(runs(&path)[0].transactions(), [second]);
    // What a rotation has made already is taken as it is.
    fs::rename(&path, folder.path().join("renamed.2")).unwrap();
    fs::write(&path, "").unwrap();
    let third = set(&node, &path, 4.0);
    assert_eq!(runs(&path)[0].transactions(), [third]);
    fs::remove_file(&path).unwrap();
    let fourth = set(&node, &path, 5.0);
    truncate(&path, 0);
    let fifth = set(&node, &path, 6.0);
    node.finish().unwrap();
    let [old, run] = &runs(&renamed)[..] else { panic!() };
    assert_eq!((old.header.run, run.transactions(), run.has_end), (1, vec![first], false));
    let [new] = &runs(&path)[..] else { panic!() };
    assert_eq!((new.transactions(), new.has_end), (vec![fifth], true));
    assert_eq!(new.header, RunHeader { after_transaction: Some(fourth), ..run.header.clone() });
    run_once(&path);
    assert_eq!(runs(&path)[1].header.run, 3);
}

#[test]
fn a_full_file_is_kept_and_eight_of_them_at_most() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    let first = run_once(&path);
    let kept = |number: u32| folder.path().join(format!("j.jsonl.{number}"));
    for number in 1..=8 {
        fs::write(kept(number), number.to_string()).unwrap();
    }
    // Ten entries short of full: a comment may be of any length here.
    let text = fs::read_to_string(&path).unwrap();
    let comment = format!("\"comment\":\"{}\",\"action\"", "x".repeat((16 << 20) - 2500));
    fs::write(&path, text.replace("\"action\"", &comment)).unwrap();
    let node = start(&path);
    let sets: Vec<_> = (1..=20).map(|rate| set(&node, &path, f64::from(rate))).collect();
    node.finish().unwrap();
    let [old, before] = &runs(&kept(1))[..] else { panic!() };
    assert_eq!((old.transactions(), before.header.run), (vec![first], 2));
    let [after] = &runs(&path)[..] else { panic!() };
    let last = before.transactions().last().copied();
    assert_eq!(after.header, RunHeader { after_transaction: last, ..before.header.clone() });
    assert_eq!([before.transactions(), after.transactions()].concat(), sets);
    assert!(!before.has_end && after.has_end);
    let older: Vec<_> = (2..=8).map(|number| fs::read_to_string(kept(number)).unwrap()).collect();
    assert_eq!(older, ["1", "2", "3", "4", "5", "6", "7"]);
    assert!(!kept(9).exists());
}

/// Waits until a node refuses changes for a reason.
fn await_refusal(node: &Running, reason: &str) {
    let mut rate = 3.0;
    wait_until(&format!("it is refused: {reason}"), || {
        rate += 1.0;
        let set = node.set([("ramp.setChangeRate", rate)]);
        set.is_err_and(|refused| refused.to_string().contains(reason))
    });
}

#[test]
fn a_file_of_another_at_the_place_of_the_journal_stays_as_it_is() {
    let folder = folder();
    let (path, other) = (folder.path().join("j.jsonl"), folder.path().join("other"));
    run_once(&other);
    let journal = fs::read_to_string(&other).unwrap();
    let broken = journal.replace("{\"end\"", "{\"dne\"");
    let format = journal.replace("\"format\":1", "\"format\":2");
    for (text, is_held, reason) in [
        (journal.as_str(), true, "another node writes the journal"),
        (NODE, false, ":1: no line of a journal"),
        (&broken, false, "no line of a journal: unknown variant `dne`"),
        (&format, false, ":1: run 1 has format 2"),
    ] {
        let node = start(&path);
        fs::write(&other, text).unwrap();
        let held = fs::File::open(&other).unwrap();
        if is_held {
            held.lock().unwrap();
        }
        fs::rename(&other, &path).unwrap();
        await_refusal(&node, reason);
        assert_eq!(fs::read_to_string(&path).unwrap(), text, "{reason}");
        node.finish().unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), text, "{reason}");
        fs::remove_file(&path).unwrap();
    }
}

#[test]
fn what_is_left_of_a_cut_file_and_is_no_journal_stays_as_it_is() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    let node = start(&path);
    truncate(&path, 20);
    let left = fs::read(&path).unwrap();
    await_refusal(&node, ":1: no line of a journal");
    assert_eq!(fs::read(&path).unwrap(), left);
    let outcome = node.finish().unwrap();
    assert_eq!(fs::read(&path).unwrap(), left);
    let is_told = |alarm: &Alarm| matches!(alarm, Alarm::JournalIncomplete { .. });
    assert!(outcome.alarms.iter().any(is_told), "{:?}", outcome.alarms);
}

#[test]
fn a_place_where_the_file_cannot_be_written_anew_has_changes_refused_until_it_can() {
    let folder = folder();
    let (inner, away) = (folder.path().join("inner"), folder.path().join("away"));
    fs::create_dir(&inner).unwrap();
    let path = inner.join("j.jsonl");
    let node = start(&path);
    let first = node.set([("ramp.setChangeRate", 2.0)]).unwrap().number;
    await_line(&path, first);
    fs::rename(&inner, &away).unwrap();
    await_refusal(&node, "cannot be written (No such file");
    fs::rename(&away, &inner).unwrap();
    let last =
        wait_for_ok("it is not refused any more", || node.set([("ramp.setChangeRate", 2.0)]));
    let last = last.number;
    await_line(&path, last);
    node.finish().unwrap();
    let numbers: Vec<_> = runs(&path).iter().flat_map(Run::transactions).collect();
    assert!(numbers.first() == Some(&first) && numbers.last() == Some(&last), "{numbers:?}");
}

#[test]
fn what_happens_while_the_file_cannot_be_written_is_told_with_that_and_written_when_it_can_be() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    let node = start(&path);
    let force = node.force([("raw", 7.0)], Hold::UntilReleased).unwrap().number;
    await_line(&path, force);
    truncate(&path, 20);
    await_refusal(&node, ":1: no line of a journal");
    let events = node.events();
    let release = node.release(["raw"]).unwrap().number;
    take_until(&events, |batch| {
        let is_told = batch.applied.iter().any(|entry| entry.transaction == release);
        assert!(!is_told || batch.unwritten.contains(&release));
        is_told
    });
    // What is left of the file is nothing; the way out is to remove it.
    fs::remove_file(&path).unwrap();
    await_line(&path, release);
    node.finish().unwrap();
    let [run] = &runs(&path)[..] else { panic!() };
    assert!(run.has_end);
    assert!(run.entries.iter().is_sorted_by_key(|entry| entry.sequence));
}

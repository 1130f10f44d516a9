//! A journal file: what a node writes, and what is read again.

use std::fs;
use std::io::Write;
use std::path::Path;

use isochrone_engine::operate::{Action, Client, Entry, Hold};
use isochrone_ipc::local;
use isochrone_runtime::journal::{Journal, JournalError, JournalFile};
use isochrone_runtime::{Alarm, IfMissed, Node, Running};
use isochrone_testing::{wait_for_ok, wait_for_some, wait_until};

use crate::journalled::{NODE, plan, start};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// Waits until something is in the journal of a running node.
fn await_entry(node: &mut Running<local::Service>, is_it: impl Fn(&Entry) -> bool) -> Entry {
    wait_for_some("it is in the journal", || {
        node.poll();
        node.journal(0).find(&is_it)
    })
}

/// Runs a node that is set once; returns the transaction's number.
fn run_once(path: &Path) -> u64 {
    let mut node = start(path);
    let number = node.set([("ramp.setChangeRate", 2.5)]).unwrap().number;
    await_entry(&mut node, |entry| entry.transaction == number);
    node.finish().unwrap();
    number
}

/// The line of the first entry, from 1: missed cycles may come before it.
fn entry_line(text: &str) -> usize {
    1 + text.lines().position(|line| line.starts_with("{\"entry\"")).unwrap()
}

fn refused(path: &Path) -> String {
    Journal::open(path, &plan(NODE)).unwrap_err().to_string()
}

#[test]
fn what_is_done_is_read_again_as_it_was_with_who_and_when() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    let mut node = start(&path);
    let set = node.set([("ramp.setChangeRate", 2.5)]).unwrap().number;
    node.set([("raw", 4.0)]).unwrap();
    let force = node.force([("raw", 7.0)], Hold::Seconds(0.003)).unwrap().number;
    await_entry(&mut node, |entry| entry.action == Action::Expiry);
    let undo = node.undo(set).unwrap().number;
    await_entry(&mut node, |entry| entry.transaction == undo);
    let written: Vec<Entry> = node.journal(0).collect();
    node.finish().unwrap();

    let file = JournalFile::read(&path).unwrap();
    let run = file.run(None).unwrap();
    assert_eq!((file.runs.len(), run.header.content.run, file.cut_line), (1, 1, None));
    assert_eq!(run.header.content.sha256, plan(NODE).source.sha256());
    let read = file.entries(run, &plan(NODE)).unwrap();
    let read: Vec<Entry> = read.into_values().flatten().collect();
    assert_eq!(read.len(), written.len());
    for entry in &written {
        assert!(read.contains(entry), "{entry:?}\nis not in\n{read:?}");
    }
    let actions: Vec<_> = run.entries.iter().map(|entry| entry.content.transaction).collect();
    assert_eq!(actions, [set, force, force, undo], "what the program feeds is no operation");
}

#[test]
fn runs_follow_each_other_in_a_file_and_transactions_are_counted_on() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    let numbers = [run_once(&path), run_once(&path), run_once(&path)];
    assert!(numbers.is_sorted_by(|a, b| a < b), "{numbers:?}");
    let file = JournalFile::read(&path).unwrap();
    let of_run = |run: u64| {
        let run = file.run(Some(run)).unwrap();
        run.entries.iter().map(|entry| entry.content.transaction).collect::<Vec<_>>()
    };
    assert_eq!([of_run(1), of_run(2), of_run(3)], numbers.map(|number| vec![number]));
    assert_eq!(file.run(None).unwrap().header.content.run, 3);
    let told = file.run(Some(4)).unwrap_err().to_string();
    assert!(told.ends_with("has no run 4; its runs are 1 to 3"), "{told}");
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
        fs::OpenOptions::new().append(true).open(&path).unwrap().write_all(text).unwrap();
    };
    add(b"{\"entry\":{\"sequence\":2,\"transa");
    let file = JournalFile::read(&path).unwrap();
    // The node may have missed cycles, which has a line of its own.
    let cut = whole.lines().count() + 1;
    assert_eq!((file.cut_line, file.runs[0].entries.len()), (Some(cut), 1));
    let journal = Journal::open(&path, &plan(NODE)).unwrap();
    assert!(journal.had_cut_line());
    assert_eq!(journal.run(), 2);
    drop(journal);
    assert_eq!(fs::read_to_string(&path).unwrap(), whole);
    run_once(&path);
    assert_eq!(JournalFile::read(&path).unwrap().runs.len(), 2);
    // A last line that lacks nothing but its end is a line.
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.trim_end()).unwrap();
    run_once(&path);
    assert_eq!(JournalFile::read(&path).unwrap().runs.len(), 3);
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
        let read = JournalFile::read(&path).unwrap_err().to_string();
        assert!(read.contains(told), "{read}");
        assert_eq!(refused(&path), read);
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
    }
    fs::write(&path, "").unwrap();
    let told = JournalFile::read(&path).unwrap_err().to_string();
    assert!(told.contains("has no runs"), "{told}");
}

#[test]
fn a_line_in_the_middle_that_is_broken_is_named() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    run_once(&path);
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("{\"entry\"", "{\"enrty\"")).unwrap();
    let told = JournalFile::read(&path).unwrap_err().to_string();
    let line = entry_line(&text);
    let expected = format!("j.jsonl:{line}: no line of a journal: unknown variant `enrty`");
    assert!(told.contains(&expected), "{told}");
}

#[test]
fn a_run_of_another_configuration_or_with_edited_entries_is_not_repeated() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    run_once(&path);
    let file = JournalFile::read(&path).unwrap();
    let other = plan(&NODE.replace("10.0", "11.0"));
    let told = file.entries(&file.runs[0], &other).unwrap_err();
    assert!(matches!(told, JournalError::OtherConfiguration { line: 1, .. }), "{told}");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("ramp.setChangeRate", "ramp.setChangeRat")).unwrap();
    let file = JournalFile::read(&path).unwrap();
    let told = file.entries(&file.runs[0], &plan(NODE)).unwrap_err().to_string();
    let place = format!("j.jsonl:{}: ", entry_line(&text));
    assert!(told.contains(&place) && told.contains("did you mean"), "{told}");
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
fn a_change_of_the_configuration_is_written_with_its_text_and_can_be_repeated() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    let mut node = start(&path);
    let next = NODE.replace("10.0", "11.0");
    let prepared = node.prepare_apply(&next, Client::Program, None).unwrap();
    node.apply(prepared, IfMissed::Allow).unwrap();
    await_entry(&mut node, |entry| entry.action == Action::Apply);
    node.finish().unwrap();
    let file = JournalFile::read(&path).unwrap();
    let entries = &file.runs[0].entries;
    assert_eq!(entries.len(), 1);
    assert_eq!(entries[0].content.configuration.as_deref(), Some(next.as_str()));
    let repeated = file.entries(&file.runs[0], &plan(NODE)).unwrap();
    let actions: Vec<_> = repeated.values().flatten().map(|entry| entry.action).collect();
    assert_eq!(actions, [Action::Apply]);
}

/// Waits until a file has the entry of a transaction.
fn await_line(node: &mut Running<local::Service>, path: &Path, transaction: u64) {
    let line = format!("\"transaction\":{transaction},");
    wait_until(&format!("{} has {line}", path.display()), || {
        node.poll();
        fs::read_to_string(path).is_ok_and(|text| text.contains(&line))
    });
}

fn transactions(path: &Path) -> Vec<u64> {
    let file = JournalFile::read(path).unwrap();
    let run = file.run(None).unwrap();
    assert!(file.entries(run, &plan(NODE)).is_ok(), "it can be repeated");
    run.entries.iter().map(|entry| entry.content.transaction).collect()
}

#[test]
fn a_file_that_is_renamed_or_removed_is_written_anew_with_all_of_the_run() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    run_once(&path);
    let mut node = start(&path);
    let set = |node: &mut Running<local::Service>, rate: f64| {
        let number = node.set([("ramp.setChangeRate", rate)]).unwrap().number;
        await_line(node, &path, number);
        number
    };
    let first = set(&mut node, 2.0);
    let renamed = folder.path().join("j.jsonl.1");
    fs::rename(&path, &renamed).unwrap();
    // What is done from now on stands in both where it comes before the look at the file.
    let second = set(&mut node, 3.0);
    // What a rotation has made already is taken as it is.
    fs::rename(&path, folder.path().join("j.jsonl.2")).unwrap();
    fs::write(&path, "").unwrap();
    let third = set(&mut node, 4.0);
    fs::remove_file(&path).unwrap();
    let fourth = set(&mut node, 5.0);
    node.finish().unwrap();
    assert_eq!(transactions(&path), [first, second, third, fourth]);
    let old = JournalFile::read(&renamed).unwrap();
    assert_eq!(old.runs.len(), 2);
    assert!(old.runs[1].end.is_none());
    assert_eq!(transactions(&renamed)[0], first);
    let new = JournalFile::read(&path).unwrap();
    assert_eq!((new.runs.len(), new.runs[0].header.content.run), (1, 2));
    assert!(new.runs[0].end.is_some());
    assert_eq!(new.runs[0].header.content, old.runs[1].header.content);
    run_once(&path);
    assert_eq!(JournalFile::read(&path).unwrap().runs[1].header.content.run, 3);
}

#[test]
fn what_is_truncated_away_is_lost_and_the_run_is_not_repeated_without_it() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    let mut node = start(&path);
    let first = node.set([("ramp.setChangeRate", 2.0)]).unwrap().number;
    await_line(&mut node, &path, first);
    fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(0).unwrap();
    let second = node.set([("ramp.setChangeRate", 3.0)]).unwrap().number;
    await_line(&mut node, &path, second);
    node.finish().unwrap();
    let file = JournalFile::read(&path).unwrap();
    let run = file.run(None).unwrap();
    assert!(run.header.content.is_cut && run.end.is_some());
    let numbers: Vec<_> = run.entries.iter().map(|entry| entry.content.transaction).collect();
    assert_eq!(numbers, [second]);
    let refused = file.entries(run, &plan(NODE)).unwrap_err();
    assert!(matches!(refused, JournalError::Cut { line: 1, run: 1, .. }), "{refused}");
}

/// Waits until a node refuses changes for a reason.
fn await_refusal(node: &mut Running<local::Service>, reason: &str) {
    let mut rate = 3.0;
    wait_until(&format!("it is refused: {reason}"), || {
        node.poll();
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
        let mut node = start(&path);
        fs::write(&other, text).unwrap();
        let held = fs::File::open(&other).unwrap();
        if is_held {
            held.lock().unwrap();
        }
        fs::rename(&other, &path).unwrap();
        await_refusal(&mut node, reason);
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
    let mut node = start(&path);
    fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(20).unwrap();
    let left = fs::read(&path).unwrap();
    await_refusal(&mut node, ":1: no line of a journal");
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
    let mut node = start(&path);
    let first = node.set([("ramp.setChangeRate", 2.0)]).unwrap().number;
    await_line(&mut node, &path, first);
    fs::rename(&inner, &away).unwrap();
    await_refusal(&mut node, "cannot be written (No such file");
    fs::rename(&away, &inner).unwrap();
    let last = wait_for_ok("it is not refused any more", || {
        node.poll();
        node.set([("ramp.setChangeRate", 2.0)])
    });
    let last = last.number;
    await_line(&mut node, &path, last);
    node.finish().unwrap();
    let numbers = transactions(&path);
    assert!(numbers.first() == Some(&first) && numbers.last() == Some(&last), "{numbers:?}");
}

/// Waits until a release is told; whether its entry was in the file then.
fn await_told(node: &mut Running<local::Service>, transaction: u64) -> bool {
    wait_for_some("it is told", || {
        let news = node.poll();
        let is_told = news.applied().iter().any(|entry| entry.transaction == transaction);
        is_told.then(|| !news.unwritten().contains(&transaction))
    })
}

#[test]
fn what_happens_while_the_file_is_not_at_its_place_is_written_to_where_it_is() {
    let folder = folder();
    let (inner, away) = (folder.path().join("inner"), folder.path().join("away"));
    fs::create_dir(&inner).unwrap();
    let path = inner.join("j.jsonl");
    let mut node = start(&path);
    node.force([("raw", 7.0)], Hold::UntilReleased).unwrap();
    fs::rename(&inner, &away).unwrap();
    await_refusal(&mut node, "cannot be written (No such file");
    let release = node.release(["raw"]).unwrap().number;
    let is_written = await_told(&mut node, release);
    let line = format!("\"transaction\":{release},");
    let text = fs::read_to_string(away.join("j.jsonl")).unwrap();
    // A disk that takes longer than a second is a reason of its own.
    assert!(text.contains(&line) || !is_written, "{text}");
    await_line(&mut node, &away.join("j.jsonl"), release);
    node.finish().unwrap();
}

#[test]
fn what_happens_while_the_file_cannot_be_written_is_told_with_that_and_written_when_it_can_be() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    let mut node = start(&path);
    let force = node.force([("raw", 7.0)], Hold::UntilReleased).unwrap().number;
    await_line(&mut node, &path, force);
    fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(20).unwrap();
    await_refusal(&mut node, ":1: no line of a journal");
    let release = node.release(["raw"]).unwrap().number;
    assert!(!await_told(&mut node, release));
    // What is left of the file is nothing; the way out is to remove it.
    fs::remove_file(&path).unwrap();
    await_line(&mut node, &path, release);
    node.finish().unwrap();
    let file = JournalFile::read(&path).unwrap();
    let run = file.run(None).unwrap();
    assert!(run.header.content.is_cut && run.end.is_some());
    assert!(run.entries.iter().is_sorted_by_key(|entry| entry.content.sequence));
}

#[test]
fn one_run_is_read_without_the_others() {
    let folder = folder();
    let path = folder.path().join("j.jsonl");
    let _ = [run_once(&path), run_once(&path), run_once(&path)];
    let whole = JournalFile::read(&path).unwrap();
    for (number, index) in [(None, 2), (Some(1), 0), (Some(2), 1), (Some(3), 2)] {
        let file = JournalFile::read_run(&path, number).unwrap();
        assert_eq!(file.runs.len(), 1);
        assert_eq!(file.runs[0].header, whole.runs[index].header);
        assert_eq!(file.runs[0].entries, whole.runs[index].entries);
        assert_eq!(file.runs[0].end, whole.runs[index].end);
    }
    let told = JournalFile::read_run(&path, Some(4)).unwrap_err().to_string();
    assert!(told.ends_with("has no run 4; its runs are 1 to 3"), "{told}");
}

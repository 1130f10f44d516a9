//! Where a journal goes on: its file is full, or was renamed, removed or truncated by others.

use std::fs::{self, OpenOptions};
use std::path::Path;

use isochrone_model::Hold;
use isochrone_runtime::journal::RunHeader;
use isochrone_runtime::{Alarm, Running};
use isochrone_testing::{wait_for_ok, wait_until};

use crate::happened::take_until;
use crate::journal::{Run, folder, run_once, runs};
use crate::journalled::{NODE, start};

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

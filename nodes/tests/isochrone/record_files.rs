//! Files that recordings are written in and read from: what others do to them meanwhile, and signals.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::Write;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{FileTypeExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::mpsc::channel;
use std::thread;
use std::time::SystemTime;

use isochrone_recording::Reader;
use isochrone_testing::plants::SAW;
use isochrone_testing::{Domain, Process, wait_until};
use rustix::process::{Pid, Resource, Rlimit, getrlimit, prlimit};
use serde_json::Value;

/// A domain with a node that runs.
pub(crate) fn plant() -> (Domain, Process) {
    let domain = Domain::new();
    let node = domain.start_node("saw.toml", SAW, "");
    (domain, node)
}

/// Starts a program that writes a recording, and waits until a whole chunk of frames is in it: what is cut off
/// before cannot be read.
pub(crate) fn recording(domain: &Domain, arguments: &str, file: &str) -> Process {
    let before = SystemTime::now();
    let mut recorder = domain.start(arguments);
    recorder.wait_for("Press Ctrl-C to end it.");
    wait_until("frames are in the file", || {
        let Ok(file) = File::open(domain.path(file)) else { return false };
        // One of this name may have been there.
        if file.metadata().unwrap().modified().unwrap() < before {
            return false;
        }
        Reader::open(file).is_ok_and(|mut reader| reader.skip_cycle().unwrap())
    });
    recorder
}

/// How many chunks of frames are whole in a file.
fn chunks(file: &Path) -> usize {
    const MAGIC_BYTES: usize = 8;
    const CHUNK: u8 = 0x06;
    let (bytes, mut at, mut chunks) = (fs::read(file).unwrap(), MAGIC_BYTES, 0);
    while let Some((code, length)) = bytes.get(at..at + 9).and_then(<[u8]>::split_first) {
        at += 9 + u64::from_le_bytes(length.try_into().unwrap()) as usize;
        chunks += usize::from(*code == CHUNK && at <= bytes.len());
    }
    chunks
}

fn pipe(domain: &Domain, name: &str) -> PathBuf {
    let path = domain.path(name);
    assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
    assert!(fs::metadata(&path).unwrap().file_type().is_fifo());
    path
}

/// How many frames or rows can be read of a file.
pub(crate) fn read(path: PathBuf) -> u64 {
    let mut reader = Reader::open(File::open(path).unwrap()).unwrap();
    let mut read = 0;
    while let Some(item) = reader.next_item().unwrap() {
        read += u64::from(item.is_cycle());
    }
    assert_eq!(reader.condition().damaged, 0);
    read
}

#[test]
fn a_recording_that_is_being_written_is_left_to_its_writer() {
    let (domain, node) = plant();
    let recorder = recording(&domain, "record plant/saw -o out.mcap --json", "out.mcap");
    domain.write("other.toml", SAW.replace("saw\"\n[[task", "other\"\n[[task"));
    let refused =
        domain.run("run other.toml --report out.mcap --seconds 0.1").expect_code(2).stderr;
    assert!(refused.contains("cannot write out.mcap: it is being written already"), "{refused}");
    let ended = recorder.stop().expect_code(0);
    let summary: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(summary["frames"], read(domain.path("out.mcap")));
    node.stop().expect_code(0);
}

#[test]
fn recordings_of_one_name_that_are_made_at_once_have_files_of_their_own() {
    let (domain, node) = plant();
    domain.write(
        "other.toml",
        SAW.replace("plant/saw", "other/saw").replace("saw\"\n[[task", "other\"\n[[task"),
    );
    let line = "record plant/saw -o out.mcap --json";
    let recorders = [(); 3].map(|()| domain.start(line));
    let mut other = domain.start("run other.toml --record out.mcap --report other.json");
    other.wait_for("is running");
    let files = ["out.mcap", "out_0002.mcap", "out_0003.mcap", "out_0004.mcap"];
    let has_cycle = |file| {
        let opened = Reader::open(File::open(domain.path(file)).unwrap());
        opened.is_ok_and(|mut reader| reader.skip_cycle().unwrap())
    };
    wait_until("all files are there", || files.iter().all(|file| domain.path(file).exists()));
    wait_until("frames are in all of them", || files.into_iter().all(has_cycle));
    let mut taken = Vec::new();
    for recorder in recorders {
        let ended = recorder.stop().expect_code(0);
        let summary: Value = serde_json::from_str(&ended.stdout).unwrap();
        let file = summary["files"][0]["path"].as_str().unwrap().to_owned();
        assert!(ended.stderr.contains(&format!(" in {file}. Press")), "{}", ended.stderr);
        assert_eq!(summary["frames"], read(domain.path(&file)));
        taken.push(file);
    }
    other.stop().expect_code(0);
    let recorded = domain.json("other.json")["recording"].clone();
    let file = recorded["file"].as_str().unwrap().to_owned();
    assert_eq!(recorded["cycles"], read(domain.path(&file)));
    taken.push(file);
    taken.sort();
    assert_eq!(taken, files);
    node.stop().expect_code(0);
}

#[test]
fn a_recording_whose_file_is_removed_or_cut_by_others_ends_and_is_no_success() {
    let (domain, node) = plant();
    let remove = |path: PathBuf| fs::remove_file(path).unwrap();
    let cut = |path: PathBuf| fs::write(path, "").unwrap();
    let was_removed = "it was removed or replaced while it was written";
    let was_cut = "another program changed its length while it was written";
    let cases = [(remove as fn(PathBuf), was_removed), (cut, was_cut)];
    for (harm, why) in cases {
        let recorder = recording(&domain, "record plant/saw -o out.mcap --json", "out.mcap");
        harm(domain.path("out.mcap"));
        let ended = recorder.finish().expect_code(1);
        assert!(ended.stderr.contains(why), "{}", ended.stderr);
        let summary: Value = serde_json::from_str(&ended.stdout).unwrap();
        assert_eq!((&summary["frames"], &summary["is_complete"]), (&0.into(), &false.into()));
    }
    node.stop().expect_code(0);
    for (harm, why) in cases {
        let line = "run saw.toml --record own.mcap --report own.json";
        let mut node = recording(&domain, line, "own.mcap");
        harm(domain.path("own.mcap"));
        node.wait_for(why);
        let ended = node.stop().expect_code(1);
        assert!(ended.stderr.contains("the node goes on without it"), "{}", ended.stderr);
        let report = domain.json("own.json");
        assert_eq!(report["recording"]["cycles"], 0);
        assert_eq!(report["recording"]["is_complete"], false);
        let warnings = report["warnings"].as_array().unwrap();
        assert!(warnings.iter().any(|it| it["code"] == "recording_incomplete"), "{warnings:?}");
    }
}

#[test]
fn a_recording_replaces_no_file_and_takes_the_next_number() {
    let (domain, node) = plant();
    let old = ["out.mcap", "out_0002.mcap", "out_0003.mcap", "out_0004.mcap", "out_0005.mcap"];
    for file in old.iter().chain(&["out_new.mcap", "outer_0009.mcap"]) {
        domain.write(file, "old");
    }
    let recorder = recording(&domain, "record plant/saw -o out.mcap --json", "out_0006.mcap");
    let ended = recorder.stop().expect_code(0);
    assert!(ended.stderr.contains("recording 1 service in out_0006.mcap."), "{}", ended.stderr);
    let summary: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(summary["files"][0]["path"], "out_0006.mcap");
    node.stop().expect_code(0);

    let line = "run saw.toml --record out.mcap --report node.json";
    let ended = recording(&domain, line, "out_0007.mcap").stop().expect_code(0);
    let told = "note: out.mcap is there already; recording in out_0007.mcap\n";
    assert!(ended.stderr.contains(told), "{}", ended.stderr);
    assert!(ended.stdout.contains("recording out_0007.mcap: "), "{}", ended.stdout);
    assert_eq!(domain.json("node.json")["recording"]["file"], "out_0007.mcap");
    // One that was not closed is a file like any other.
    recording(&domain, line, "out_0008.mcap").kill();
    let left = fs::read(domain.path("out_0008.mcap")).unwrap();
    let mut export = Command::new(env!("CARGO_BIN_EXE_isochrone"));
    export.args(["export", "out_0008.mcap", "-o", "out.mcap"]).current_dir(domain.path(""));
    let closed = Process::start(export).finish().expect_code(0).stderr;
    assert!(closed.contains("out_0009.mcap: "), "{closed}");
    assert!(fs::read(domain.path("out_0008.mcap")).unwrap() == left);
    // A link is followed, and what it leads to is kept as well.
    fs::create_dir(domain.path("far")).unwrap();
    symlink("far/there.mcap", domain.path("link.mcap")).unwrap();
    for file in ["far/there.mcap", "far/there_0002.mcap"] {
        recording(&domain, "run saw.toml --record link.mcap", file).stop().expect_code(0);
        assert!(read(domain.path(file)) > 0);
    }
    for file in old {
        assert_eq!(domain.read(file), "old");
    }
}

#[test]
fn a_series_of_files_goes_on_behind_an_older_one() {
    let (domain, node) = plant();
    domain.write("out_0007.mcap", "old");
    let folder = domain.path("");
    let line = format!("record plant/saw -o {}/out.mcap --split 1h", folder.display());
    for file in ["out_0008.mcap", "out_0009.mcap"] {
        let ended = recording(&domain, &line, file).stop().expect_code(0);
        assert!(ended.stderr.contains(&format!("{file}. Press")), "{}", ended.stderr);
        assert!(read(domain.path(file)) > 0);
    }
    assert_eq!(domain.read("out_0007.mcap"), "old");
    assert!(!domain.path("out.mcap").exists());
    node.stop().expect_code(0);
}

#[test]
fn a_limit_of_file_sizes_ends_the_recording_and_not_the_node() {
    let domain = Domain::new();
    domain.write("saw.toml", SAW);
    let mut node = recording(&domain, "run saw.toml --record own.mcap", "own.mcap");
    let length = fs::metadata(domain.path("own.mcap")).unwrap().len();
    let maximum = getrlimit(Resource::Fsize).maximum;
    let limit = Rlimit { current: Some(length + 1000), maximum };
    let id = Pid::from_raw(node.id() as i32).unwrap();
    prlimit(Some(id), Resource::Fsize, limit).unwrap();
    node.wait_for("cannot be written (File too large");
    let ended = node.stop().expect_code(1);
    assert!(ended.stderr.contains("the node goes on without it"), "{}", ended.stderr);
    assert!(read(domain.path("own.mcap")) > 0);
}

#[test]
fn a_recording_that_finds_no_room_counts_what_is_in_its_file_and_says_what_is_not() {
    let (domain, node) = plant();
    for (json, file) in [("--json", "out.mcap"), ("", "out_0002.mcap")] {
        let line = format!("record plant/saw -o out.mcap {json}");
        let recorder = recording(&domain, line.trim(), file);
        // The first chunk may be half-way into the file, and is then cut off.
        wait_until("a second chunk is in the file", || chunks(&domain.path(file)) > 1);
        let length = fs::metadata(domain.path(file)).unwrap().len();
        let maximum = getrlimit(Resource::Fsize).maximum;
        let limit = Rlimit { current: Some(length + 1000), maximum };
        let id = Pid::from_raw(recorder.id() as i32).unwrap();
        prlimit(Some(id), Resource::Fsize, limit).unwrap();
        let ended = recorder.finish().expect_code(1);
        let frames = read(domain.path(file));
        let way_out = format!("use `isochrone export {file} -o closed.mcap`");
        assert!(ended.stderr.contains(&way_out), "{}", ended.stderr);
        if json.is_empty() {
            let counted = format!("{frames} frames of 1 service, ");
            assert!(ended.stderr.contains(&counted), "{counted}: {}", ended.stderr);
            assert!(!ended.stderr.contains(" 0 lost"), "{}", ended.stderr);
            continue;
        }
        let summary: Value = serde_json::from_str(&ended.stdout).unwrap();
        let service = &summary["services"][0];
        assert_eq!((&summary["frames"], &service["frames"]), (&frames.into(), &frames.into()));
        assert_eq!(summary["unwritten_frames"], service["unwritten"]);
        assert!(service["unwritten"].as_u64() > Some(0), "{summary}");
        assert_eq!(summary["is_complete"], false);
    }
    node.stop().expect_code(0);
}

#[test]
fn who_reads_a_pipe_that_nobody_writes_is_told_that_it_waits_and_ends_on_a_signal() {
    let domain = Domain::new();
    pipe(&domain, "pipe");
    for verb in ["replay pipe", "export pipe -o out.csv", "publish --from pipe"] {
        let reader = domain.start_until(verb, "waiting until somebody writes the pipe pipe");
        reader.stop().expect_code(2).says(&["cannot read pipe: nobody writes this pipe"]);
    }
}

#[test]
fn whoever_reads_a_recording_from_a_pipe_and_goes_is_told_to_stay() {
    let (domain, node) = plant();
    let path = pipe(&domain, "pipe");
    let reader = thread::spawn(move || {
        let mut some = [0; 64];
        std::io::Read::read_exact(&mut File::open(path).unwrap(), &mut some).unwrap();
    });
    let ended = domain.run("record plant/saw -o pipe").expect_code(1);
    reader.join().unwrap();
    assert!(ended.stderr.contains("Let its reader run until"), "{}", ended.stderr);
    assert!(!ended.stderr.contains("isochrone export"), "{}", ended.stderr);
    node.stop().expect_code(0);
}

#[test]
fn a_pipe_that_nobody_reads_is_waited_for_aloud_and_then_recorded_in() {
    let domain = Domain::new();
    domain.write("saw.toml", SAW);
    let path = pipe(&domain, "pipe");
    let mut node = domain.start("run saw.toml --record pipe --seconds 0.5");
    node.wait_for("waiting until somebody reads the pipe pipe");
    let copy = domain.path("copy.mcap");
    let reader = thread::spawn(move || {
        std::io::copy(&mut File::open(path).unwrap(), &mut File::create(copy).unwrap()).unwrap()
    });
    node.finish().expect_code(0);
    assert!(reader.join().unwrap() > 0 && read(domain.path("copy.mcap")) > 0);
    // One that handles signals already can be ended while it waits.
    fs::copy(domain.path("copy.mcap"), domain.path("in.mcap")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_isochrone"));
    command.args(["export", "in.mcap", "-o", "pipe"]).current_dir(domain.path(""));
    let mut export = Process::start(command);
    export.wait_for("waiting until somebody reads the pipe pipe");
    let ended = export.stop().expect_code(2);
    assert!(ended.stderr.contains("cannot write pipe: nobody reads this pipe"), "{}", ended.stderr);
}

#[test]
fn an_export_of_a_file_without_end_is_ended_by_a_signal() {
    let domain = Domain::new();
    let path = pipe(&domain, "endless.mcap");
    for output in ["out.csv", "out.mcap"] {
        let path = path.clone();
        let (tell, is_read) = channel();
        let writer = thread::spawn(move || {
            let mut file = File::options().write(true).open(path).unwrap();
            file.write_all(b"\x89MCAP0\r\n").unwrap();
            // Records of a kind that is somebody's own, and more of them than a pipe holds.
            let records = [0x80, 1, 0, 0, 0, 0, 0, 0, 0, 7].repeat(20_000);
            file.write_all(&records).unwrap();
            tell.send(()).unwrap();
            while file.write_all(&records).is_ok() {}
        });
        let mut command = Command::new(env!("CARGO_BIN_EXE_isochrone"));
        command.args(["export", "endless.mcap", "-o", output]).current_dir(domain.path(""));
        let mut export = Process::start(command);
        export.wait_until_it_handles_signals();
        is_read.recv().unwrap();
        let ended = export.stop().expect_code(1);
        assert!(ended.stderr.contains("ended by a signal before"), "{}", ended.stderr);
        writer.join().unwrap();
    }
    assert!(!domain.path("out.csv").exists());
    assert_eq!(read(domain.path("out.mcap")), 0);
}

#[test]
fn a_file_may_have_a_name_that_is_no_unicode() {
    let domain = Domain::new();
    domain.write("saw.toml", SAW);
    let name = OsStr::from_bytes(b"saw\xff.mcap");
    let mut command = Command::new(env!("CARGO_BIN_EXE_isochrone"));
    command.args(["run", "saw.toml", "--seconds", "0.3", "--report", "saw.json", "--record"]);
    command.arg(name).arg("--iceoryx2-config").arg(domain.config_file());
    command.current_dir(domain.path(""));
    Process::start(command).finish().expect_code(0);
    assert!(read(domain.path("").join(name)) > 0);
    let arguments = &domain.json("saw.json")["command"];
    assert!(arguments.to_string().contains("saw\u{fffd}.mcap"), "{arguments}");
}

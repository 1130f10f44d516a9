//! Two machines and iceoryx2's own link between them.

use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

use crate::machines::{Boot, Machine, Machines};
use isochrone_testing::plants::{counter, follower};
use isochrone_testing::{Process, wait_for_some, wait_until};
use serde_json::{Value, json};

/// What the link lets wait, as far as it says, before it drops frames.
const ROOM: u64 = 64;
/// The most that wait anywhere on the way.
const LONGEST_BUFFER: u64 = 256;

/// After so long without a frame there is none on its way.
const QUIET: Duration = Duration::from_secs(5);

fn start_counter(machine: &Machine, name: &str, period: &str, cycles: u64) -> Process {
    let file = format!("{name}.toml");
    machine.domain.write(&file, counter(name, period));
    machine.start(&format!("run {file} --cycles {cycles}"))
}

/// A frame as a reader saw it.
#[derive(Clone, Copy)]
struct Seen {
    sequence: u64,
    cycle: u64,
    age_us: f64,
    value: u64,
}

/// The frames that `subscribe` printed: sequence, cycle, age, unit, values.
fn frames(stdout: &str) -> Vec<Seen> {
    let frame = |line: &str| {
        let mut words = line.split_whitespace();
        let (sequence, cycle, age, _, value) =
            (words.next()?, words.next()?, words.next()?, words.next()?, words.next()?);
        Some(Seen {
            sequence: sequence.parse().ok()?,
            cycle: cycle.parse().ok()?,
            age_us: age.parse().ok()?,
            value: value.strip_prefix("saw.value=")?.parse::<f64>().ok()? as u64,
        })
    };
    stdout.lines().filter_map(frame).collect()
}

/// The sequences that are missing, from one on.
fn gaps(frames: &[Seen], from: u64) -> Vec<RangeInclusive<u64>> {
    let sequences = frames.iter().map(|frame| frame.sequence);
    let from = [from].into_iter().chain(sequences.clone().map(|sequence| sequence + 1));
    let gaps = from.zip(sequences).filter(|(from, next)| from < next);
    gaps.map(|(from, next)| from..=next - 1).collect()
}

/// Frames are lost only where so many were under way that some buffer was full: then those around the gap are
/// late by as many periods.
#[track_caller]
fn assert_lost_only_for_want_of_room(frames: &[Seen], period_us: f64) {
    for gap in gaps(frames, 0) {
        let around = gap.start().saturating_sub(LONGEST_BUFFER)..=gap.end() + LONGEST_BUFFER;
        let near = frames.iter().filter(|frame| around.contains(&frame.sequence));
        let late = near.map(|frame| frame.age_us / period_us).fold(0.0, f64::max);
        assert!(
            late >= ROOM as f64 / 2.0,
            "{gap:?} are lost though no frame was {late} periods late"
        );
    }
}

/// How many frames a reader says that it received and lost.
fn counted(stderr: &str) -> (u64, u64) {
    let line = stderr.lines().find(|line| line.ends_with(" lost")).unwrap();
    let mut numbers = line.split_whitespace().filter_map(|word| word.parse().ok());
    (numbers.next().unwrap(), numbers.next().unwrap())
}

/// Waits for the last frame, or until none comes any more: a link that lags drops the newest.
fn wait_for_the_last(reader: &mut Process) {
    let mut longest = (0, Instant::now());
    reader.wait_until("the last frame", |stdout, _| {
        if stdout.len() > longest.0 {
            longest = (stdout.len(), Instant::now());
        }
        let is_quiet = longest.0 > 0 && longest.1.elapsed() >= QUIET;
        is_quiet || stdout.contains("[STOPPED]")
    });
}

/// Both directions at once, at one rate.
fn values_cross_both_ways(period: &str, period_us: f64, cycles: u64) {
    let Some(machines) = Machines::connect(Boot::Same) else { return };
    let Machines { near, far } = &machines;
    let links = machines.link("plant/there plant/back");
    let mut readers = [far.start("subscribe plant/there"), near.start("subscribe plant/back")];
    readers.iter_mut().for_each(|reader| reader.wait_for("subscribed to"));
    let nodes =
        [start_counter(near, "there", period, cycles), start_counter(far, "back", period, cycles)];
    for node in nodes {
        node.finish().expect_code(0);
    }
    for mut reader in readers {
        wait_for_the_last(&mut reader);
        let ended = reader.stop().expect_code(0);
        let frames = frames(&ended.stdout);
        let (received, lost) = counted(&ended.stderr);
        // Every frame that was sent came or is counted as lost, and none came twice.
        assert_eq!(received, frames.len() as u64, "{}", ended.stdout);
        let (first, last) = (frames[0], frames[frames.len() - 1]);
        assert_eq!(received + lost, last.sequence - first.sequence + 1);
        assert!(frames.windows(2).all(|pair| pair[0].sequence < pair[1].sequence));
        assert!(last.sequence <= cycles, "{} of {cycles}", last.sequence);
        // Each has the value of its cycle, whatever was lost before it.
        let in_step = |frame: &&Seen| frame.value == first.value + frame.cycle - first.cycle;
        assert_eq!(frames.iter().filter(in_step).count(), frames.len());
        assert_lost_only_for_want_of_room(&frames, period_us);
    }
    for link in links {
        link.stop().expect_code(0);
    }
    for machine in [near, far] {
        assert_eq!(machine.domain.leftovers(), Vec::<std::path::PathBuf>::new());
    }
}

#[test]
fn values_cross_both_ways_at_500_hz() {
    values_cross_both_ways("2ms", 2000.0, 2000);
}

#[test]
fn values_cross_both_ways_at_1_khz() {
    values_cross_both_ways("1ms", 1000.0, 4000);
}

/// Follows the counter there, and shows what its input is worth.
fn reader_node() -> String {
    follower("there", "5ms")
        + r#"max_age = "10s"
[[output]]
service = "plant/seen"
signals = ["there", "there.ok", "there.age"]
"#
}

#[test]
fn a_far_service_has_its_names_and_no_times_of_another_clock() {
    let Some(machines) = Machines::connect(Boot::Another) else { return };
    let Machines { near, far } = &machines;
    let _links = machines.link("plant/there");
    let _node = start_counter(near, "there", "2ms", 1_000_000);
    let mut frames = far.start("subscribe plant/there");
    frames.wait_for("saw.value=");
    let listed = |machine: &Machine| -> Value {
        let listed = machine.start("list --json").finish().expect_code(0).json();
        let services = listed["services"].as_array().unwrap();
        services.iter().find(|service| service["name"] == "plant/there").unwrap().clone()
    };
    let signals = json!([{"name": "saw.value", "type": "INT"}]);
    for (machine, is_far) in [(near, false), (far, true)] {
        let service = wait_for_some("the list has the signals", || {
            Some(listed(machine)).filter(|service| service["signals"] == signals)
        });
        assert_eq!((&service["rate_hz"], &service["is_far"]), (&json!(500.0), &json!(is_far)));
    }
    // On a machine that is busy with other tests an announcement may come after the look.
    let from = "from  there on another machine, through iox2-link-tunn";
    wait_until("the list names the node behind the link", || {
        far.start("list").finish().expect_code(0).stdout.contains(from)
    });

    let stats =
        far.start("subscribe plant/there --stats --json --count 500").finish().expect_code(0);
    let report = stats.json();
    assert_eq!(report["links"][0]["one_way_ns"], json!({"count": 0}), "{report}");
    assert_eq!(report["warnings"][0]["code"], "foreign_host", "{report}");
    assert!(stats.stderr.contains("runs on another machine"), "{}", stats.stderr);

    far.domain.write("reader.toml", reader_node());
    let mut node = far.start("run reader.toml --json");
    let mut seen = far.start("subscribe plant/seen");
    seen.wait_for("there.ok=TRUE");
    far.start("chain plant/there plant/seen --seconds 1")
        .finish()
        .expect_code(2)
        .says(&["is sent by another machine"]);
    node.wait_for("follows service \"plant/there\", which another machine sends");
    let report = node.stop().expect_code(0).json();
    let codes: Vec<_> = report["warnings"].as_array().unwrap().iter().map(|w| &w["code"]).collect();
    for code in ["foreign_host", "far_follow"] {
        assert!(codes.contains(&&json!(code)), "{codes:?}");
    }
}

#[test]
fn a_service_that_another_machine_writes_is_refused_until_its_writer_has_ended() {
    let Some(machines) = Machines::connect(Boot::Same) else { return };
    let Machines { near, far } = &machines;
    let _links = machines.link("plant/there");
    let writer = start_counter(near, "there", "2ms", 1_000_000);
    let mut reader = far.start("subscribe plant/there");
    reader.wait_for("saw.value=");
    far.domain.write("there.toml", counter("there", "2ms"));
    let mut recorder = far.start("record --output there.mcap plant/there");
    // At once, or as soon as the layout has come over.
    recorder.wait_for("saw.value");
    recorder.stop().expect_code(0);
    let seconds = ["run there.toml", "publish plant/there --value 1", "publish --from there.mcap"];
    for second in seconds {
        // It looks for a moment who that is. On a busy machine no layout may come by in that time.
        wait_until("the writer is named", || {
            let ended = far
                .start(second)
                .finish()
                .expect_code(1)
                .says(&["\"plant/there\" is written on another machine already", "iox2-link-t"]);
            ended.stderr.contains("by \"there\"")
        });
    }
    // Who reads the service, and writes others, is not refused.
    far.domain.write("reader.toml", reader_node());
    let mut node = far.start("run reader.toml");
    node.wait_for("is running");
    writer.stop().expect_code(0);
    let next = start_counter(far, "there", "2ms", 1_000_000);
    let mut back = near.start("subscribe plant/there");
    back.wait_for("saw.value=");
    // Its counter begins anew. The last frame of the one before may be lost on a busy link.
    reader.wait_until("frames of the next writer", |stdout, _| {
        let values =
            stdout.lines().filter_map(|line| line.split_once("saw.value=")?.1.parse().ok());
        let values: Vec<u32> = values.collect();
        values.windows(2).any(|pair| pair[1] < pair[0])
    });
    next.stop().expect_code(0);
}

/// The values of a service that two publish, as a reader prints them until many of its own machine's came.
fn values_of_own(machine: &Machine, own: &str) -> String {
    let mut reader = machine.start("subscribe plant/x --every 1");
    reader.wait_until("many frames", |stdout, _| stdout.matches(own).count() > 1500);
    reader.stop().expect_code(0).stdout
}

#[test]
fn readers_keep_to_the_writer_of_their_machine_when_both_write_and_the_links_say_so() {
    let Some(machines) = Machines::connect(Boot::Another) else { return };
    let Machines { near, far } = &machines;
    // The far one starts later, so the reader here would follow its term.
    let mut first = near.start("publish plant/x --value 1 --signals x");
    first.wait_for("publishing");
    let mut second = far.start("publish plant/x --value 2 --signals x");
    second.wait_for("publishing");
    let mut before = near.start("subscribe plant/x --stats --json");
    before.wait_for("subscribed");
    let mut links = machines.link("plant/x");
    for link in &mut links {
        link.wait_for("\"plant/x\" is written on both machines, by \"publish\" here");
    }
    for (machine, own, other) in [(near, "x=1.0", "x=2.0"), (far, "x=2.0", "x=1.0")] {
        let printed = values_of_own(machine, own);
        assert_eq!(printed.matches(other).count(), 0, "{own}");
    }
    let report = before.stop().expect_code(0).json();
    let link = &report["links"][0];
    assert!(link["other_writers"].as_u64().unwrap() > 0, "{link}");
    assert_eq!(link["restarts"], 0, "{link}");
    // The readers here go on with the other one when theirs has ended.
    first.stop().expect_code(0);
    links[0].wait_for("has one writer again");
    near.start("subscribe plant/x --count 1").finish().expect_code(0);
}

#[test]
fn a_link_that_is_killed_on_either_side_is_started_again_and_frames_cross_again() {
    let Some(machines) = Machines::connect(Boot::Same) else { return };
    let Machines { near, far } = &machines;
    let mut links = machines.link("plant/there");
    let _node = start_counter(near, "there", "2ms", 1_000_000);
    let mut reader = far.start("subscribe plant/there");
    reader.wait_for("saw.value=");
    for (times, link) in links.iter_mut().enumerate() {
        let pid = child_of(link.id());
        rustix::process::kill_process(pid, rustix::process::Signal::KILL).unwrap();
        link.wait_for("it is started again");
        // There is a gap, and frames behind it.
        reader.wait_until("frames after the gap", |stdout, _| {
            let frames = frames(stdout);
            let wide = |gap: &RangeInclusive<u64>| gap.end() - gap.start() >= 10;
            gaps(&frames, frames[0].sequence).iter().filter(|gap| wide(gap)).count() > times
        });
    }
    let ended = reader.stop().expect_code(0);
    let (received, lost) = counted(&ended.stderr);
    let frames = frames(&ended.stdout);
    let last = frames[frames.len() - 1];
    assert_eq!(received + lost, last.sequence - frames[0].sequence + 1);
}

/// The only child of a process.
fn child_of(pid: u32) -> rustix::process::Pid {
    let children = std::fs::read_to_string(format!("/proc/{pid}/task/{pid}/children")).unwrap();
    let child = children.split_whitespace().next().unwrap().parse().unwrap();
    rustix::process::Pid::from_raw(child).unwrap()
}

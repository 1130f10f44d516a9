//! The programs in Python that use iceoryx2 alone, against real processes.
//!
//! They need `pip install iceoryx2==0.10.0`.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::interpreter;
use isochrone_cyclic::epoch_after_ns;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{Depth, FrameSubscriber, ipc};
use isochrone_testing::plants::tank;
use isochrone_testing::{Domain, Plant, Process, wait_for_some};
use rustix::process::Signal;

fn reader() -> Plant {
    Plant::new("reader")
        .task("t", "5ms")
        .input("wave", "plant/python", "signal = \"sine\"\ndefault = -9.0")
        .input("n", "plant/python", "type = \"INT\"\nsignal = \"count\"")
        .output("plant/level", &["wave", "n"])
}

/// A Python that has iceoryx2.
fn python() -> Option<PathBuf> {
    interpreter::python("iceoryx2", "iceoryx2==0.10.0")
}

/// Starts one of the programs in the domain of a test.
fn start(domain: &Domain, python: &Path, program: &str, arguments: &[&str]) -> Process {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/python/bare");
    let mut command = Command::new(python);
    command.arg(folder.join(program)).args(arguments).current_dir(domain.path(""));
    command.env("ICEORYX2_CONFIG", domain.config_file());
    // Nothing is written beside the programs.
    command.env("PYTHONDONTWRITEBYTECODE", "1").env("PYTHONUNBUFFERED", "1");
    Process::start(command)
}

#[test]
fn a_reader_in_python_prints_the_names_and_values_of_a_node() {
    let Some(python) = python() else { return };
    let (domain, _node) = tank(&reader());
    let ended = start(&domain, &python, "reader.py", &["plant/level", "3"]).finish();
    let printed = ended.expect_code(0).stdout;
    let mut lines = printed.lines();
    assert_eq!(lines.next(), Some("plant/level from reader: wave, n"), "{printed}");
    let mut last = None;
    for line in lines.by_ref().take(3) {
        let (sequence, values) = line.split_once(' ').unwrap();
        let (values, worth) = values.split_once("  age ").unwrap();
        assert_eq!(values, "wave=-9.0 n=0.0");
        // Nobody sends what the node reads. On a busy machine a frame may also be old.
        let (age_ms, doubts) = worth.split_once(" ms  ").unwrap();
        assert!(age_ms.parse::<f64>().unwrap() >= 0.0, "{line}");
        assert!(doubts.starts_with("[SUBSTITUTE"), "{line}");
        let sequence: u64 = sequence.parse().unwrap();
        assert!(last < Some(sequence), "{printed}");
        last = Some(sequence);
    }
    assert_eq!(lines.next(), None);
}

#[test]
fn a_node_reads_by_name_what_a_writer_in_python_publishes() {
    let Some(python) = python() else { return };
    let domain = Domain::new();
    // The reader comes first, and makes both services.
    let node = domain.start_node("node.toml", &reader(), "--report node.json");
    let mut observer = domain.start_until("subscribe plant/level", "wave=-9.0 n=0");
    let mut direct = domain.start("subscribe plant/python");
    let writer = start(&domain, &python, "writer.py", &["plant/python", "400", "200"]);
    observer.wait_until("a value of the writer", |stdout, _| {
        stdout.lines().last().is_some_and(|line| line.contains("wave=0."))
    });
    direct.wait_for("\"plant/python\" carries sine, count (from \"python\")");
    writer.finish().expect_code(0);
    direct.wait_for("[STOPPED]");
    observer.wait_until("what the end of the writer makes of the values", |stdout, _| {
        stdout.lines().last().is_some_and(|line| line.ends_with("[STALE]"))
    });
    for process in [direct, observer, node] {
        process.stop().expect_code(0);
    }
    let report = domain.json("node.json");
    let warnings = report["warnings"].as_array().unwrap();
    assert!(warnings.iter().all(|warning| warning["code"] == "input_not_ok"), "{report}");
    let link = &report["links"][0];
    assert!(link["frames"].as_u64() > Some(0), "{link}");
    assert_eq!(link["restarts"], 0, "{link}");
}

#[test]
fn a_reader_and_a_writer_in_python_need_nobody_else() {
    let Some(python) = python() else { return };
    let domain = Domain::new();
    let mut reader = start(&domain, &python, "reader.py", &["plant/python", "5"]);
    let writer = start(&domain, &python, "writer.py", &["plant/python", "200", "100"]);
    let mut to_the_end = start(&domain, &python, "reader.py", &["plant/python", "100000"]);
    reader.wait_for("plant/python from python: sine, count");
    let printed = reader.finish().expect_code(0).stdout;
    assert_eq!(printed.lines().count(), 6, "{printed}");
    writer.finish().expect_code(0);
    to_the_end.wait_for("[STOPPED");
    to_the_end.wait_for("no frame for 0.5 s: the values above are old");
    drop(to_the_end);
    let ended = start(&domain, &python, "reader.py", &["plant/nobody", "1"]).finish();
    let says = "no frames on plant/nobody; start its publisher in this domain\n";
    assert_eq!(ended.expect_code(3).stdout, says);
}

#[test]
fn a_writer_in_python_releases_its_frames_on_the_grid_of_all_nodes() {
    let Some(python) = python() else { return };
    const PERIOD_NS: u64 = 5_000_000;
    for (arguments, phase_ns) in [(vec![], 150_000), (vec!["700"], 700_000)] {
        let domain = Domain::new();
        let participant = domain.join("tester");
        let mut reader =
            FrameSubscriber::<ipc::Service>::open(&participant, "plant/python", 2, Depth::All)
                .unwrap();
        let arguments = [vec!["plant/python", "1000", "200"], arguments].concat();
        let _writer = start(&domain, &python, "writer.py", &arguments);
        let mut last = None;
        for _ in 0..20 {
            let header = wait_for_some("a frame came", || {
                reader.maintain();
                reader.next(Monotonic.now_ns()).map(|frame| *frame.header())
            });
            // Where the period divides 20 ms, this is the grid whichever epoch it began at.
            let grid_ns = (epoch_after_ns(header.release_ns) + phase_ns) % PERIOD_NS;
            assert_eq!(header.release_ns % PERIOD_NS, grid_ns, "{header:?}");
            assert!(header.release_ns <= header.publish_ns, "{header:?}");
            let [cycle, missed] = [header.cycle, header.missed];
            assert_eq!(cycle, header.sequence + missed, "what was missed is left out: {header:?}");
            if let Some((last_cycle, last_ns)) = last.replace((cycle, header.release_ns)) {
                assert_eq!(header.release_ns - last_ns, (cycle - last_cycle) * PERIOD_NS);
            }
        }
    }
}

#[test]
fn a_service_is_taken_from_a_writer_in_python_once_it_is_dead_or_where_that_is_asked_for() {
    let Some(python) = python() else { return };
    let domain = Domain::new();
    let writer = start(&domain, &python, "writer.py", &["plant/python", "100000"]);
    let reader = domain.start_until("subscribe plant/python", "sine=");
    let publish = "publish plant/python --value 1 --count 1";
    let refused = domain.run(publish).expect_code(1).stderr;
    let name = "node \"python/writer\" (python3";
    for part in [name, &format!("pid {})", writer.id()), "(--take-over"] {
        assert!(refused.contains(part), "{part}: {refused}");
    }
    domain.run(&format!("{publish} --take-over")).expect_code(0);
    writer.kill();
    domain.run(publish).expect_code(0);
    reader.stop().expect_code(0);
}

#[test]
fn a_signal_ends_a_writer_in_python_in_order() {
    let Some(python) = python() else { return };
    for signal in [Signal::INT, Signal::TERM] {
        let domain = Domain::new();
        let writer = start(&domain, &python, "writer.py", &["plant/python", "100000"]);
        let mut reader = start(&domain, &python, "reader.py", &["plant/python", "100000"]);
        reader.wait_for("plant/python from python: sine, count");
        writer.signal(signal);
        reader.signal(Signal::INT);
        for ended in [writer.finish(), reader.finish()] {
            let ended = ended.expect_code(0);
            assert!(ended.stdout.ends_with("ended\n"), "{}", ended.stdout);
            assert_eq!(ended.stderr, "");
        }
        // What counts the domain's nodes stays, as with every program of iceoryx2 alone.
        let is_counter = |file: &PathBuf| file.to_string_lossy().ends_with(".global_mgmt");
        let left = domain.leftovers();
        assert!(left.iter().all(is_counter), "both tidied up: {left:?}");
    }
}

#[test]
fn a_client_in_python_lists_reads_sets_at_a_cycle_and_forces_and_is_refused_in_words() {
    let Some(python) = python() else { return };
    let domain = Domain::new();
    let ramp = "[[block]]\nname = \"ramp\"\ntype = \"LimRateOfChangeCI\"\nin = { value = \"wave\", setChangeRate = 10.0 }\n";
    let force = reader().replace("[node]", "[node]\ncontrol = \"force\"") + ramp;
    let _node = domain.start_node("node.toml", &force, "");
    let run = |arguments: &str| {
        let arguments: Vec<&str> = arguments.split(' ').collect();
        start(&domain, &python, "operate.py", &arguments).finish()
    };
    let ask = |code: i32, arguments: &str| {
        let ended = run(arguments).expect_code(code);
        if code == 0 { ended.stdout } else { ended.stderr }
    };
    let list = ask(0, "reader list");
    assert!(list.starts_with("wave LREAL input\n"), "{list}");
    assert!(list.contains("\nramp.value LREAL wired\n"), "{list}");
    assert_eq!(ask(0, "reader list ramp.set*"), "ramp.setChangeRate LREAL parameter\n");

    let done = ask(0, "reader set ramp.setChangeRate=0.1");
    let cycle = done.strip_prefix("transaction 1 in cycle: t ").unwrap().lines().next().unwrap();
    assert!(done.ends_with("\nramp.setChangeRate: 10.0 -> 0.1\n"), "{done}");
    assert_eq!(ask(0, "reader get ramp.setChangeRate"), "ramp.setChangeRate=0.1\n");
    let based = ask(0, "reader set ramp.setChangeRate=16#A --at +20");
    assert!(based.ends_with("\nramp.setChangeRate: 0.1 -> 10.0\n"), "{based}");
    let wrong = ask(1, "reader set ramp.setChangeRate=1,5");
    assert!(wrong.contains("ramp.setChangeRate: decimals have a point"), "{wrong}");
    let late = ask(1, &format!("reader set ramp.setChangeRate=1 --at {cycle}"));
    assert!(late.starts_with("refused (4): ") && late.contains("it has begun"), "{late}");
    // Starting Python takes a good part of a second, or more on a busy machine, and at most ten seconds
    // ahead are possible: two thousand cycles of 5 ms.
    let to_come = (0..20).find_map(|_| {
        let done = ask(0, "reader set ramp.setChangeRate=0.2");
        let (_, cycle) = done.lines().next().unwrap().split_once(" in cycle: t ").unwrap();
        let at = cycle.parse::<u64>().unwrap() + 1900;
        let said = run(&format!("reader set ramp.setChangeRate=1.0 --at {at}")).stdout;
        said.ends_with(&format!(" in cycle: t {at} (to come)\n")).then_some(said)
    });
    assert!(to_come.unwrap().starts_with("transaction "));

    let done = ask(0, "reader force ramp.value=7.5 n=3 --seconds 60");
    assert!(done.contains("\nn: 0 -> 3\n"), "{done}");
    assert_eq!(ask(0, "reader get ramp.value n"), "ramp.value=7.5\nn=3\n");
    assert_eq!(ask(0, "reader list n"), "n INT input forced\n");

    let refused = ask(1, "reader set n=1 ramp.x=2");
    assert!(refused.starts_with("refused (2): \"n\" is an input"), "{refused}");
    assert!(refused.contains("there is no signal \"ramp.x\""), "{refused}");
    assert!(ask(1, "reader set ramp.setChangeRate=1 --at soon").contains("give a whole number"));
    assert!(ask(3, "nobody get n").contains("no node \"nobody\" takes requests here"));
}

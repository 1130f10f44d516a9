//! The loops of `examples/` as nodes that run: what they did is recorded and repeated bit for bit.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use isochrone_testing::{Domain, Process, cells, is_full_volume, wait_until};

/// An example, and what people do to it.
struct Loop {
    name: &'static str,
    /// Its input, the service that it reads, and a value for it.
    input: Option<(&'static str, &'static str, &'static str)>,
    /// What its comments say to set.
    sets: &'static [&'static str],
}

const LOOPS: [Loop; 6] = [
    Loop { name: "level-control", input: None, sets: &["set_point=1.5 demand=0.03"] },
    Loop {
        name: "manual-automatic",
        input: None,
        sets: &["manual=true", "manual_value=60", "manual=false"],
    },
    Loop {
        name: "sensor-failure",
        input: Some(("pressure", "plant/sensor", "3.5")),
        sets: &["set_point=4.5"],
    },
    Loop {
        name: "cascade",
        input: None,
        sets: &["wanted=1.2", "manual=true valve=30", "manual=false"],
    },
    Loop {
        name: "two-point-control",
        input: Some(("temp", "plant/temperature", "55.5")),
        sets: &["sp=50 band=4"],
    },
    Loop { name: "sequence", input: Some(("button", "plant/button", "1")), sets: &["full=0.1"] },
];

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Runs a loop for this long, with its input for half of it, and repeats it. Returns the values that were compared.
fn run_and_replay(of: &Loop, time: Duration) -> u64 {
    let Loop { name, input, sets } = of;
    let domain = Domain::new();
    let file = repository().join(format!("examples/{name}.toml"));
    let text = std::fs::read_to_string(file).unwrap();
    let publish = |(_, service, value): &(&str, &str, &str)| -> Process {
        domain.publish(&format!("{service} --value {value} --rate 50"))
    };
    let publisher = input.as_ref().map(publish);
    let node = domain.start_node("loop.toml", &text, "--record run.mcap");
    if let Some((input, ..)) = input {
        let ok = format!("get {name} {input}.ok");
        wait_until("a sample has come", || domain.run(&ok).expect_code(0).stdout.trim() == "TRUE");
    }
    for set in *sets {
        domain.run(&format!("set {name} {set}")).expect_code(0);
    }
    thread::sleep(time / 2);
    if let Some(publisher) = publisher {
        publisher.stop().expect_code(0);
    }
    thread::sleep(time / 2);
    node.stop().expect_code(0);

    let replayed = domain.run("replay run.mcap --report replay.json").expect_code(0);
    println!("{name}: {}", replayed.stdout.trim());
    let report = domain.json("replay.json");
    assert_eq!(
        (&report["is_same"], &report["is_complete"]),
        (&true.into(), &true.into()),
        "{name}"
    );
    assert_eq!(report["tasks"][0]["uncompared_cycles"], 0, "{name}");
    if let Some((input, _, value)) = input {
        domain.run("export run.mcap --task main -o run.csv").expect_code(0);
        let text = domain.read("run.csv");
        let rows = cells(&text);
        let name_of = |head: &str| head.split(" [").next() == Some(&format!("in.{input}"));
        let column = rows[0].iter().position(|head| name_of(head)).unwrap();
        let value: f64 = value.parse().unwrap();
        let has_it = |row: &&Vec<&str>| row[column].parse() == Ok(value);
        assert!(rows.iter().skip(1).filter(has_it).count() > 1, "{name}: {:?}", rows[0]);
    }
    report["compared_values"].as_u64().unwrap()
}

#[test]
fn every_example_loop_runs_live_and_is_repeated_bit_for_bit() {
    let time = Duration::from_secs(if is_full_volume() { 10 } else { 1 });
    thread::scope(|scope| {
        let runs = LOOPS.each_ref().map(|of| scope.spawn(move || run_and_replay(of, time)));
        for (run, Loop { name, .. }) in runs.into_iter().zip(&LOOPS) {
            let compared = run.join().unwrap_or_else(|_| panic!("{name} failed"));
            assert!(compared > 0, "{name} was not compared");
        }
    });
}

#[test]
fn every_example_with_a_golden_case_is_one_of_these_loops() {
    let golden = std::fs::read_dir(repository().join("golden")).unwrap();
    let examples = golden.filter_map(|case| {
        let target = std::fs::read_link(case.unwrap().path().join("config.toml")).ok()?;
        Some(target.file_stem()?.to_str()?.to_owned())
    });
    let examples: BTreeSet<String> = examples.collect();
    assert_eq!(examples, LOOPS.iter().map(|it| it.name.to_owned()).collect());
}

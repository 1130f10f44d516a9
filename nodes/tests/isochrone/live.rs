//! What runs live is what was simulated, to the last bit.

use std::collections::HashSet;

use isochrone_testing::{Domain, Plant};

/// Cycles are caught up: a busy test machine must not leave them out.
fn node() -> Plant {
    let advanced = "autoValue = \"ramp.delayedValue\", setPosUpRateLim = 11.0, setPosDownRateLim = 13.0, \
        setNegUpRateLim = 17.0, setNegDownRateLim = 19.0, setHighLim = 0.9, setLowLim = -0.8";
    Plant::new("live")
        .task("t", "4ms")
        .with("ob = 35\noverrun = \"catch_up\"")
        .input("setpoint", "live/in", "channel = 0")
        .input("hold", "live/in", "type = \"BOOL\"\nchannel = 1")
        .input("step", "live/in", "type = \"INT\"\nchannel = 2")
        .ramp(
            "ramp",
            "value = \"setpoint\", setChangeRate = 37.5, enDefaultOutValue = \"hold\", defaultOutValue = 0.1",
        )
        .block("advanced", "LimRateOfChangeAdvancedCI", advanced)
        .block(
            "level",
            "ScaleLinear",
            "x = \"advanced.outputValue\", x1 = -1, y1 = 0, x2 = 1, y2 = 1.7, yMin = 0, yMax = 1.7",
        )
        .saw("saw", "timeRange = 7, incrementRange = \"step\", numberSteps = 5, reset = \"hold\"")
        .ramp("feedback", "value = \"level.y@prev\", setChangeRate = 3")
        .output("live/out", &SIGNALS)
}

const SIGNALS: [&str; 11] = [
    "setpoint",
    "hold",
    "step",
    "ramp.delayedValue",
    "advanced.outputValue",
    "advanced.posUpRateLim",
    "advanced.highLim",
    "level.y",
    "level.status",
    "saw.value",
    "feedback.delayedValue",
];

const INPUTS: usize = 3;
const CYCLES: usize = 1750;
const ROWS: usize = 1250;

/// Values that look random and are the same every time.
fn recording() -> String {
    let mut text = String::from("setpoint,hold,step\n");
    let mut seed: u64 = 42;
    let mut next = |bound: u64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 33) % bound
    };
    for row in 0..ROWS {
        let setpoint = next(2000) as f64 / 1000.0 - 1.0;
        let hold = u8::from(next(40) == 0);
        let step = if row % 3 == 0 { next(65_536) as i64 - 32_768 } else { 100 };
        text += &format!("{setpoint},{hold},{step}\n");
    }
    text
}

/// One live run: what the subscriber recorded, or `None` if the machine was so busy that the node
/// had to leave out cycles, the subscriber came late or lost frames, or few of the inputs arrived.
fn record(domain: &Domain) -> Option<String> {
    let node = domain.start_until(
        &format!("run node.toml --cycles {CYCLES} --report node.json"),
        "node \"live\" is running",
    );
    let subscriber =
        domain.start_until("subscribe live/out --csv out.csv --report link.json", "subscribed to");
    let publisher = domain.start("publish live/in --csv in.csv --rate 250");
    publisher.finish().expect_code(0);
    node.finish().expect_code(0);
    let task = &domain.json("node.json")["tasks"][0];
    assert_eq!(task["cycles"], CYCLES);
    if task["missed"] != 0 {
        return None;
    }
    domain.wait_for_cycle("out.csv", CYCLES as u64 - 1);
    subscriber.stop().expect_code(0);
    domain.expect_no_leftovers();
    let link = &domain.json("link.json")["links"][0];
    if link["lost"] != 0 {
        return None;
    }
    let live = domain.read("out.csv");
    // Cycles that are caught up read the same inputs, and a busy publisher sends late.
    let different: HashSet<String> = rows(&live).map(inputs).collect();
    (rows(&live).count() > ROWS && different.len() > ROWS / 5).then_some(live)
}

/// The rows of a recording, without the time, which stands beside the simulation's columns.
fn rows(recording: &str) -> impl Iterator<Item = &str> {
    recording.lines().skip(1).map(without_time)
}

fn without_time(line: &str) -> &str {
    line.split_once(',').unwrap().1
}

/// The node's frame holds the inputs as it saw them.
fn inputs(row: &str) -> String {
    row.split(',').skip(1).take(INPUTS).collect::<Vec<_>>().join(",")
}

#[test]
fn a_subscriber_of_a_live_node_receives_exactly_what_simulate_computes() {
    let domain = Domain::with(&[("node.toml", &node()), ("in.csv", &recording())]);
    let live = (0..12)
        .find_map(|_| record(&domain))
        .expect("one of a dozen runs without a missed release or a lost frame, in which most inputs arrived");

    let header = without_time(live.lines().next().unwrap());
    let rows: Vec<&str> = rows(&live).collect();
    let cycle = |row: &str| row.split(',').next().unwrap().parse::<usize>().unwrap();
    let first = cycle(rows[0]);
    assert_eq!(cycle(rows[rows.len() - 1]), CYCLES - 1, "the last frame was received");
    for (index, row) in rows.iter().enumerate() {
        assert_eq!(cycle(row), first + index, "cycles have no gaps");
    }

    // What arrived is what was sent, in that order: rows may be seen more than once, or not at all.
    let sent = recording();
    let mut sent = sent
        .lines()
        .skip(1)
        .map(|row| row.split(',').map(|value| value.parse().unwrap()).collect::<Vec<f64>>());
    let mut arrived: Vec<Vec<f64>> = rows
        .iter()
        .map(|row| inputs(row).split(',').map(|value| value.parse().unwrap()).collect())
        .skip_while(|row: &Vec<f64>| row.iter().all(|value| *value == 0.0))
        .collect();
    arrived.dedup();
    for row in arrived {
        assert!(sent.any(|sent| sent == row), "{row:?} was not sent, or not in this order");
    }
    let mut seen = format!("{}\n", inputs(header));
    // Before the subscriber came, nobody published, so the inputs had their defaults.
    seen += &"0,0,0\n".repeat(first);
    rows.iter().for_each(|row| seen += &(inputs(row) + "\n"));
    domain.write("seen.csv", &seen);

    let simulated = domain.run("simulate node.toml --inputs seen.csv").expect_code(0).stdout;
    let mut simulated = simulated.lines();
    assert_eq!(simulated.next(), Some(header));
    for (live, simulated) in rows.iter().zip(simulated.skip(first)) {
        assert_eq!(*live, simulated);
    }
}

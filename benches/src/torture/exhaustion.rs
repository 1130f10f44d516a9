//! A node starts with too little of something, and one that runs is left with too little.

use std::fs;
use std::io::Read;
use std::os::unix::process::CommandExt;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use clap::ValueEnum;
use isochrone_processes::Child;
use isochrone_testing::mount_refusal;
use serde_json::{Value, json};

use super::exhausted::Scarcity;
use super::frames;
use super::moments::Moments;
use super::reader::Reader;
use super::scene::{PATIENCE, Scene, ended_well};
use super::turn::{Stage, Turn};
use crate::Failure;

/// Two blocks that count cycles, in one frame. What one of them says of a frame, the other must say, too.
const CONFIGURATION: &str = r#"
[node]
name = "saws"
control = "set"
retain = true
retain_every = "100ms"
[[task]]
name = "t"
period = "5ms"
priority = 10
[[input]]
name = "x"
service = "torture/in"
max_age = "1h"
[[block]]
name = "follows"
type = "LimRateOfChangeCI"
in = { value = "x", setChangeRate = 1.0 }
[[block]]
name = "one"
type = "SawTooth"
in = { timeRange = 5, incrementRange = 1, endlessSteps = true }
[[block]]
name = "two"
type = "SawTooth"
in = { timeRange = 5, incrementRange = 1, endlessSteps = true }
[[output]]
service = "torture/saws"
signals = ["one.value", "two.value"]
"#;
const RUN: &str =
    "run saws.toml --state disk/node.state --journal disk/node.jsonl --record disk/node.mcap";
/// How long it lasts in which there is too little.
const LASTS: Duration = Duration::from_millis(300);

/// How many starts are tried of each scarcity.
const STARTS: u64 = 4;

/// All scarcities, each in a process of its own in namespaces of its own where that is needed.
pub(super) fn play(stage: &Stage, seed: u64, turn: &mut Turn) -> Result<(), Failure> {
    let refusal = mount_refusal();
    for scarcity in Scarcity::value_variants() {
        let name = scarcity.name();
        if let Some(why) = refusal.as_ref().filter(|_| scarcity.needs_namespace()) {
            turn.untested.push(format!("{name}: {why}"));
            continue;
        }
        let words: &[&str] = if scarcity.needs_namespace() { &["unshare", "-rm"] } else { &[] };
        let found = starve_in_child(stage, seed, &name, words)?;
        turn.done += found["done"].as_u64().unwrap_or(0);
        let wrong = found["wrong"].as_array().into_iter().flatten().filter_map(Value::as_str);
        turn.keep(wrong.map(|wrong| format!("{name}: {wrong}")));
        if stage.is_due() {
            break;
        }
    }
    Ok(())
}

/// Runs this program again for one scarcity; what it found.
fn starve_in_child(stage: &Stage, seed: u64, name: &str, words: &[&str]) -> Result<Value, Failure> {
    let own = std::env::current_exe()?;
    let mut all = words.iter().map(std::ffi::OsStr::new).chain([own.as_os_str()]);
    let mut command = Command::new(all.next().unwrap_or(own.as_os_str()));
    command.args(all).args(["--starve", name, "--seed", &seed.to_string(), "--program"]);
    command.arg(&stage.program).stdin(Stdio::null()).stdout(Stdio::piped()).process_group(0);
    let mut child = Child::start(format!("torture of {name}"), &mut command)?;
    let mut said = String::new();
    while child.ended()?.is_none() && !stage.is_due() {
        thread::sleep(Duration::from_millis(5));
    }
    let status = child.end()?;
    child.stdout().map(|mut stdout| stdout.read_to_string(&mut said)).transpose()?;
    let wrong = || json!({"done": 0, "wrong": [format!("it ended with {status}: {said}")]});
    Ok(serde_json::from_str(&said).unwrap_or_else(|_| wrong()))
}

/// Starts and runs with too little of one thing, in this process; a document of what was found.
///
/// # Errors
/// There cannot be a domain.
pub fn starve(scarcity: Scarcity, stage: &Stage, seed: u64) -> Result<Value, Failure> {
    let (mut turn, moments) = (Turn::default(), &mut Moments::new(seed));
    let scene = Scene::new(stage, &[("saws.toml", CONFIGURATION)])?;
    fs::create_dir(scene.path("disk"))?;
    for _ in 0..STARTS {
        let found = scarcity.before_start(&scene, moments).and_then(|words| {
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            ended_well(&scene.run_by(&words, &format!("{RUN} --cycles 5"))?)
        });
        turn.take(found);
        turn.done += 1;
    }
    let ran = scarcity.after_start(&scene).and_then(|()| run(scarcity, &scene, &mut turn));
    turn.take(ran);
    turn.done += 1;
    let wrong = if stage.is_due() { Vec::new() } else { turn.wrong };
    Ok(json!({"done": turn.done, "wrong": wrong}))
}

/// A node runs while there is too little, and afterwards.
fn run(scarcity: Scarcity, scene: &Scene, turn: &mut Turn) -> Result<(), String> {
    let reader = Reader::open(scene, "torture/saws").map_err(|error| error.to_string())?;
    let node = scene.start_until(RUN, "is running")?;
    let goes_on = || {
        let since = reader.count() + 20;
        let comes = reader.wait_for(scene, since, PATIENCE, |_| true);
        comes.map(drop).ok_or_else(|| "the node sends no frames any more".to_owned())
    };
    goes_on()?;
    scarcity.begin(scene, &node)?;
    for newcomer in
        ["subscribe torture/saws --seconds 0.3 --csv -", "publish torture/in --value 1 --count 3"]
    {
        turn.take(ended_well(&scene.run(newcomer)?));
    }
    if scarcity == Scarcity::Disk {
        let told = scene.wait(PATIENCE, || {
            let alarms = scene.run("alarms saws").ok()?.stdout;
            alarms.contains("cannot be written").then_some(())
        });
        told.ok_or("the disk is full, and no alarm says so")?;
    }
    thread::sleep(LASTS);
    scarcity.end(scene, &node)?;
    goes_on()?;
    let heals = scene.wait(PATIENCE, || {
        let ended = scene.run("subscribe torture/saws --count 3 --seconds 2 --csv -").ok()?;
        ended.status.success().then_some(())
    });
    heals.ok_or("a new subscriber gets nothing, although there is enough again")?;
    // A recording or a journal that is not whole is told by the exit status.
    let codes: &[i32] = if scarcity == Scarcity::Disk { &[0, 1] } else { &[0] };
    scene.end(node, codes)?;
    let seen = reader.seen();
    turn.keep(frames::that_are_torn(&seen.frames));
    turn.keep(frames::that_are_missing(&seen.frames));
    if seen.counters.lost > 0 {
        turn.keep([format!("{} frames were lost", seen.counters.lost)]);
    }
    Ok(())
}

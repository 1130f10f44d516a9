//! A node is killed while it writes its state, and state files are cut and changed.

use std::fs;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::moments::Moments;
use super::scene::{Scene, ended_well, last};
use super::turn::{Stage, Turn};
use crate::Failure;

/// `saw` counts the cycles that were due, `other` as well, and `ramp` those that ran. Whatever mixes two states breaks that.
const CONFIGURATION: &str = r#"
[node]
name = "counters"
retain = true
retain_every = "100ms"
[[task]]
name = "t"
period = "5ms"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
in = { value = 1e9, setChangeRate = 200.0 }
[[block]]
name = "saw"
type = "SawTooth"
in = { timeRange = 5, incrementRange = 1, endlessSteps = true }
[[block]]
name = "other"
type = "SawTooth"
in = { timeRange = 5, incrementRange = 1, endlessSteps = true }
"#;
const RUN: &str = "run counters.toml --state node.state";
const FILES: [&str; 2] = ["node.state", "node.state.1"];
/// Being written, before it has its name.
const NEW: &str = "node.state.new";

pub(super) fn play(stage: &Stage, moments: &mut Moments, turn: &mut Turn) -> Result<(), Failure> {
    let scene = Scene::new(stage, &[("counters.toml", CONFIGURATION)])?;
    for _ in 0..2 {
        turn.take(scene.run(&format!("{RUN} --cycles 3")).and_then(|ended| ended_well(&ended)));
    }
    let Some(begun) = turn.take(read(&scene)) else { return Ok(()) };
    let mut counts = begun;
    for _ in 0..stage.faults {
        turn.done += 1;
        let found = if moments.once_in(3) {
            damage(&scene, moments)
        } else {
            kill_in_write(&scene, moments, &counts).map(|now| counts = now)
        };
        if turn.take(found).is_none() || stage.is_due() {
            break;
        }
    }
    Ok(())
}

/// What a state says.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Counts {
    cycle: u64,
    saw: f64,
    ramp: f64,
}

/// Reads the state as a start would; an error if it is of no cycle.
fn read(scene: &Scene) -> Result<Counts, String> {
    let ended = scene.run("state node.state --json")?;
    if !ended.status.success() {
        return Err(format!("the state is not whole: {:?}", last(&ended.stderr)));
    }
    let state: Value = serde_json::from_str(&ended.stdout).map_err(|error| error.to_string())?;
    let number = |name: &str| state["values"][name].as_f64().unwrap_or(f64::NAN);
    let cycle = state["tasks"][0]["cycle"].as_u64().unwrap_or(u64::MAX);
    let (saw, ramp) = (number("saw.value"), number("ramp.delayedValue"));
    let is_whole = saw == number("other.value") && ramp <= (cycle + 1) as f64;
    let counts = Counts { cycle, saw, ramp };
    is_whole.then_some(counts).ok_or_else(|| format!("half of a state: {state}"))
}

impl Counts {
    /// Whether this is of a later cycle of the same run of restarts.
    fn follows(&self, before: &Self) -> bool {
        // INT counts on from its lowest value.
        let due = (self.cycle.wrapping_sub(before.cycle)) as i16;
        let counted = (self.saw - before.saw) as i64 as i16;
        self.cycle >= before.cycle && self.ramp >= before.ramp && due == counted
    }
}

/// Kills a node that writes its state; what its state is then.
fn kill_in_write(scene: &Scene, moments: &mut Moments, before: &Counts) -> Result<Counts, String> {
    let mut node = scene.start(RUN);
    scene.until_said(&mut node, "is running")?;
    let new = scene.path(NEW);
    let modified = || fs::metadata(scene.path(FILES[0])).and_then(|file| file.modified()).ok();
    let (old, since) = (modified(), Instant::now());
    // The one that it was called before, or after it got its name.
    let wants_half = moments.once_in(2);
    let is_now = || if wants_half { new.exists() } else { modified() != old };
    // Without a pause: a write takes a fraction of a millisecond.
    while !is_now() && since.elapsed() < Duration::from_secs(1) {}
    let after = Duration::from_micros(moments.of(0..600));
    let since = Instant::now();
    while since.elapsed() < after {}
    node.kill();
    let counts = read(scene)?;
    if !counts.follows(before) {
        return Err(format!("the state after a kill is {counts:?}, and was {before:?}"));
    }
    Ok(counts)
}

/// Cuts or changes one or both of the files: a start goes on from a whole one, or refuses. Afterwards they are as before.
fn damage(scene: &Scene, moments: &mut Moments) -> Result<(), String> {
    let paths = FILES.map(|file| scene.path(file));
    let whole = paths.clone().map(|path| fs::read(path).ok());
    let which = moments.of(1..4);
    let mut how = Vec::new();
    for (at, (path, bytes)) in paths.iter().zip(&whole).enumerate() {
        let Some(bytes) = bytes.as_ref().filter(|_| which >> at & 1 == 1) else { continue };
        let (changed, what) = changed(bytes, moments);
        how.push(format!("{} {what}", FILES[at]));
        fs::write(path, changed).map_err(|error| error.to_string())?;
    }
    let outcome = scene.run(&format!("{RUN} --cycles 3")).and_then(|ended| {
        let has_started = ended_well(&ended)?;
        let is_cold = has_started && !ended.stderr.contains("restored ");
        if is_cold {
            return Err(format!(
                "it starts cold beside a damaged state: {:?}",
                last(&ended.stderr)
            ));
        }
        // Of another version of the format, none is taken.
        let is_newer = ended.stderr.contains("has a format of version");
        if !has_started && which < 3 && !is_newer && whole.iter().all(Option::is_some) {
            return Err(format!(
                "a whole state is there, and is not taken: {:?}",
                last(&ended.stderr)
            ));
        }
        if has_started { read(scene).map(drop) } else { Ok(()) }
    });
    for (path, bytes) in paths.iter().zip(&whole) {
        let _ = fs::remove_file(path);
        let put_back = bytes.as_ref().map_or(Ok(()), |bytes| fs::write(path, bytes));
        put_back.map_err(|error| error.to_string())?;
    }
    outcome.map_err(|wrong| format!("{}: {wrong}", how.join(", ")))
}

/// The bytes of a file, cut or with some of them changed, and how.
fn changed(bytes: &[u8], moments: &mut Moments) -> (Vec<u8>, String) {
    let mut changed = bytes.to_vec();
    let at = moments.of(0..bytes.len() as u64) as usize;
    if moments.once_in(2) {
        changed.truncate(at);
        return (changed, format!("cut to {at} of {} bytes", bytes.len()));
    }
    let bit = moments.of(0..8);
    changed[at] ^= 1 << bit;
    (changed, format!("with bit {bit} of byte {at} flipped"))
}

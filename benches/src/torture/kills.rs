//! Publishers, nodes and subscribers around a node are killed at any moment, from their first instruction on.

use std::fs;
use std::time::{Duration, Instant};

use isochrone_testing::Process;

use super::moments::Moments;
use super::reader::Reader;
use super::scene::{PATIENCE, Scene};
use super::turn::{Stage, Turn};
use crate::Failure;

/// The node that lives on. `x` is of publishers that are killed, `steady` of one that lives.
const KEEPER: &str = r#"
[node]
name = "keeper"
[[task]]
name = "t"
period = "2ms"
[[input]]
name = "steady"
service = "torture/steady"
[[input]]
name = "x"
service = "torture/in"
[[output]]
service = "torture/out"
signals = ["steady", "x"]
"#;
/// The nodes that are killed: they read the keeper.
const VICTIM: &str = r#"
[node]
name = "victim"
[[task]]
name = "t"
period = "2ms"
[[input]]
name = "x"
service = "torture/out"
channel = 1
[[output]]
service = "torture/second"
signals = ["x"]
"#;
/// What those who live may have more at the end than after the first kills, as the last dead may not be forgotten yet.
const MORE_DESCRIPTORS: usize = 4;
const MORE_FILES: usize = 8;
const MORE_KIB: u64 = 4_096;

/// What those have who live.
#[derive(Debug, Clone)]
struct Use {
    descriptors: Vec<usize>,
    resident_kib: Vec<u64>,
    files: usize,
}

pub(super) fn play(stage: &Stage, moments: &mut Moments, turn: &mut Turn) -> Result<(), Failure> {
    let scene = Scene::new(stage, &[("keeper.toml", KEEPER), ("victim.toml", VICTIM)])?;
    let readers = [Reader::open(&scene, "torture/out")?, Reader::open(&scene, "torture/second")?];
    let started = scene.start_until("run keeper.toml", "is running").and_then(|keeper| {
        let publisher =
            scene.start_until("publish torture/steady --value 1 --rate 100", "publishing")?;
        let subscriber = scene.start_until("subscribe torture/out --every 1000", "steady=")?;
        Ok(vec![("node", keeper), ("publisher", publisher), ("subscriber", subscriber)])
    });
    let Some(mut living) = turn.take(started) else { return Ok(()) };
    let mut before = None;
    for fault in 0..stage.faults {
        let kind = moments.of(0..3) as usize;
        // Numbers of this turn that no other publisher sends.
        let value = (fault + 1) as f64 * 10.0;
        let command = [
            format!("publish torture/in --value {value} --rate 500"),
            "run victim.toml".to_owned(),
            "subscribe torture/out --csv -".to_owned(),
        ];
        let victim = scene.start(&command[kind]);
        let most_ms = if moments.once_in(2) { 20 } else { 150 };
        moments.sleep_up_to_ms(most_ms);
        victim.kill();
        turn.done += 1;
        let healed = turn.take(heal(&scene, &readers, kind, value + 1.0));
        turn.measured.extend(healed.map(|took| ("ms until a new peer had frames", took)));
        turn.keep(ended(&mut living));
        if fault == 2 {
            before = turn.take(sweep(&scene)).map(|()| Use::of(&scene, &living));
        }
        if stage.is_due() || !turn.wrong.is_empty() {
            break;
        }
    }
    if let Some(before) = before {
        turn.take(stays(&scene, &before, &living));
    }
    let silence = longest_silence(&readers[0]);
    if silence > stage.within {
        turn.keep([format!("the node was silent for {} ms", silence.as_millis())]);
    }
    for (_, process) in living {
        turn.take(scene.end(process, &[0]));
    }
    Ok(())
}

/// Starts a peer in the place of one that was killed: how long until it had frames, in ms.
fn heal(scene: &Scene, readers: &[Reader; 2], kind: usize, value: f64) -> Result<u64, String> {
    let since = Instant::now();
    let counts = [readers[0].count(), readers[1].count()];
    let (what, fresh) = match kind {
        0 => ("publisher", format!("publish torture/in --value {value} --rate 500")),
        1 => ("node", "run victim.toml".to_owned()),
        _ => ("subscriber", "subscribe torture/out --count 5 --csv -".to_owned()),
    };
    let mut process = scene.start(&fresh);
    let has_frames = match kind {
        0 => {
            readers[0].wait_for(scene, counts[0], PATIENCE, |got| got.values[1] == value).is_some()
        }
        1 => readers[1].wait_for(scene, counts[1], PATIENCE, |_| true).is_some(),
        _ => scene.wait(PATIENCE, || process.ended_within(Duration::ZERO)).is_some(),
    };
    let took = since.elapsed();
    if !has_frames || took > scene.stage.within {
        let said = process.printed();
        return Err(format!("a new {what} had no frames for {} ms: {said:?}", took.as_millis()));
    }
    if kind < 2 {
        scene.end(process, &[0])?;
    }
    Ok(took.as_millis() as u64)
}

/// Whoever joins forgets the dead.
fn sweep(scene: &Scene) -> Result<(), String> {
    let ended = scene.run("publish torture/elsewhere --value 1 --count 1")?;
    ended.status.success().then_some(()).ok_or(format!("a publisher fails: {}", ended.stderr))
}

/// Those who should live and do not.
fn ended(living: &mut Vec<(&'static str, Process)>) -> Vec<String> {
    let mut wrong = Vec::new();
    living.retain_mut(|(who, process)| {
        let ended = process.ended_within(Duration::ZERO);
        wrong.extend(
            ended.as_ref().map(|it| format!("the {who} ended with {}: {}", it.status, it.stderr)),
        );
        ended.is_none()
    });
    wrong
}

impl Use {
    fn of(scene: &Scene, living: &[(&'static str, Process)]) -> Self {
        let descriptors = |id| fs::read_dir(format!("/proc/{id}/fd")).map_or(0, Iterator::count);
        let resident_kib = |id| {
            let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
            let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
            line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
        };
        let ids = || living.iter().map(|(_, process)| process.id());
        Self {
            descriptors: ids().map(descriptors).collect(),
            resident_kib: ids().map(resident_kib).collect(),
            files: scene.domain().files().len(),
        }
    }

    /// What is more than it was.
    fn growth(&self, before: &Self) -> Option<String> {
        let files = self.files > before.files + MORE_FILES;
        let mut each = self.descriptors.iter().zip(&before.descriptors);
        let descriptors = each.any(|(now, then)| *now > then + MORE_DESCRIPTORS);
        let mut each = self.resident_kib.iter().zip(&before.resident_kib);
        let memory = each.any(|(now, then)| *now > then + MORE_KIB);
        (files || descriptors || memory).then(|| format!("{before:?} became {self:?}"))
    }
}

/// Those who live have what they had, as soon as they have forgotten the last dead.
fn stays(scene: &Scene, before: &Use, living: &[(&'static str, Process)]) -> Result<(), String> {
    let mut grown = None;
    let stays = scene.wait(PATIENCE, || {
        grown = sweep(scene).err().or_else(|| Use::of(scene, living).growth(before));
        grown.is_none().then_some(())
    });
    stays.ok_or_else(|| format!("something grows: {}", grown.unwrap_or_default()))
}

/// The longest time between two frames.
fn longest_silence(reader: &Reader) -> Duration {
    let seen = reader.seen();
    let silences =
        seen.frames.windows(2).map(|pair| pair[1].publish_ns.saturating_sub(pair[0].publish_ns));
    Duration::from_nanos(silences.max().unwrap_or(0))
}

//! Two processes of one node, readers of what it publishes, and an operator.

use isochrone_ipc::TwinPage;
use isochrone_testing::Process;

use super::frames::{self, Got};
use super::reader::Reader;
use super::scene::{PATIENCE, Scene};
use super::setter::Setter;
use super::turn::{Stage, Turn};
use crate::Failure;

/// How far each ramp moves in a cycle.
const STEP: f64 = 1.0;
/// After how many silent releases the standby takes over, as `run --redundant` has it.
const AFTER: u64 = 2;
/// A fast task with a variable to set, and a slow one. Each has a ramp.
const CONFIGURATION: &str = r#"
[node]
name = "ramp"
control = "set"
[[task]]
name = "fast"
period = "10ms"
[[task]]
name = "slow"
period = "40ms"
[[variable]]
name = "mark"
type = "LREAL"
initial = 0.0
task = "fast"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = 1e9, setChangeRate = 100.0 }
[[block]]
name = "late"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = 1e9, setChangeRate = 25.0 }
[[output]]
service = "torture/fast"
task = "fast"
signals = ["ramp.delayedValue", "mark"]
[[output]]
service = "torture/slow"
task = "slow"
signals = ["late.delayedValue"]
"#;
const RUN: &str = "run ramp.toml --redundant";

/// What a process says it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// It has said nothing of that yet, or follows and cannot take over yet.
    Joining,
    Standby,
    Holder,
    /// It starts the node anew, as the other one died before it could be followed.
    Anew,
}

/// The two processes, and who looks at them.
pub(super) struct Pair {
    // Dropped in this order.
    setter: Setter,
    readers: [Reader; 2],
    /// By their seats, which are 1 and 2.
    processes: [Process; 2],
    pub(super) scene: Scene,
}

impl Pair {
    /// Starts both; the second one can take over.
    pub(super) fn start(stage: &Stage) -> Result<Result<Self, String>, Failure> {
        let scene = Scene::new(stage, &[("ramp.toml", CONFIGURATION)])?;
        let readers =
            [Reader::open(&scene, "torture/fast")?, Reader::open(&scene, "torture/slow")?];
        let started = scene
            .start_until(RUN, "waits for a standby")
            .and_then(|first| Ok([first, scene.start_until(RUN, "can be taken over")?]));
        Ok(started.map(|processes| {
            let setter = Setter::start(&scene, "ramp");
            Self { setter, readers, processes, scene }
        }))
    }

    /// The process in a seat, counted from 0.
    pub(super) fn process(&self, seat: usize) -> &Process {
        &self.processes[seat]
    }

    /// The last frame of the fast task.
    pub(super) fn newest(&self) -> Option<Got> {
        self.readers[0].newest()
    }

    /// The seat of the process that has sent this frame, counted from 0.
    pub(super) fn seat_of(got: &Got) -> usize {
        usize::from(TwinPage::seat_of(got.term) == 2)
    }

    /// What a process says it is.
    pub(super) fn role(&self, seat: usize) -> Role {
        let said = self.processes[seat].printed();
        let role = |line: &str| {
            let is = [
                ("can be taken over by this process", Role::Standby),
                ("cannot be taken over by this process", Role::Joining),
                ("is taken over by this process", Role::Holder),
                ("waits for a standby", Role::Holder),
                ("was taken over by the other process", Role::Joining),
                ("stands by for process", Role::Joining),
                ("starts the node anew", Role::Anew),
            ];
            is.into_iter().find(|(text, _)| line.contains(text)).map(|(_, role)| role)
        };
        said.lines().rev().find_map(role).unwrap_or(Role::Joining)
    }

    /// Waits until there is a holder and a standby that can take over. On a busy machine they change places by
    /// themselves.
    pub(super) fn until_complete(&mut self) -> Result<(), String> {
        let complete = self.scene.wait(PATIENCE, || {
            let roles = [0, 1].map(|seat| self.role(seat));
            let holder = self.newest().map(|got| Self::seat_of(&got))?;
            (roles[holder] == Role::Holder && roles[1 - holder] == Role::Standby).then_some(())
        });
        complete.ok_or_else(|| format!("there is no standby that can take over: {}", self.said()))
    }

    /// What both have said last.
    pub(super) fn said(&self) -> String {
        let last = |process: &Process| super::scene::last(&process.printed());
        format!(
            "first process: {}; second process: {}; last frame: {:?}",
            last(&self.processes[0]),
            last(&self.processes[1]),
            self.newest()
        )
    }

    /// Kills a process, and starts another one in its place, which has its seat.
    pub(super) fn kill(&mut self, seat: usize) {
        // What is dropped is killed, and gone.
        self.processes[seat].signal(rustix::process::Signal::KILL);
        let _ = self.processes[seat].ended_within(PATIENCE);
    }

    /// Starts a process in the seat of one that was killed.
    pub(super) fn replace(&mut self, seat: usize) {
        self.processes[seat] = self.scene.start(RUN);
    }

    /// Waits until both tasks publish from this seat with a higher term than this; the first frames, after the last
    /// ones of the other.
    pub(super) fn until_taken_over(&self, seat: usize, term: u64) -> Result<[[Got; 2]; 2], String> {
        let is_its = |got: &Got| got.term > term && Self::seat_of(got) == seat;
        let pair = |reader: &Reader| {
            let seen = reader.seen();
            let at = seen.frames.iter().position(is_its)?;
            Some([*seen.frames.get(at.checked_sub(1)?)?, seen.frames[at]])
        };
        let found = self.scene.wait(PATIENCE, || {
            if self.role(seat) == Role::Anew {
                return Some(None);
            }
            Some(Some([pair(&self.readers[0])?, pair(&self.readers[1])?]))
        });
        match found {
            Some(Some(pairs)) => Ok(pairs),
            Some(None) => Err(format!("the node was started anew: {}", self.said())),
            None => Err(format!("nobody has taken over for a minute: {}", self.said())),
        }
    }

    /// How many cycles of the fast task have no frame, between the frames of [`until_taken_over`](Self::until_taken_over);
    /// an error if it took longer than promised. The standby says how many releases it counts as lost, and for how many
    /// it was not awake itself.
    pub(super) fn silence(&self, seat: usize, pairs: &[[Got; 2]; 2]) -> Result<u64, String> {
        let said = self.processes[seat].printed();
        let mut lines = said.lines().rev();
        let taken = lines.find(|line| line.contains("is taken over by this process"));
        let number = |before: &str| {
            let (_, rest) = taken?.split_once(before)?;
            let digits = rest.find(|it: char| !it.is_ascii_digit()).unwrap_or(rest.len());
            rest[..digits].parse::<u64>().ok()
        };
        let (lost, unmet) = (number("lost cycles: "), number("it was not awake for ").unwrap_or(0));
        let [fast, slow] = pairs.map(|[before, after]| after.cycle.saturating_sub(before.cycle));
        // The last frame may have come without its state. If the slow task noticed, these are numbers of that.
        let is_of_fast = lost.is_none_or(|lost| [fast, fast + 1].contains(&(lost + 1)));
        let met = if is_of_fast { fast } else { slow }.saturating_sub(unmet);
        if met <= AFTER + 1 {
            return Ok(fast.saturating_sub(1));
        }
        Err(format!(
            "the takeover took {met} releases that the standby met: {pairs:?}; {}",
            self.said()
        ))
    }

    /// Compares what the readers have had with what must hold, up to a moment if the node was started anew then.
    pub(super) fn conclude(self, turn: &mut Turn, until_ns: u64) {
        let Self { setter, readers, .. } = self;
        let acknowledged = setter.acknowledged();
        drop(setter);
        for (reader, name) in readers.iter().zip(["fast", "slow"]) {
            let seen = reader.seen();
            let end = seen.frames.partition_point(|got| got.publish_ns <= until_ns);
            let frames = &seen.frames[..end];
            turn.keep(
                frames::that_jump(frames, STEP).into_iter().map(|it| format!("{name}: {it}")),
            );
            if name == "fast" {
                turn.keep(frames::that_lost(frames, &acknowledged));
                turn.measured.push(("sets acknowledged", acknowledged.len() as u64));
            }
            let last = frames.last().map_or(0, |got| got.cycle);
            let twice = seen.twice.iter().filter(|cycle| **cycle <= last);
            turn.keep(twice.map(|cycle| format!("{name}: cycle {cycle} was published twice")));
            if seen.counters.restarts > 0 && until_ns == u64::MAX {
                turn.keep([format!("{name}: a reader took the two processes for two writers")]);
            }
        }
    }
}

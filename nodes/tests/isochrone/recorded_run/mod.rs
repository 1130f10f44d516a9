//! A run of two tasks that wire each other, stepped by hand and recorded: an input that fails for a while,
//! missed cycles, sets, forces, and an online change.

use std::path::Path;

use isochrone_control::desk::{Draft, Feeds, Operator, OrderOutcome, RequestTerms};
use isochrone_engine::orders::Inbox;
use isochrone_engine::{Flags, InputReading, Plan, Rules, Source, TaskEngine};
use isochrone_model::{Entry, Hold};
use isochrone_recording::{ChannelId, ClockReading, RecordedEntry, RecordedNode, RowHead, Writer};
use isochrone_runtime::journal::Line;
use isochrone_runtime::task_layouts;
use isochrone_testing::Plant;

pub(crate) fn configuration() -> Plant {
    Plant::new("level")
        .with("control = \"force\"")
        .task("fast", "1ms")
        .task("slow", "4ms")
        .on("fast")
        .input("target", "plant/target", "default = 1.0\nmax_age = \"20ms\"")
        .ramp("ramp", "value = \"target\", setChangeRate = 100.0")
        .ramp("back", "value = \"follow.delayedValue\", setChangeRate = 70.0")
        .on("slow")
        .ramp("follow", "value = \"ramp.delayedValue\", setChangeRate = 40.0")
        .on("fast")
        .output("plant/level", &["ramp.delayedValue", "back.delayedValue", "target"])
        .on("slow")
        .output("plant/slow", &["follow.delayedValue", "ramp.delayedValue"])
}

/// The first cycles of the tasks with another configuration.
pub(crate) const CHANGED: [u64; 2] = [240, 63];
/// Cycles of `fast`.
pub(crate) const CYCLES: u64 = 400;
/// Those of `fast` that were missed.
pub(crate) const MISSED: std::ops::Range<u64> = 150..163;

/// The configuration that is applied: a block more, between the tasks.
pub(crate) fn changed() -> String {
    let block = "[[block]]\nname = \"extra\"\ntype = \"LimRateOfChangeCI\"\ntask = \"slow\"\n\
        in = { value = \"back.delayedValue\", setChangeRate = 9.0 }\n";
    let wired = "value = \"extra.delayedValue\", setChangeRate = 70.0";
    configuration().replace("value = \"follow.delayedValue\", setChangeRate = 70.0", wired) + block
}

/// What is done to a row before it is written: `None` loses it.
pub(crate) type Edit<'a> = dyn FnMut(&str, &mut RowHead, &mut Vec<f64>) -> bool + 'a;

/// Records the run as it was.
pub(crate) fn record(file: &Path) {
    record_with(file, &mut |_, _, _| true);
}

/// Records the run with other rows.
pub(crate) fn record_with(file: &Path, edit: &mut Edit<'_>) {
    let plan = plan(&configuration());
    let mut run = Run::new(&plan, file);
    for cycle in 0..CYCLES {
        run.operate(cycle);
        if !MISSED.contains(&cycle) {
            run.step(0, cycle, edit);
        }
        if cycle % 4 == 2 {
            run.step(1, cycle / 4, edit);
        }
        if cycle == 270 {
            run.writer.flush().unwrap();
        }
    }
    // The journal may come behind the rows that it is about.
    for entry in std::mem::take(&mut run.entries) {
        run.write_entry(&entry);
    }
    run.writer.finish().map_err(|(error, _)| error).unwrap();
}

fn plan(text: &str) -> Plan {
    Plan::new(Source::new("level.toml", text), &Rules::default()).unwrap()
}

struct Run {
    engines: Vec<TaskEngine>,
    inboxes: Vec<Inbox>,
    operator: Operator,
    entries: Vec<Entry>,
    replacements: Vec<Option<isochrone_engine::orders::Replacement>>,
    next: [u64; 2],
    missed: [u64; 2],
    writer: Writer<std::fs::File>,
    channels: Vec<ChannelId>,
    target: f64,
}

const NAMES: [&str; 2] = ["fast", "slow"];

impl Run {
    fn new(plan: &Plan, file: &Path) -> Self {
        let clock = ClockReading { monotonic_ns: 5, unix_ns: 1_795_000_000_000_000_000 };
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let node = RecordedNode { name: "level".into(), version, file: "level.toml".into() };
        let out = std::fs::File::create(file).unwrap();
        let mut writer = Writer::create_for_node(out, clock, &node, &configuration()).unwrap();
        let layouts = task_layouts(plan);
        let channels = layouts.iter().map(|layout| writer.add_task(layout).unwrap()).collect();
        Self {
            engines: TaskEngine::build(plan).unwrap(),
            inboxes: vec![Inbox::new(8), Inbox::new(8)],
            operator: Operator::new(plan, Feeds::Services),
            entries: Vec::new(),
            replacements: vec![None, None],
            next: [0; 2],
            missed: [0; 2],
            writer,
            channels,
            target: 0.0,
        }
    }

    /// What operators do before a cycle of `fast`.
    fn operate(&mut self, cycle: u64) {
        let request = || RequestTerms::default();
        let next = self.next;
        let prepared = match cycle {
            60 => self.operator.set(
                [("ramp.setChangeRate", 250.0), ("follow.setChangeRate", 90.0)],
                request(),
                &next,
            ),
            90 => self.operator.force([("target", 3.0)], Hold::Seconds(0.04), request(), &next),
            // On its way while cycles are missed.
            149 => self.operator.force(
                [("ramp.delayedValue", -2.0)],
                Hold::UntilReleased,
                request(),
                &next,
            ),
            210 => self.operator.release(["ramp.delayedValue"], Vec::new(), request(), &next),
            230 => {
                let draft = Draft::new(&plan(&changed())).unwrap();
                let prepared = self.operator.change(draft, request()).unwrap();
                let (_, replacements) = self.operator.send_change(prepared, &next).unwrap();
                self.replacements = replacements.into_iter().map(Some).collect();
                let layouts = task_layouts(&plan(&changed()));
                let add = |layout| self.writer.add_task(layout).unwrap();
                self.channels.extend(layouts.iter().map(add));
                return;
            }
            300 => self.operator.set([("extra.setChangeRate", 20.0)], request(), &next),
            _ => return,
        };
        for (task, order) in self.operator.send(prepared.unwrap()).1 {
            self.inboxes[task].take(order).unwrap();
        }
    }

    fn step(&mut self, task: usize, cycle: u64, edit: &mut Edit<'_>) {
        let Self { engines, inboxes, operator, entries, replacements, .. } = self;
        let (engine, inbox) = (&mut engines[task], &mut inboxes[task]);
        if cycle >= CHANGED[task]
            && let Some(mut replacement) = replacements[task].take()
        {
            engine.replace(&mut replacement, cycle);
            entries.push(operator.replaced(task, replacement, 7));
            self.channels[task] = self.channels[task + 2];
        }
        engine.expire(cycle, |ended| entries.push(operator.expired(task, ended, cycle, 7)));
        inbox.apply(engine, cycle, 0, |order| match operator.done(task, order, 7) {
            OrderOutcome::Applied(entry) => entries.push(entry),
            other => panic!("{other:?}"),
        });
        if task == 0 {
            // Its sensor is silent for a while.
            let is_silent = (100..140).contains(&cycle);
            if !is_silent {
                self.target = (cycle as f64 / 7.0).sin() * 10.0;
            }
            let (value, ok) = (self.target, !is_silent);
            let age_s = if is_silent { (cycle - 99) as f64 / 1e3 } else { 0.0001 };
            let (source_ns, flags) = (1, Flags::NONE);
            engine.read_input(0, &InputReading { value, ok, age_s, source_ns, flags });
        }
        engine.step(cycle);
        if cycle + 1 == CHANGED[task]
            && let Some(replacement) = &mut replacements[task]
        {
            engine.hand_over(replacement);
        }
        self.missed[task] += cycle - self.next[task];
        self.next[task] = cycle + 1;
        let mut values = vec![0.0; engine.row_len()];
        engine.read_row(&mut values);
        let period_ns = [1_000_000, 4_000_000][task];
        let release_ns = 1_000_000_000 + cycle * period_ns + [0, 2_500_000][task];
        let (start_ns, end_ns, missed) =
            (release_ns + 1_000, release_ns + 9_000, self.missed[task]);
        let mut head = RowHead { cycle, release_ns, start_ns, end_ns, missed, lost: 0 };
        if edit(NAMES[task], &mut head, &mut values) {
            self.writer.write_row(self.channels[task], &head, &values).unwrap();
        }
    }

    fn write_entry(&mut self, entry: &Entry) {
        let line = Line::Entry(entry.clone());
        let line = serde_json::to_string(&line).unwrap();
        let recorded =
            RecordedEntry { time_ns: 7, cycle: entry.cycle, task: entry.task.clone(), line };
        self.writer.write_entry(&recorded).unwrap();
    }
}

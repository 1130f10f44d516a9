//! Many instances do the same as few, which are stepped one by one, whatever is done to one of them.

use isochrone_engine::orders::{
    AtEnd, CarriedForce, Carry, CopySpan, Inbox, Order, Replacement, SlotForce, Store, Work,
};
use isochrone_engine::{Plan, Rules, Source, TaskEngine};

/// `count` chains of a saw and a ramp with a common rate and preset, and blocks of which some share inputs.
fn plan(count: usize) -> Plan {
    let text = format!(
        r#"
        [node]
        name = "n"
        [[task]]
        name = "t"
        period = "1ms"
        [[variable]]
        name = "preset"
        initial = 3.0
        [[block]]
        name = "saw"
        type = "SawTooth"
        count = {count}
        in = {{ incrementRange = 7, numberSteps = 90 }}
        [[block]]
        name = "ramp"
        type = "LimRateOfChangeCI"
        count = {count}
        in = {{ value = "saw.{{i}}.value", setChangeRate = 900.0, defaultOutValue = "preset" }}
        # In one bank with another that has other wires.
        [[block]]
        name = "own"
        type = "LimRateOfChangeCI"
        count = {count}
        in = {{ value = 1e6, setChangeRate = "ramp.{{i}}.delayedValue" }}
        [[block]]
        name = "other"
        type = "LimRateOfChangeCI"
        in = {{ value = "ramp.0.delayedValue", setChangeRate = "preset" }}
        # Wires that bring later pins different values.
        [[block]]
        name = "line"
        type = "ScaleLinear"
        count = {count}
        in = {{ x = 2.0, x1 = "ramp.{{i}}.delayedValue", x2 = 5e6, y1 = 0.0, y2 = 1.0, yMin = -9.0, yMax = 9.0 }}
        [[block]]
        name = "late"
        type = "ScaleLinear"
        count = {count}
        in = {{ x = 2.0, x1 = "ramp.{{i}}.delayedValue@prev", x2 = 5e6, y1 = 0.0, y2 = 1.0, yMin = -9.0, yMax = 9.0 }}
        # Signals that all instances have in common, at the first and at a later pin.
        [[block]]
        name = "smooth"
        type = "LowPassCI"
        count = {count}
        in = {{ value = "preset", timeConstant = 0.1 }}
        [[block]]
        name = "kept"
        type = "LimRateOfChangeCI"
        count = {count}
        in = {{ enDefaultOutValue = true, defaultOutValue = "preset" }}
        "#
    );
    Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap()
}

/// Outputs of the first, the second and the last instance, and inputs of the second.
const SHOWN: [&str; 7] = [
    "ramp.#.delayedValue",
    "ramp.#.value",
    "own.#.delayedValue",
    "line.#.y",
    "late.#.y",
    "smooth.#.filteredValue",
    "kept.#.delayedValue",
];

struct Run {
    plan: Plan,
    count: usize,
    engine: TaskEngine,
    inbox: Inbox,
    cycle: u64,
    forced: Vec<(u32, AtEnd)>,
    /// Whether there is a slack.
    is_maintained: bool,
}

impl Run {
    fn new(count: usize, is_maintained: bool) -> Self {
        let plan = plan(count);
        let engine = TaskEngine::build(&plan).unwrap().remove(0);
        let inbox = Inbox::new(8);
        let mut run =
            Self { plan, count, engine, inbox, cycle: 0, forced: Vec::new(), is_maintained };
        // Each saw begins at another value.
        let starts = (0..count).map(|saw| {
            let start = if saw + 1 == count { 900.0 } else { 40.0 * saw as f64 };
            Store::new(run.slot(&format!("saw.{saw}.startValue")), start)
        });
        let stores = starts.collect();
        run.order(Work::Set { feeds: [].into(), stores });
        run
    }

    /// The slot of a pin. `#last` is the number of the last instance.
    fn slot(&self, name: &str) -> usize {
        let name = name.replace("#last", &(self.count - 1).to_string());
        let mut slots = 0..self.engine.image().len();
        slots.rfind(|slot| self.plan.slot_name(0, *slot) == name).unwrap()
    }

    fn order(&mut self, work: Work) {
        self.inbox.take(Order::new(None, work)).unwrap();
    }

    fn set(&mut self, name: &str, value: f64) {
        let stores = [Store::new(self.slot(name), value)].into();
        self.order(Work::Set { feeds: [].into(), stores });
    }

    /// For five cycles.
    fn force(&mut self, name: &str, value: f64, at_end: AtEnd) {
        let slot = self.slot(name);
        let stores = [Store::new(slot, value)].into();
        let forces = [SlotForce::new(slot as u32, at_end, [].into())].into();
        self.forced.push((slot as u32, at_end));
        self.order(Work::Force { stores, forces, cycles: Some(5) });
    }

    /// Goes over to an engine of the same plan.
    fn replace(&mut self) {
        let engine = TaskEngine::build(&self.plan).unwrap().remove(0);
        let whole = |len: usize| [CopySpan { from: 0, to: 0, len }].into();
        let (image, state) = (whole(engine.image().len()), whole(engine.state().len()));
        let force = |slot| {
            let (_, at_end) = self.forced.iter().rfind(|(forced, _)| *forced == slot).unwrap();
            CarriedForce { from: slot, force: SlotForce::new(slot, *at_end, [].into()) }
        };
        let forces = self.engine.forced_slots().map(force).collect();
        let carry = Carry { image, state, forces, ..Carry::default() };
        let mut replacement = Replacement::new(engine, carry);
        self.engine.replace(&mut replacement, self.cycle);
    }

    /// What is shown in each of so many cycles.
    fn step(&mut self, cycles: usize) -> Vec<Vec<u64>> {
        let instances = ["0", "1", "#last"];
        let shown = SHOWN.iter().flat_map(|name| instances.map(|number| name.replace('#', number)));
        let slots: Vec<usize> = shown.map(|name| self.slot(&name)).collect();
        let one = |_| {
            self.engine.expire(self.cycle, |_| ());
            self.inbox.apply(&mut self.engine, self.cycle, 0, |_| ());
            self.engine.step(self.cycle);
            if self.is_maintained {
                self.engine.maintain();
            }
            self.cycle += 1;
            slots.iter().map(|slot| self.engine.image()[*slot].to_bits()).collect()
        };
        (0..cycles).map(one).collect()
    }
}

/// What may be done to a node.
type Deed = (&'static str, fn(&mut Run));

const DEEDS: [Deed; 14] = [
    ("nothing", |_| ()),
    ("a rate is set", |run| run.set("ramp.1.setChangeRate", 1_500.0)),
    ("the common rate is forced above it", |run| {
        run.force("ramp.1.setChangeRate", 900.0, AtEnd::Restore);
    }),
    ("a rate is set back", |run| run.set("ramp.1.setChangeRate", 900.0)),
    ("the first rate is set", |run| run.set("ramp.0.setChangeRate", 100.0)),
    ("the first rate is set back", |run| run.set("ramp.0.setChangeRate", 900.0)),
    ("the last rate is forced", |run| {
        run.force("ramp.#last.setChangeRate", 40.0, AtEnd::Restore);
    }),
    ("a signal is forced", |run| run.force("ramp.1.value", -20.0, AtEnd::Recompute)),
    ("a common signal is forced for one", |run| {
        run.force("kept.1.defaultOutValue", 9.0, AtEnd::Recompute);
    }),
    ("a common first signal is forced for one", |run| {
        run.force("smooth.1.value", 9.0, AtEnd::Recompute);
    }),
    ("a preset is taken", |run| run.set("ramp.1.enDefaultOutValue", 1.0)),
    ("a preset is left", |run| run.set("ramp.1.enDefaultOutValue", 0.0)),
    ("a result is forced", |run| run.force("ramp.0.delayedValue", 5.0, AtEnd::Recompute)),
    ("the signal of all is set", |run| run.set("preset", 4.0)),
];

#[test]
fn what_is_done_to_one_of_many_instances_is_done_to_that_one_alone() {
    // Each with a new node, and all in a row.
    let mut sequences: Vec<Vec<Deed>> = DEEDS.iter().map(|deed| vec![*deed]).collect();
    sequences.push(DEEDS.to_vec());
    for (sequence, is_maintained) in sequences.iter().flat_map(|of| [(of, true), (of, false)]) {
        let (mut many, mut few) = (Run::new(20, is_maintained), Run::new(3, false));
        for (what, act) in sequence {
            // So many cycles that all banks were checked.
            assert_eq!(many.step(25), few.step(25), "before {what}");
            act(&mut many);
            act(&mut few);
            assert_eq!(many.step(3), few.step(3), "{what}");
            many.replace();
            few.replace();
            assert_eq!(many.step(12), few.step(12), "{what}, and then another engine");
        }
    }
}

#[test]
fn instances_that_go_on_from_loaded_words_have_the_values_of_those() {
    let before = |run: &mut Run| {
        run.step(10);
        run.set("ramp.1.setChangeRate", 10.0);
        run.step(10);
    };
    let mut run = Run::new(20, true);
    before(&mut run);
    let mut words = vec![0.0; run.engine.state_words()];
    run.engine.copy_words(&mut words);
    for (is_maintained, is_checked) in [(false, false), (true, false), (false, true)] {
        let mut other = Run::new(20, is_maintained);
        other.step(3);
        other.engine.load_words(run.cycle - 1, &words);
        if is_checked {
            other.engine.check_sharing();
        }
        other.cycle = run.cycle;
        let mut same = Run::new(20, is_maintained);
        before(&mut same);
        assert_eq!(other.step(50), same.step(50));
    }
}

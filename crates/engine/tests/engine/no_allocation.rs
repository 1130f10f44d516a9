//! Nothing on the real-time path allocates.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use isochrone_engine::orders::{
    AtEnd, CarriedForce, CarriedValue, Carry, CopySpan, Inbox, Order, Replacement, SlotForce,
    Store, Work,
};
use isochrone_engine::{Flags, InputReading, Plan, Rules, Source, TaskEngine};

thread_local! {
    /// Calls of the allocator by this thread: the test harness has threads of its own.
    static CALLS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

#[allow(unsafe_code, reason = "a global allocator is an unsafe trait")]
// SAFETY: every call is passed on to the system's allocator as it is. Counting does not allocate:
// the thread-local is const-initialised and has no destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.set(CALLS.get() + 1);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        CALLS.set(CALLS.get() + 1);
        // SAFETY: the caller keeps the contract of `dealloc`, and `pointer` came from `System`.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        CALLS.set(CALLS.get() + 1);
        // SAFETY: the caller keeps the contract of `realloc`, and `pointer` came from `System`.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Two tasks that wire each other, every block type, loops through the cycle before, and errors.
const CONFIGURATION: &str = r#"
[node]
name = "n"
control = "force"
[[task]]
name = "fast"
period = "1ms"
ob = 35
[[task]]
name = "slow"
period = "10ms"
[[input]]
name = "x"
task = "fast"
[[block]]
name = "saw"
task = "fast"
type = "SawTooth"
in = { timeRange = 3, incrementRange = 100, numberSteps = 9 }
[[block]]
name = "scale"
task = "fast"
type = "ScaleLinear"
in = { x = "saw.value", x1 = 0, y1 = 0, x2 = 100, y2 = 1, yMin = "x", yMax = 5 }
[[block]]
name = "expr"
task = "fast"
count = 1000
type = "Expr"
out = { sum = '"expr.{i}.sum@prev" + x', root = "SQRT(x)", on = 'MUX(saw.value MOD 2, x > 1.0, "ramp.{i}.delayedValue" > x)' }
[[block]]
name = "ramp"
task = "fast"
count = 1000
type = "LimRateOfChangeCI"
in = { value = "scale.y", setChangeRate = "x", defaultOutValue = "advanced.{i}.outputValue", callOB = 35 }
[[block]]
name = "advanced"
task = "slow"
count = 1000
type = "LimRateOfChangeAdvancedCI"
in = { autoValue = "ramp.{i}.delayedValue", setPosUpRateLim = "advanced.0.outputValue@prev", setHighLim = 9 }
[[output]]
service = "s"
task = "slow"
signals = ["advanced.0.outputValue", "scale.y", "x"]
"#;

#[test]
fn stepping_reading_and_writing_do_not_allocate_from_the_first_cycle_on() {
    let source = Source { name: "n.toml".into(), text: CONFIGURATION.into() };
    let plan = Plan::new(source, &Rules::default()).unwrap();
    let mut engines = TaskEngine::build(&plan).unwrap();
    let [fast, slow] = &mut engines[..] else { unreachable!("two tasks") };
    let (mut frame, mut row) = ([0.0; 3], vec![0.0; slow.row_len()]);

    let before = CALLS.get();
    for cycle in 0..500 {
        // Rejected, erroneous and good samples.
        fast.set_input(0, [f64::NAN, -1.0, 2.0, 1e300][cycle as usize % 4], cycle);
        if cycle % 50 == 0 {
            let (age_s, source_ns, flags) = (f64::INFINITY, 0, Flags::SUBSTITUTE);
            fast.read_input(0, &InputReading { value: 0.0, ok: false, age_s, source_ns, flags });
        }
        fast.step(cycle);
        if cycle % 10 == 0 {
            slow.step(cycle / 10);
            slow.read_output(0, &mut frame);
            slow.read_row(&mut row);
            std::hint::black_box((
                slow.output_source_ns(0),
                slow.output_flags(0),
                slow.block_errors(),
                slow.image(),
                slow.state(),
            ));
        }
    }
    let calls = CALLS.get() - before;

    assert_eq!(calls, 0);
    assert!(before > 0, "the counter counts");
    assert!(fast.block_errors() > 0, "errors were among what was measured");
}

#[test]
fn a_new_engine_takes_over_from_the_old_one_without_allocating_or_freeing() {
    let plan = |text: &str| Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap();
    let running = plan(CONFIGURATION);
    let mut engines = TaskEngine::build(&running).unwrap();
    let slot = |name: &str| {
        let mut slots = 0..running.tasks[0].image.len();
        slots.find(|slot| running.slot_name(0, *slot) == name).unwrap()
    };
    let slots = [("ramp.7.setChangeRate", 2.0), ("ramp.9.delayedValue", 3.0)];
    let slots = slots.map(|(name, value)| (slot(name), value));
    let force = |(slot, _)| SlotForce::new(slot as u32, AtEnd::Restore, [].into());
    let stores = slots.map(|(slot, value)| Store::new(slot, value)).into();
    let work = Work::Force { stores, forces: slots.map(force).into(), cycles: None };
    let mut inbox = Inbox::new(1);
    inbox.take(Order::new(None, work)).unwrap();
    inbox.apply(&mut engines[0], 0, 0, drop);
    engines.iter_mut().for_each(|engine| engine.step(0));

    // The same blocks in the same places, with another constant in the first task.
    let next = plan(&CONFIGURATION.replace("numberSteps = 9", "numberSteps = 8"));
    let new = TaskEngine::build(&next).unwrap().into_iter().enumerate();
    let replacement = |(task, engine): (usize, TaskEngine)| {
        let whole = |len| [CopySpan { from: 0, to: 0, len }].into();
        let carried = slots.map(|slot| CarriedForce { from: slot.0 as u32, force: force(slot) });
        // What other tasks give stands behind the inputs, each of which has three slots.
        let inputs = running.tasks[task].inputs.len();
        let import = CarriedValue { import: 0, position: 0, slot: 3 * inputs, source: inputs };
        Replacement::new(
            engine,
            Carry {
                image: whole(engines[task].image().len()),
                state: whole(engines[task].state().len()),
                imports: [import].into(),
                forces: if task == 0 { carried.into() } else { [].into() },
                stores: if task == 0 {
                    [Store::new(slot("saw.numberSteps"), 8.0)].into()
                } else {
                    [].into()
                },
            },
        )
    };
    let mut replacements: Vec<Replacement> = new.map(replacement).collect();
    assert!(replacements.iter().all(|replacement| replacement.words() > 1000));

    let before = CALLS.get();
    for (engine, replacement) in engines.iter_mut().zip(&mut replacements) {
        engine.hand_over(replacement);
        engine.replace(replacement, 1);
        engine.step(1);
    }
    assert_eq!(CALLS.get() - before, 0);
    assert_eq!(engines[0].forced_slots().count(), 2);
    assert!(slots.iter().all(|(slot, value)| engines[0].image()[*slot] == *value));
}

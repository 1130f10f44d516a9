//! Nothing on the real-time path allocates.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use isochrone_engine::operate::{Draft, Feeds, Inbox, Operator, Request};
use isochrone_engine::{Flags, Plan, Reading, Rules, Source, TaskEngine};
use isochrone_model::Hold;

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
            fast.read_input(0, &Reading { value: 0.0, ok: false, age_s, source_ns, flags });
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
    let mut operator = Operator::new(&running, Feeds::Services);
    let values = [("ramp.7.setChangeRate", 2.0), ("ramp.9.delayedValue", 3.0)];
    let force = operator.force(values, Hold::UntilReleased, Request::default(), &[0, 0]).unwrap();
    let mut inbox = Inbox::new(1);
    let (_, orders) = operator.send(force);
    orders.into_iter().for_each(|(_, order)| inbox.take(order).unwrap());
    inbox.apply(&mut engines[0], 0, 0, |order| drop(operator.done(0, order, 0)));
    engines.iter_mut().for_each(|engine| engine.step(0));

    let text = CONFIGURATION.replace("count = 1000", "count = 1001");
    let text = text.replace("numberSteps = 9", "numberSteps = 8");
    let prepared = operator.change(Draft::new(&plan(&text)).unwrap(), Request::default()).unwrap();
    let (_, mut replacements) = operator.send_change(prepared, &[1, 1]).unwrap();
    assert!(replacements.iter().all(|replacement| replacement.words() > 1000));

    let before = CALLS.get();
    for (engine, replacement) in engines.iter_mut().zip(&mut replacements) {
        engine.hand_over(replacement);
        engine.replace(replacement, 1);
        engine.step(1);
    }
    assert_eq!(CALLS.get() - before, 0);
    assert_eq!(operator.forces().count(), 2);
}

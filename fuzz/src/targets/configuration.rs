//! The text of a configuration: from what is written to engines that step.

use isochrone_control::desk::{Draft, Feeds, Operator, RequestTerms, Signals};
use isochrone_engine::{Diagnostic, Plan, Rules, Source, TaskEngine};
use isochrone_model::Access;

use crate::{Target, assert_sentence};

pub(crate) const TARGET: Target =
    Target { name: "configuration", max_bytes: 4096, max_mib: 64, read };

/// A plan for more instances takes the time of many inputs, and nothing else.
const MOST_DIGITS: usize = 3;
/// What inputs get.
const SAMPLES: [f64; 5] = [1.0, f64::NAN, -1e300, 32767.0, f64::INFINITY];

fn read(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if asks_for_many(text) {
        return;
    }
    match Plan::new(Source::new("fuzz.toml", text), &Rules::default()) {
        // As operators may do anything, what it can be saved as is applied.
        Ok(mut plan) => {
            plan.control = Access::Force;
            run(&plan);
        }
        Err(refused) => {
            assert_sentence(&refused.to_string());
            assert!(refused.all.iter().any(|it| !it.is_warning()), "refused without an error");
            refused.all.iter().for_each(|diagnostic| check(diagnostic, text));
        }
    }
}

/// Whether a `count` may be long.
fn asks_for_many(text: &str) -> bool {
    let has_many_digits = |text: &str| {
        let mut runs = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        runs.any(|run| run.len() > MOST_DIGITS && run.starts_with(|c: char| c.is_ascii_digit()))
    };
    // A key may have escapes in it.
    (text.contains("count") || text.contains('\\')) && has_many_digits(text)
}

fn check(diagnostic: &Diagnostic, text: &str) {
    assert_sentence(&diagnostic.message);
    diagnostic.help.iter().for_each(|help| assert_sentence(help));
    for span in diagnostic.first.iter().chain([&diagnostic.span]) {
        assert!(text.get(span.clone()).is_some(), "{span:?} is no place in the text: {diagnostic}");
    }
}

/// What is accepted runs, each time alike, and a copy of what runs changes nothing.
fn run(plan: &Plan) {
    let text = &*plan.source.text;
    plan.warnings.iter().chain(&plan.notes).for_each(|diagnostic| check(diagnostic, text));
    let images = [(); 2].map(|()| images(plan));
    assert_eq!(images[0], images[1], "a second run differs");
    let operator = Operator::new(plan, Feeds::Program);
    let saved = operator.save(text).expect("what runs can be saved");
    let mut again =
        plan.rules.plan(Source::new("fuzz.toml", saved)).expect("what is saved is accepted");
    again.control = plan.control;
    let draft = Draft::new(&again).expect("what is saved can be stepped");
    let change = operator.change(draft, RequestTerms::default());
    let summary = change.expect("what is saved can be applied").summary().clone();
    let differences = [summary.added, summary.removed, summary.changed, summary.limits].concat();
    assert!(differences.is_empty(), "saved, it is another one: {differences:?}");
}

/// The bits of all values after some cycles, each a value of its type.
fn images(plan: &Plan) -> Vec<u64> {
    let mut engines = TaskEngine::build(plan).expect("what is accepted can be stepped");
    for cycle in 0..3 {
        for (engine, task) in engines.iter_mut().zip(&plan.tasks) {
            for (index, input) in task.inputs.iter().enumerate() {
                let sample = SAMPLES[(index + cycle as usize) % SAMPLES.len()];
                engine.set_input(index, sample, 1);
                assert!(input.value_type.holds(engine.image()[index]), "{}", input.name);
            }
            engine.step(cycle);
        }
    }
    let signals = Signals::of(plan);
    for (task, engine) in engines.iter().enumerate() {
        for (slot, value) in engine.image().iter().enumerate() {
            let Some(signal) = signals.at(task, slot) else { continue };
            let is_held = signal.can_be_unset || signal.value_type.holds(*value);
            assert!(is_held, "{} is {value}, which is no {}", signal.name, signal.value_type);
        }
    }
    let values = engines.iter().flat_map(TaskEngine::image);
    values.map(|value| value.to_bits()).collect()
}

//! The catalogue: what it says of every block, and the golden cases.

use std::collections::HashSet;
use std::fs;
use std::path::Path;

use isochrone_blocks::lim_rate_of_change::LimRateOfChangeCI;
use isochrone_blocks::{BlockType, CATALOGUE, Cycle, Pin, PinDefault, PinType};

#[test]
fn every_block_says_how_it_computes_and_what_was_chosen_where_its_document_is_silent() {
    for block in CATALOGUE {
        assert!(!block.computes.is_empty(), "{}: say how in `computes {{ … }}`", block.name);
        let silent_on: HashSet<_> = block.decisions.iter().map(|d| d.silent_on).collect();
        assert_eq!(silent_on.len(), block.decisions.len(), "{}: each once", block.name);
        assert!(block.decisions.iter().all(|d| !d.silent_on.is_empty() && !d.chosen.is_empty()));
    }
    for (block, what) in [
        ("LimRateOfChangeCI", "overrun"),
        ("LimRateOfChangeAdvancedCI", "passes 0.0"),
        ("LimRateOfChangeAdvancedCI", "several modes"),
        ("LimRateOfChangeAdvancedCI", "all four rates are 0.0"),
        ("LimRateOfChangeAdvancedCI", "equal limits"),
        ("LimRateOfChangeAdvancedCI", "limits are off"),
        ("ScaleLinear", "order"),
        ("ScaleLinear", "two points"),
        ("SawTooth", "shorter than the period"),
        ("SawTooth", "overrun"),
        ("SawTooth", "behind 32767"),
    ] {
        let known = CATALOGUE.iter().find(|known| known.name == block).unwrap();
        assert!(known.decisions.iter().any(|d| d.silent_on.contains(what)), "{block}: {what}");
    }
}

#[test]
fn pins_carry_the_other_spellings_of_the_documents_and_the_latches_of_blocks_that_reset() {
    let mut found = Vec::new();
    for block in CATALOGUE {
        for pin in block.inputs.iter().chain(block.outputs) {
            found.extend(pin.aliases.iter().map(|alias| format!("{alias} = {}", pin.name)));
            found.extend(pin.latched_by.map(|latch| format!("{} at {latch}", pin.name)));
            assert_eq!(pin.names_task, pin.name == "callOB");
        }
    }
    let expected = [
        "subFunctionStatus = subfunctionStatus",
        "subFunctionStatus = subfunctionStatus",
        "Ret_Val = y",
        "startValue at reset",
        "timeRange at reset",
        "incrementRange at reset",
        "numberSteps at reset",
        "endlessSteps at reset",
        "subFunctionStatus = subfunctionStatus",
        "subFunctionStatus = subfunctionStatus",
        "subFunctionStatus = subfunctionStatus",
        "subFunctionStatus = subfunctionStatus",
        "initialValue at reset",
        "initialValue at reset",
        "initialValue at reset",
    ];
    assert_eq!(found, expected);
}

#[test]
fn names_are_unique() {
    let mut blocks = HashSet::new();
    for block_type in CATALOGUE {
        assert!(blocks.insert(block_type.name), "{} stands twice", block_type.name);
        let mut pins = HashSet::new();
        for pin in block_type.inputs.iter().chain(block_type.outputs) {
            assert!(pins.insert(pin.name), "{}.{} stands twice", block_type.name, pin.name);
        }
    }
}

#[test]
fn every_block_and_pin_is_described_in_a_sentence() {
    let is_sentence = |doc: &str| doc.ends_with('.') && doc.len() > 5 && doc.trim() == doc;
    for block_type in CATALOGUE {
        assert!(is_sentence(block_type.doc()), "{}: {:?}", block_type.name, block_type.doc());
        for pin in block_type.inputs.iter().chain(block_type.outputs) {
            assert!(is_sentence(pin.doc()), "{}.{}: {:?}", block_type.name, pin.name, pin.doc());
        }
    }
}

#[test]
fn every_default_is_a_value_of_its_pins_type() {
    for pin in CATALOGUE.iter().flat_map(|block| block.inputs) {
        match pin.default {
            PinDefault::Required => {}
            PinDefault::Value(slot) => assert!(pin.pin_type.holds(slot), "{}", pin.name),
            PinDefault::CallingTask => assert!(pin.names_task, "{}", pin.name),
        }
    }
}

#[test]
fn an_instance_is_its_input_slots_then_its_output_slots() {
    let ramp = BlockType::of::<LimRateOfChangeCI>();
    assert_eq!(ramp.slots(), 9);
    let mut image = [25.0, 10.0, 0.0, 0.0, f64::NAN, -1.0, -1.0, -1.0, -1.0];
    let mut state = [0];
    let cycle = isochrone_blocks::Cycle::new(0, 100_000_000, &[]);
    assert_eq!(ramp.step_bank(&mut image, &mut state, &cycle), 0);
    assert_eq!(image[..4], [25.0, 10.0, 0.0, 0.0]);
    assert_eq!(image[5..], [1.0, 0.0, 0.0, 0.0]);
    assert_eq!(state, [1.0f64.to_bits()]);
}

#[test]
fn every_block_type_owns_at_least_a_state_word() {
    assert!(CATALOGUE.iter().all(|block| block.state_words >= 1));
}

/// Whether a golden case with all its files has an instance of the block.
fn has_golden_case(golden: &Path, block_type: &BlockType) -> bool {
    let line = format!("type = \"{}\"", block_type.name);
    fs::read_dir(golden).unwrap().any(|case| {
        let case = case.unwrap().path();
        let config = fs::read_to_string(case.join("config.toml")).unwrap_or_default();
        config.lines().any(|written| written.trim() == line) && case.join("expected.csv").is_file()
    })
}

#[test]
fn every_block_type_has_a_golden_case() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../golden");
    for block_type in CATALOGUE {
        assert!(
            has_golden_case(&golden, block_type),
            "add a folder to golden/ whose config.toml has a block of type {} and whose expected.csv has \
             what it computes; the other folders show the form",
            block_type.name
        );
    }
}

#[test]
fn every_block_has_inputs_that_keep_it_at_work() {
    const PERIOD_NS: u64 = 1_000_000;
    const CYCLES: u64 = 500_000;
    for known in CATALOGUE {
        let mut slots = vec![0.0; known.slots()];
        let inputs = known.inputs.len();
        known.typical_inputs(&mut slots[..inputs]);
        let defaults =
            known.inputs.iter().map(|pin| pin.default.slot().unwrap_or_default().to_bits());
        let typical = slots[..inputs].iter().map(|slot| slot.to_bits());
        assert!(
            !defaults.eq(typical),
            "{}: write `Block::typical` in its file, inputs that keep it at work",
            known.name
        );

        let status = known.outputs.iter().position(|pin| pin.name == "status");
        let mut words = vec![0; known.state_words];
        let (mut first, mut last) = (HashSet::new(), HashSet::new());
        for cycle in 0..CYCLES {
            let errors =
                known.step_bank(&mut slots, &mut words, &Cycle::new(cycle, PERIOD_NS, &[]));
            let outputs = &slots[inputs..];
            let word = status.map_or(0.0, |status| outputs[status]);
            // 16#7xxx is how far an execution has come.
            let is_at_limit = (0x6000..0x7000).contains(&(word as u16));
            assert!(errors == 0 && !is_at_limit, "{}: limit or error, {cycle}", known.name);
            let seen = match cycle {
                // The first call may answer an edge: the inputs were FALSE before it.
                1..1_000 => &mut first,
                _ if cycle >= CYCLES - 1_000 => &mut last,
                _ => continue,
            };
            // That a window has filled is no arrival, while its values go on as before.
            let is_signal = |pin: &&Pin| !matches!(pin.pin_type, PinType::Bool | PinType::Word);
            let signals = known.outputs.iter().zip(outputs).filter(|(pin, _)| is_signal(pin));
            seen.insert(signals.map(|(_, output)| output.to_bits()).collect::<Vec<_>>());
        }
        // What answers at once gives one answer from the first cycle on; the rest is on its way.
        assert!(last.len() > 1 || first == last, "{} has arrived", known.name);
    }
}

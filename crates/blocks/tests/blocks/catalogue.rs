//! The catalogue against the documents that it stands for, and against the golden cases.

use std::collections::HashSet;
use std::fs;
use std::path::Path;

use isochrone_blocks::lim_rate_of_change::LimRateOfChangeCI;
use isochrone_blocks::{BlockType, CATALOGUE, Cycle, Origin, Pin, PinDefault, PinType};

/// Block, direction, pin in LGF's spelling, type, default (`-`: none), and `*` for a pin that LGF does not have.
const PINS: &str = "
LimRateOfChangeCI in value LREAL 0
LimRateOfChangeCI in setChangeRate LREAL 0
LimRateOfChangeCI in defaultOutValue LREAL 0
LimRateOfChangeCI in enDefaultOutValue BOOL 0
LimRateOfChangeCI in callOB INT calling-task
LimRateOfChangeCI out delayedValue LREAL -
LimRateOfChangeCI out error BOOL -
LimRateOfChangeCI out status WORD -
LimRateOfChangeCI out subfunctionStatus WORD -
LimRateOfChangeAdvancedCI in autoValue LREAL 0
LimRateOfChangeAdvancedCI in manualValue LREAL 0
LimRateOfChangeAdvancedCI in setPosUpRateLim LREAL 0
LimRateOfChangeAdvancedCI in setPosDownRateLim LREAL 0
LimRateOfChangeAdvancedCI in setNegUpRateLim LREAL 0
LimRateOfChangeAdvancedCI in setNegDownRateLim LREAL 0
LimRateOfChangeAdvancedCI in setHighLim LREAL 0
LimRateOfChangeAdvancedCI in setLowLim LREAL 0
LimRateOfChangeAdvancedCI in defaultOutValue LREAL 0
LimRateOfChangeAdvancedCI in enDefaultOutValue BOOL 0
LimRateOfChangeAdvancedCI in track BOOL 0
LimRateOfChangeAdvancedCI in manOp BOOL 0
LimRateOfChangeAdvancedCI in reset BOOL 0
LimRateOfChangeAdvancedCI in callOB INT calling-task
LimRateOfChangeAdvancedCI out outputValue LREAL -
LimRateOfChangeAdvancedCI out posUpRateLim BOOL -
LimRateOfChangeAdvancedCI out posDownRateLim BOOL -
LimRateOfChangeAdvancedCI out negUpRateLim BOOL -
LimRateOfChangeAdvancedCI out negDownRateLim BOOL -
LimRateOfChangeAdvancedCI out highLim BOOL -
LimRateOfChangeAdvancedCI out lowLim BOOL -
LimRateOfChangeAdvancedCI out error BOOL -
LimRateOfChangeAdvancedCI out status WORD -
LimRateOfChangeAdvancedCI out subfunctionStatus WORD -
ScaleLinear in x LREAL -
ScaleLinear in x1 LREAL -
ScaleLinear in y1 LREAL -
ScaleLinear in x2 LREAL -
ScaleLinear in y2 LREAL -
ScaleLinear in yMin LREAL -
ScaleLinear in yMax LREAL -
ScaleLinear out y LREAL -
ScaleLinear out error BOOL -
ScaleLinear out status WORD -
SawTooth in startValue INT 0
SawTooth in timeRange TIME 0
SawTooth in incrementRange INT 0
SawTooth in numberSteps INT 0
SawTooth in endlessSteps BOOL 0
SawTooth in reset BOOL 0
SawTooth out value INT -
SinusCI in amplitude LREAL 1
SinusCI in offset LREAL 0
SinusCI in periode TIME 1000
SinusCI in phaseShift LREAL 0
SinusCI in callOB INT calling-task
SinusCI in reset BOOL 0
SinusCI out value LREAL -
SinusCI out error BOOL -
SinusCI out status WORD -
SinusCI out subfunctionStatus WORD -
FloatingAverage in cyclicExecution BOOL 0
FloatingAverage in trigger BOOL 0
FloatingAverage in value LREAL 0
FloatingAverage in windowSize INT 100
FloatingAverage in reset BOOL 0
FloatingAverage out average LREAL -
FloatingAverage out windowSizeReached BOOL -
FloatingAverage out error BOOL -
FloatingAverage out status WORD -
DifferenceQuotientFB in enable BOOL 0
DifferenceQuotientFB in insert BOOL 0
DifferenceQuotientFB in value LREAL 0
DifferenceQuotientFB in deltaT LREAL 0
DifferenceQuotientFB in cyclicExecution BOOL 0 *
DifferenceQuotientFB out derivatedValue LREAL -
DifferenceQuotientFB out error BOOL -
DifferenceQuotientFB out status WORD -
Integration in enable BOOL 0
Integration in value LREAL 0
Integration in reset BOOL 0
Integration out integral LREAL -
Integration out error BOOL -
Integration out status WORD -
Integration out subfunctionStatus WORD -
NonLinearInterpolation in value LREAL 0
NonLinearInterpolation in defaultOutValue LREAL 0
NonLinearInterpolation in enDefaultOutValue BOOL 0
NonLinearInterpolation in track BOOL 0
NonLinearInterpolation in reset BOOL 0
NonLinearInterpolation in numberOfPoints INT 0 *
NonLinearInterpolation in x1 LREAL 0 *
NonLinearInterpolation in y1 LREAL 0 *
NonLinearInterpolation in x2 LREAL 0 *
NonLinearInterpolation in y2 LREAL 0 *
NonLinearInterpolation in x3 LREAL 0 *
NonLinearInterpolation in y3 LREAL 0 *
NonLinearInterpolation in x4 LREAL 0 *
NonLinearInterpolation in y4 LREAL 0 *
NonLinearInterpolation in x5 LREAL 0 *
NonLinearInterpolation in y5 LREAL 0 *
NonLinearInterpolation in x6 LREAL 0 *
NonLinearInterpolation in y6 LREAL 0 *
NonLinearInterpolation in x7 LREAL 0 *
NonLinearInterpolation in y7 LREAL 0 *
NonLinearInterpolation in x8 LREAL 0 *
NonLinearInterpolation in y8 LREAL 0 *
NonLinearInterpolation in x9 LREAL 0 *
NonLinearInterpolation in y9 LREAL 0 *
NonLinearInterpolation in x10 LREAL 0 *
NonLinearInterpolation in y10 LREAL 0 *
NonLinearInterpolation in x11 LREAL 0 *
NonLinearInterpolation in y11 LREAL 0 *
NonLinearInterpolation in x12 LREAL 0 *
NonLinearInterpolation in y12 LREAL 0 *
NonLinearInterpolation out outputValue LREAL -
NonLinearInterpolation out error BOOL - *
NonLinearInterpolation out status WORD - *
";

/// Whether a decision of the block says that LGF does not have the pin.
fn is_ours(block: &str, pin: &str) -> bool {
    let is_point = |pin: &str| pin.starts_with(['x', 'y']) || pin == "numberOfPoints";
    match block {
        "DifferenceQuotientFB" => pin == "cyclicExecution",
        "NonLinearInterpolation" => is_point(pin) || pin == "error" || pin == "status",
        _ => false,
    }
}

/// The blocks that follow a page of LGF.
fn of_lgf() -> impl Iterator<Item = &'static BlockType> {
    CATALOGUE.iter().filter(|block| block.follows.is_some_and(|page| page.starts_with("LGF_")))
}

/// Asserts that what the catalogue declares is what was copied from the documents.
fn assert_same(declared: &[String], copied: &str, list: &str) {
    let copied: Vec<&str> = copied.trim_end().lines().collect();
    let differing = declared.iter().find(|line| !copied.contains(&line.as_str()));
    if let Some(line) = differing {
        panic!("\"{line}\" is declared: if the block's page in LGF has it so, add it to {list}");
    }
    assert_eq!(declared, copied, "{list} in the order of the catalogue");
}

#[test]
fn pins_have_the_spelling_order_types_and_defaults_of_lgf() {
    let mut listed = vec![String::new()];
    for block_type in of_lgf() {
        let inputs = block_type.inputs.iter().map(|pin| ("in", pin));
        let outputs = block_type.outputs.iter().map(|pin| ("out", pin));
        for (direction, pin) in inputs.chain(outputs) {
            let default = match pin.default {
                PinDefault::Required => "-".to_string(),
                PinDefault::Value(slot) => slot.to_string(),
                PinDefault::CallingTask => "calling-task".to_string(),
            };
            let (block, name, pin_type) = (block_type.name, pin.name, pin.pin_type);
            let ours = if is_ours(block, name) { " *" } else { "" };
            listed.push(format!("{block} {direction} {name} {pin_type} {default}{ours}"));
        }
    }
    assert_same(&listed, PINS, "PINS");
}

/// Block, status word, and the constant's name in LGF's documents (`*`: not LGF's, but ours).
const STATUS: &str = "
LimRateOfChangeCI 0000 STATUS_FINISHED_NO_ERROR
LimRateOfChangeCI 8200 ERR_NEG_RATE_LIM
LimRateOfChangeCI 8600 ERR_QRY_CINT
LimRateOfChangeCI 8601 ERR_OB_UNAVAILABLE
LimRateOfChangeCI 8F00 ERR_NOT_FINITE*
LimRateOfChangeAdvancedCI 0000 STATUS_FINISHED_NO_ERROR
LimRateOfChangeAdvancedCI 8200 ERR_NEG_RATE_LIM
LimRateOfChangeAdvancedCI 8202 ERR_NEG_RATE_OF_CHANGE
LimRateOfChangeAdvancedCI 8600 ERR_QRY_CINT
LimRateOfChangeAdvancedCI 8601 ERR_OB_UNAVAILABLE
LimRateOfChangeAdvancedCI 8F00 ERR_NOT_FINITE*
ScaleLinear 0000 STATUS_FINISHED_NO_ERROR
ScaleLinear 6001 WARN_Y_LIMITED_TO_YMIN
ScaleLinear 6002 WARN_Y_LIMITED_TO_YMAX
ScaleLinear 8200 ERR_LOW_LIM_OVER_UP_LIM
ScaleLinear 8F00 ERR_NOT_FINITE*
SinusCI 0000 STATUS_FINISHED_NO_ERROR
SinusCI 8200 ERR_PERIOD*
SinusCI 8600 ERR_QRY_CINT
SinusCI 8601 ERR_OB_UNAVAILABLE
SinusCI 8F00 ERR_NOT_FINITE*
FloatingAverage 0000 STATUS_FINISHED_NO_ERROR
FloatingAverage 8200 ERR_WRONG_WINDOW_SIZE
FloatingAverage 8F00 ERR_NOT_FINITE*
DifferenceQuotientFB 7000 STATUS_NO_CALL
DifferenceQuotientFB 7001 STATUS_FIRST_CALL
DifferenceQuotientFB 7002 STATUS_SUBSEQUENT_CALL
DifferenceQuotientFB 7010 STATUS_NOT_ENOUGH_VALUES
DifferenceQuotientFB 8200 ERR_DELTA_T
DifferenceQuotientFB 8F00 ERR_NOT_FINITE*
Integration 0000 STATUS_EXECUTION_FINISHED_NO_ERROR
Integration 8F00 ERR_NOT_FINITE*
NonLinearInterpolation 0000 STATUS_FINISHED_NO_ERROR*
NonLinearInterpolation 6001 WARN_VALUE_BELOW_CURVE*
NonLinearInterpolation 6002 WARN_VALUE_ABOVE_CURVE*
NonLinearInterpolation 8200 ERR_POINTS*
NonLinearInterpolation 8F00 ERR_NOT_FINITE*
";

#[test]
fn status_lists_are_complete_and_named_as_in_the_documents_of_lgf() {
    let mut listed = vec![String::new()];
    for (block, word) in of_lgf().flat_map(|b| b.status.iter().map(|word| (b.name, word))) {
        let ours = if word.origin == Origin::Ours { "*" } else { "" };
        listed.push(format!("{block} {:04X} {}{ours}", word.code, word.name));
        assert!(!word.meaning.is_empty());
    }
    assert_same(&listed, STATUS, "STATUS");
}

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

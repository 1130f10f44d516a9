//! The blocks of LGF against the documents that they follow.

use isochrone_blocks::{BlockType, CATALOGUE, Origin, PinDefault};

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
SinusCI 8203 ERR_PERIOD*
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

//! A block that is declared outside the library.

use isochrone_blocks::{
    Block, BlockType, Cycle, Decision, Indication, Ob, Origin, PinDefault, PinType, PinValue,
    StatusWord,
};

isochrone_blocks::block! {
    /// Multiplies, and keeps nothing.
    /// Two lines are one text.
    pub Gain {
        follows { "Handbook of Gains" }
        inputs {
            /// Signal.
            "x" => x: f64,
            /// Factor.
            "gain" => gain: f64 ["1/s"] = -2.5,
            /// Delay.
            #[latched_by = "on"]
            "delay" => delay: i32 ["ms"] = -7,
            /// Switch.
            #[alias = "enable"]
            #[alias = "enabled"]
            "on" => on: bool = true,
        }
        outputs {
            /// Product.
            #[alias = "product"]
            "y" => y: f64,
            /// Status word.
            "status" => status: u16,
        }
        state {}
        computes {
            "`y = x * gain`.",
        }
        status {
            0 => "STATUS_FINE": "no error",
            0x8F00 => "ERR_ODD" (ours): "odd",
        }
        decisions {
            Decision { silent_on: "delay", chosen: "none" },
        }
    }
}

impl Block for Gain {
    fn step(_: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        let y = if inputs.on { inputs.x * inputs.gain } else { 0.0 };
        Outputs { y, status: if y.is_finite() { 0 } else { 0x8F00 } }
    }
}

#[test]
fn a_block_is_described_by_its_declaration_alone() {
    const GAIN: BlockType = BlockType::of::<Gain>();
    assert_eq!((GAIN.name, GAIN.slots(), GAIN.status.len()), ("Gain", 6, 2));
    assert_eq!(GAIN.doc(), "Multiplies, and keeps nothing. Two lines are one text.");
    let pins: Vec<_> = GAIN
        .inputs
        .iter()
        .map(|pin| (pin.name, pin.pin_type, pin.unit, pin.default, pin.doc()))
        .collect();
    let expected = [
        ("x", PinType::Lreal, "", PinDefault::Required, "Signal."),
        ("gain", PinType::Lreal, "1/s", PinDefault::Value(-2.5), "Factor."),
        ("delay", PinType::Time, "ms", PinDefault::Value(-7.0), "Delay."),
        ("on", PinType::Bool, "", PinDefault::Value(1.0), "Switch."),
    ];
    assert_eq!(pins, expected);
    assert_eq!(Inputs::default(), Inputs { x: 0.0, gain: -2.5, delay: -7, on: true });
}

#[test]
fn a_block_without_state_steps_in_a_bank_like_any_other() {
    let gain = BlockType::of::<Gain>();
    let mut image = [3.0, 2.0, 0.0, 1.0, 9.0, 9.0, 5.0, 2.0, 0.0, 0.0, 9.0, 9.0];
    let mut state = vec![0; 2 * gain.state_words];
    assert_eq!(gain.step_bank(&mut image, &mut state, &Cycle::new(0, 1, &[])), 0);
    assert_eq!((image[4], image[10]), (6.0, 0.0));
}

#[test]
fn words_decisions_and_other_names_are_as_declared() {
    const GAIN: BlockType = BlockType::of::<Gain>();
    let word = |code, name, origin, meaning| StatusWord { code, name, origin, meaning };
    let words = [
        word(0, "STATUS_FINE", Origin::Document, "no error"),
        word(0x8F00, "ERR_ODD", Origin::Ours, "odd"),
    ];
    assert_eq!(GAIN.status, words);
    assert_eq!(GAIN.computes, ["`y = x * gain`."]);
    assert_eq!(GAIN.decisions, [Decision { silent_on: "delay", chosen: "none" }]);
    let on = GAIN.inputs[3];
    assert_eq!((on.aliases, on.latched_by), (&["enable", "enabled"][..], None));
    assert_eq!(GAIN.inputs[2].latched_by, Some("on"));
    assert_eq!(GAIN.follows, Some("Handbook of Gains"));
    assert_eq!((GAIN.outputs[0].aliases, GAIN.inputs[0].latched_by), (&["product"][..], None));
}

#[test]
fn an_ob_comes_out_of_its_slot_as_it_went_in() {
    let numbers = [i16::MIN, -1, 0, 35, i16::MAX].map(Ob::Number);
    let tasks = [0, 10_000, 333_333, 3_600_000_000_000].map(|period_ns| Ob::Task { period_ns });
    for ob in numbers.into_iter().chain(tasks).chain([Ob::Caller]) {
        assert_eq!(Ob::from_slot(ob.into_slot()), ob);
        assert_eq!(PinType::Int.holds(ob.into_slot()), matches!(ob, Ob::Number(_)));
    }
}

#[test]
fn a_step_is_an_error_exactly_when_the_status_word_says_so() {
    let gain = BlockType::of::<Gain>();
    assert_eq!(gain.indication(), Some(Indication::Status(5)));
    let mut state = vec![0; 3 * gain.state_words];
    let instance = |x: f64| [x, 2.0, 0.0, 1.0, 0.0, 0.0];
    let mut image = [1.0, f64::INFINITY, f64::NAN].map(instance).concat();
    assert_eq!(gain.step_bank(&mut image, &mut state, &Cycle::new(0, 1, &[])), 2);
    assert_eq!([image[5], image[11], image[17]], [0.0, f64::from(0x8F00), f64::from(0x8F00)]);
}

/// A block that can fail and has no words for it.
mod flagged {
    use isochrone_blocks::{Block, Cycle};

    isochrone_blocks::block! {
        /// Passes what is not negative.
        pub(crate) Flagged {
            inputs {
                /// Signal.
                "x" => x: f64 = 0.0,
            }
            outputs {
                /// The signal is negative.
                "error" => error: bool,
            }
        }
    }

    impl Block for Flagged {
        fn step(_: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
            Outputs { error: inputs.x < 0.0 }
        }
    }
}

#[test]
fn without_a_status_word_the_error_flag_says_so() {
    let flagged = BlockType::of::<flagged::Flagged>();
    assert_eq!(flagged.indication(), Some(Indication::Error(1)));
    assert_eq!((flagged.follows, flagged.status.len(), flagged.state_words), (None, 0, 1));
    let mut state = vec![0; 2 * flagged.state_words];
    let mut image = [1.0, 0.0, -1.0, 0.0];
    assert_eq!(flagged.step_bank(&mut image, &mut state, &Cycle::new(0, 1, &[])), 1);
    assert_eq!((image[1], image[3]), (0.0, 1.0));
}

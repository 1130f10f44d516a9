//! A block that is declared outside the library.

use isochrone_blocks::{Block, BlockType, Cycle, PinType};

isochrone_blocks::block! {
    /// Multiplies, and keeps nothing.
    /// Two lines are one text.
    pub Gain {
        inputs {
            /// Signal.
            "x" => x: f64,
            /// Factor.
            "gain" => gain: f64 ["1/s"] = -2.5,
            /// Delay.
            "delay" => delay: i32 ["ms"] = -7,
            /// Switch.
            "on" => on: bool = true,
        }
        outputs {
            /// Product.
            "y" => y: f64,
        }
        state {}
        status {}
    }
}

impl Block for Gain {
    fn step(_: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        Outputs { y: if inputs.on { inputs.x * inputs.gain } else { 0.0 } }
    }
}

#[test]
fn a_block_is_described_by_its_declaration_alone() {
    const GAIN: BlockType = BlockType::of::<Gain>();
    assert_eq!((GAIN.name, GAIN.slots(), GAIN.status.len()), ("Gain", 5, 0));
    assert_eq!(GAIN.doc(), "Multiplies, and keeps nothing. Two lines are one text.");
    let pins: Vec<_> = GAIN
        .inputs
        .iter()
        .map(|pin| (pin.name, pin.pin_type, pin.unit, pin.default, pin.doc()))
        .collect();
    let expected = [
        ("x", PinType::Lreal, "", None, "Signal."),
        ("gain", PinType::Lreal, "1/s", Some(-2.5), "Factor."),
        ("delay", PinType::Time, "ms", Some(-7.0), "Delay."),
        ("on", PinType::Bool, "", Some(1.0), "Switch."),
    ];
    assert_eq!(pins, expected);
    assert_eq!(Inputs::default(), Inputs { x: 0.0, gain: -2.5, delay: -7, on: true });
}

#[test]
fn a_block_without_state_steps_in_a_bank_like_any_other() {
    let gain = BlockType::of::<Gain>();
    let mut image = [3.0, 2.0, 0.0, 1.0, 9.0, 5.0, 2.0, 0.0, 0.0, 9.0];
    let mut state = vec![0; 2 * gain.state_words];
    assert_eq!(gain.step_bank(&mut image, &mut state, &Cycle::new(0, 1, &[])), 0);
    assert_eq!((image[4], image[9]), (6.0, 0.0));
}

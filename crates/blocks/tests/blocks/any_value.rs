//! What every block answers where a pin has any value of its type.

use isochrone_blocks::{BlockType, CATALOGUE, Cycle, PinType, status};

const PERIOD_NS: u64 = 1_000_000;
/// Cycles that DeadTime keeps its samples for at most.
const LONGEST_WINDOW: usize = 1024;

/// The extremes of a type, and what is no number or out of every range.
fn extremes(of: PinType) -> &'static [f64] {
    match of {
        PinType::Lreal => &[
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            f64::MIN,
            f64::MIN_POSITIVE,
            -1.0,
            -0.0,
            0.0,
        ],
        PinType::Int => &[-32_768.0, -1.0, 0.0, 32_767.0],
        PinType::Time => &[-2_147_483_648.0, -1.0, 0.0, 2_147_483_647.0],
        PinType::Word => &[0.0, 65_535.0],
        PinType::Bool => &[0.0, 1.0],
    }
}

/// An instance and how far it has come.
struct Instance {
    block: &'static BlockType,
    slots: Vec<f64>,
    words: Vec<u64>,
    cycle: u64,
}

impl Instance {
    fn at_work(block: &'static BlockType) -> Self {
        let mut slots = vec![0.0; block.slots()];
        block.typical_inputs(&mut slots[..block.inputs.len()]);
        Self { block, slots, words: vec![0; block.state_words], cycle: 0 }
    }

    fn step(&mut self) {
        let cycle = Cycle::new(self.cycle, PERIOD_NS, &[]);
        self.block.step_bank(&mut self.slots, &mut self.words, &cycle);
        self.cycle += 1;
    }

    fn output(&self, name: &str) -> Option<f64> {
        let place = self.block.outputs.iter().position(|pin| pin.name == name)?;
        Some(self.slots[self.block.inputs.len() + place])
    }

    /// Fails where an output is no value of its type, or a status word is not of the catalogue.
    fn assert_defined(&self, why: &str) {
        for pin in self.block.outputs {
            let value = self.output(pin.name).unwrap();
            let is_defined = pin.pin_type.holds(value) && !value.is_nan();
            assert!(is_defined, "{why}: {} is {value:?}", pin.name);
        }
        if let Some(word) = self.output("status") {
            let is_known = self.block.status.iter().any(|known| f64::from(known.code) == word);
            assert!(is_known, "{why}: status 16#{:04X} is not in the catalogue", word as u16);
            let is_error = self.output("error").map(|error| error != 0.0);
            let of_word = status::is_error(word as u16);
            assert!(
                is_error.is_none_or(|error| error == of_word),
                "{why}: error and status differ"
            );
        }
    }
}

#[test]
fn whatever_two_pins_have_the_outputs_are_values_the_status_is_in_the_catalogue_and_no_error_stays()
{
    let mut looks = 0;
    for block in CATALOGUE {
        let pins = || block.inputs.iter().enumerate();
        for (first, pin) in pins() {
            for (second, other) in pins() {
                for (value, beside) in extremes(pin.pin_type)
                    .iter()
                    .flat_map(|value| extremes(other.pin_type).iter().map(move |it| (*value, *it)))
                {
                    let mut instance = Instance::at_work(block);
                    instance.step();
                    instance.slots[first] = value;
                    instance.slots[second] = beside;
                    let why = format!(
                        "{} with {} {value:?}, {} {beside:?}",
                        block.name, pin.name, other.name
                    );
                    for _ in 0..3 {
                        instance.step();
                        instance.assert_defined(&why);
                        looks += 1;
                    }
                    // What was wrong leaves no error behind, once no window has it any more.
                    instance.block.typical_inputs(&mut instance.slots[..block.inputs.len()]);
                    let is_over = (0..LONGEST_WINDOW).any(|_| {
                        instance.step();
                        !status::is_error(instance.output("status").unwrap_or_default() as u16)
                    });
                    assert!(is_over, "{why}, then good values: an error stays");
                }
            }
        }
    }
    assert!(looks > 10_000, "{looks}");
}

//! A block as a program runs it.

use crate::expr::Program;
use crate::formulas::{self, OutputProgram};
use crate::stepping::{StepBank, StepShared, state_words, step_bank, step_shared};
use crate::well_formed::assert_well_formed;
use crate::{Block, Caution, Cycle, Decision, Indication, Pin, Slots, StatusWord, Words, status};

/// A block type with its Rust type erased: what plan and engine work with.
///
/// An instance owns [`slots`](Self::slots) consecutive slots of the process image, its inputs then
/// its outputs, and [`state_words`](Self::state_words) words of private state.
#[derive(Clone, Copy, Debug)]
pub struct BlockType {
    /// Name in a configuration.
    pub name: &'static str,
    doc: &'static str,
    /// The document that it follows; `None` for a block that follows none.
    pub follows: Option<&'static str>,
    /// Input pins in the order of their slots.
    pub inputs: &'static [Pin],
    /// Output pins in the order of their slots, which follow the inputs.
    pub outputs: &'static [Pin],
    /// How it computes its outputs, in sentences.
    pub computes: &'static [&'static str],
    /// Status words.
    pub status: &'static [StatusWord],
    /// What was chosen where the document that it follows is silent.
    pub decisions: &'static [Decision],
    /// Words of private state of an instance, at least 1. All zero is the initial state.
    pub state_words: usize,
    /// What people should know while [`needs_caution`](Self::needs_caution) says so.
    pub caution: Option<&'static Caution>,
    is_of_library: bool,
    kind: Kind,
    typical: fn(&mut [f64]),
    needs_caution: fn(&[f64]) -> bool,
    change_period: fn(&mut [u64], u64, [u64; 2]),
}

/// What a block type is for, and how it steps.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// A block of a catalogue.
    Declared(StepBank, Option<StepShared>),
    /// [`ALARM`](crate::ALARM).
    Alarm(StepBank),
    /// An alarm with this condition.
    Condition(&'static Program, StepConditions),
    /// An `Expr` with these outputs.
    Formulas(&'static [OutputProgram]),
}

pub(crate) type StepConditions = fn(usize, &Program, &mut [f64], &mut [u64], &Cycle<'_>);

impl BlockType {
    /// Whether both have the same name, pins and state, so that one can take over the other's state.
    pub fn has_layout_of(&self, other: &Self) -> bool {
        let pins =
            |of: &Self| of.inputs.iter().chain(of.outputs).map(|pin| (pin.name, pin.pin_type));
        (self.name, self.state_words, self.inputs.len())
            == (other.name, other.state_words, other.inputs.len())
            && pins(self).eq(pins(other))
    }

    /// Erases the type of a block.
    ///
    /// Does not compile for a block that declares a status word from `16#8000` on and has no output
    /// `status` to report it with, or that has no pin, two pins of one name, a pin whose name is not a
    /// letter or `_` and then letters, digits and `_`, an output `status` that is no `u16`, or a
    /// `latched_by` that names no BOOL input:
    ///
    /// ```compile_fail,E0080
    /// isochrone_blocks::block! {
    ///     /// An output with the name of the input.
    ///     Twice {
    ///         inputs {
    ///             /// Signal.
    ///             "x" => x: f64 = 0.0,
    ///         }
    ///         outputs {
    ///             /// Twice the signal.
    ///             "x" => y: f64,
    ///         }
    ///     }
    /// }
    /// # impl isochrone_blocks::Block for Twice {
    /// #     fn step(_: &mut State, inputs: &Inputs, _: &isochrone_blocks::Cycle<'_>) -> Outputs {
    /// #         Outputs { y: 2.0 * inputs.x }
    /// #     }
    /// # }
    /// # fn main() {
    /// let twice = isochrone_blocks::BlockType::of::<Twice>();
    /// # }
    /// ```
    pub const fn of<B: Block>() -> Self {
        const { assert_well_formed(B::INPUTS, B::OUTPUTS) }
        const { assert_slots_are_pins::<B>() }
        const { assert_errors_are_reported(B::STATUS, B::OUTPUTS) }
        Self {
            name: B::NAME,
            doc: B::DOC,
            follows: B::FOLLOWS,
            inputs: B::INPUTS,
            outputs: B::OUTPUTS,
            computes: B::COMPUTES,
            status: B::STATUS,
            decisions: B::DECISIONS,
            state_words: state_words::<B>(),
            caution: B::CAUTION,
            is_of_library: false,
            kind: Kind::Declared(step_bank::<B>, step_shared::<B>()),
            typical: typical::<B>,
            needs_caution: needs_caution::<B>,
            change_period: change_period::<B>,
        }
    }

    /// A block of this library, which can be stepped with whatever stands at its pins.
    pub(crate) const fn of_library<B: Block>() -> Self {
        Self { is_of_library: true, ..Self::of::<B>() }
    }

    /// The block of [`ALARM`](crate::ALARM).
    pub(crate) const fn of_alarm<B: Block>() -> Self {
        Self { kind: Kind::Alarm(step_bank::<B>), ..Self::of_library::<B>() }
    }

    /// An `Expr`: `inputs` are what its formulas read, one after the other, each under the name of the output that it
    /// is read for; `outputs` are those of the formulas, and then [`STATUS`](crate::formulas::STATUS).
    pub const fn of_formulas(
        inputs: &'static [Pin],
        outputs: &'static [Pin],
        formulas: &'static [OutputProgram],
    ) -> Self {
        Self {
            name: "Expr",
            doc: formulas::DOC,
            follows: Some("structured text, IEC 61131-3"),
            inputs,
            outputs,
            computes: formulas::COMPUTES,
            status: formulas::WORDS,
            decisions: formulas::DECISIONS,
            state_words: outputs.len(),
            caution: None,
            is_of_library: true,
            kind: Kind::Formulas(formulas),
            typical: |_| {},
            needs_caution: |_| false,
            change_period: |_, _, _| {},
        }
    }

    /// The same alarm with other inputs, of which a condition is computed.
    pub(crate) fn with_condition(
        self,
        inputs: &'static [Pin],
        condition: &'static Program,
        step: StepConditions,
    ) -> Self {
        Self { inputs, kind: Kind::Condition(condition, step), ..self }
    }

    /// Whether it is what an `[[alarm]]` is made of.
    pub const fn is_alarm(&self) -> bool {
        matches!(self.kind, Kind::Alarm(_) | Kind::Condition(..))
    }

    /// Whether its instances read what they compare where it stands: it is [`ALARM`](crate::ALARM).
    pub const fn reads_in_place(&self) -> bool {
        matches!(self.kind, Kind::Alarm(_))
    }

    /// The expressions of an `Expr`, one for each of its outputs but the last, which is `status`; `None` for any other
    /// type.
    pub const fn formulas(&self) -> Option<&'static [OutputProgram]> {
        match self.kind {
            Kind::Formulas(formulas) => Some(formulas),
            Kind::Declared(..) | Kind::Alarm(_) | Kind::Condition(..) => None,
        }
    }

    /// The same for two types only if they are one, whose instances step together: types of one's own may be named as
    /// others are.
    pub fn id(&self) -> (&'static str, usize) {
        let of_kind = match self.kind {
            Kind::Declared(..) => 0,
            Kind::Alarm(_) => 1,
            Kind::Formulas(formulas) => formulas.as_ptr().addr(),
            Kind::Condition(program, _) => core::ptr::from_ref(program).addr(),
        };
        (self.name, of_kind)
    }

    /// The input pins that are signals: none of an alarm or an `Expr`, which read others by their names.
    pub const fn parameters(&self) -> &'static [Pin] {
        match self.kind {
            Kind::Declared(..) => self.inputs,
            Kind::Alarm(_) | Kind::Condition(..) | Kind::Formulas(_) => &[],
        }
    }

    /// The pins that are signals of an instance, each with its place among the slots.
    pub fn signals(&self) -> impl Iterator<Item = (usize, &'static Pin)> + Clone {
        let pins = self.inputs.iter().chain(self.outputs).enumerate();
        pins.skip(self.inputs.len() - self.parameters().len())
    }

    /// What it computes, in a sentence or two.
    pub fn doc(&self) -> &'static str {
        self.doc.trim_ascii()
    }

    /// Whether it comes from [`CATALOGUE`](crate::CATALOGUE). Such a block neither panics nor hangs,
    /// whatever stands at its pins, so constants can be tried out on it before a node runs. Blocks from
    /// elsewhere are stepped only by a running node, a simulation or a bench.
    pub const fn is_of_library(&self) -> bool {
        self.is_of_library
    }

    /// Slots of one instance.
    pub const fn slots(&self) -> usize {
        self.inputs.len() + self.outputs.len()
    }

    /// Writes [`Block::typical`] to the slots of an instance's inputs.
    pub fn typical_inputs(&self, slots: &mut [f64]) {
        (self.typical)(slots);
    }

    /// The output by which an instance says that something is wrong, which is what
    /// [`step_bank`](Self::step_bank) counts, with its place among the slots of the instance; `None`
    /// if it never does.
    pub const fn indication(&self) -> Option<Indication> {
        match Indication::among(self.outputs) {
            Some(Indication::Status(output)) => {
                Some(Indication::Status(self.inputs.len() + output))
            }
            Some(Indication::Error(output)) => Some(Indication::Error(self.inputs.len() + output)),
            None => None,
        }
    }

    /// Whether an instance, seen by its slots after a step, is in the state that [`caution`](Self::caution)
    /// tells of.
    #[inline]
    pub fn needs_caution(&self, slots: &[f64]) -> bool {
        self.caution.is_some() && (self.needs_caution)(slots)
    }

    /// Tells an instance, by its words, that from the cycle behind this one on its task has another period.
    pub fn change_period(&self, state: &mut [u64], cycle: u64, old_and_new_ns: [u64; 2]) {
        (self.change_period)(state, cycle, old_and_new_ns);
    }

    /// The loop for instances that share all inputs but the first, if the type has one.
    pub const fn step_shared(&self) -> Option<StepShared> {
        match self.kind {
            Kind::Declared(_, step) => step,
            Kind::Alarm(_) | Kind::Condition(..) | Kind::Formulas(_) => None,
        }
    }

    /// Steps every instance of a bank once and returns how many reported an error.
    ///
    /// `image` holds the instances' slots one after the other, `state` their words.
    #[inline]
    pub fn step_bank(&self, image: &mut [f64], state: &mut [u64], cycle: &Cycle<'_>) -> u64 {
        match self.kind {
            Kind::Declared(step, _) | Kind::Alarm(step) => step(image, state, cycle),
            Kind::Formulas(formulas) => {
                let pins = [self.inputs.len(), self.outputs.len()];
                formulas::step_bank(pins, formulas, image, state)
            }
            Kind::Condition(program, step) => {
                step(self.inputs.len(), program, image, state, cycle);
                0
            }
        }
    }
}

const fn assert_slots_are_pins<B: Block>() {
    assert!(
        B::Inputs::LEN == B::INPUTS.len() && B::Outputs::LEN == B::OUTPUTS.len(),
        "`Slots::LEN` must be the number of pins of its direction"
    );
}

const fn assert_errors_are_reported(words: &[StatusWord], outputs: &[Pin]) {
    let has_status = matches!(Indication::among(outputs), Some(Indication::Status(_)));
    let mut word = 0;
    while word < words.len() {
        assert!(
            has_status || !status::is_error(words[word].code),
            "a block that declares an error needs the output `\"status\" => status: u16` to report it"
        );
        word += 1;
    }
}

fn typical<B: Block>(slots: &mut [f64]) {
    B::typical().write(slots);
}

fn needs_caution<B: Block>(slots: &[f64]) -> bool {
    let pins = slots.split_at_checked(B::Inputs::LEN);
    pins.is_some_and(|(inputs, outputs)| {
        let outputs = B::Outputs::read(outputs);
        !B::is_error(&outputs) && B::needs_caution(&B::Inputs::read(inputs), &outputs)
    })
}

fn change_period<B: Block>(words: &mut [u64], cycle: u64, old_and_new_ns: [u64; 2]) {
    let mut state = B::State::read(words);
    B::change_period(&mut state, cycle, old_and_new_ns);
    state.write(words);
}

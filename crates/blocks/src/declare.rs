//! The declaration of a block's pins, from which everything else is derived.

/// Declares a block: its pins, its private state and its status words.
///
/// Makes a unit struct with the block's name, the structs `Inputs`, `Outputs` and `State`, and the
/// [`Declaration`](crate::Declaration) that ties them together. What remains to be written is
/// [`Block::step`](crate::Block::step). One block to a module, since those names are fixed.
///
/// A pin is `"name" => field: type` with an optional `[unit]` and, for inputs, `= default`; an
/// input without a default must be connected. Before a pin may stand `#[alias = "Ret_Val"]`, another name that documents have for it, and before an input
/// `#[latched_by = "reset"]`: it is read in the first call and while that input is TRUE.
///
/// The struct's name is that of the type in a configuration, unless another stands behind it: `pub RTrig as "R_TRIG"`.
/// A name is a letter or `_`, then letters, digits and `_`, and no two pins of a block have the same.
///
/// | type | in a configuration | holds |
/// |---|---|---|
/// | `f64` | LREAL | any floating-point number |
/// | `i16` | INT | -32768 to 32767 |
/// | `i32` | TIME | milliseconds, -2147483648 to 2147483647 |
/// | `bool` | BOOL | FALSE, TRUE |
/// | `u16` | WORD | 0 to 65535 |
/// | [`Ob`](crate::Ob) | INT | the number of an organization block, at `callOB` |
///
/// State is made of fields of the types `f64`, `u64`, `u16`, `i16`, `i32` and `bool` and of arrays of them, such as
/// `[f64; 16]` for a delay. Before the first call, all of it is zero. Every step copies the state; what is long, such
/// as the samples of a dead time, stands in the `buffer` instead, which a step changes in place
/// ([`Block::step_buffered`](crate::Block::step_buffered)).
///
/// A status word is `code => "NAME": "meaning"`, with `(ours)` behind a name that the document which
/// the block follows does not have. A block that declares a word from `16#8000` on, an error, has an
/// output `"status" => status: u16`; what it reports there is what a node counts as errors.
///
/// Sections stand in this order, and only `inputs` and `outputs` are needed: `follows`, the document
/// that the block follows; `inputs`; `outputs`; `state`; `buffer`, a number of words; `computes`, sentences on how; `status`;
/// `decisions`, a [`Decision`](crate::Decision) for each point on which the document is silent.
///
/// ```
/// isochrone_blocks::block! {
///     /// Moving average over two cycles.
///     pub Average2 {
///         inputs {
///             /// Signal to smooth.
///             "x" => x: f64 = 0.0,
///         }
///         outputs {
///             /// Mean of this cycle's and the last cycle's `x`.
///             "y" => y: f64,
///         }
///         state { last: f64 }
///     }
/// }
///
/// impl isochrone_blocks::Block for Average2 {
///     fn step(state: &mut State, inputs: &Inputs, _: &isochrone_blocks::Cycle<'_>) -> Outputs {
///         let y = 0.5 * (state.last + inputs.x);
///         state.last = inputs.x;
///         Outputs { y }
///     }
/// }
/// # fn main() {}
/// ```
#[macro_export]
macro_rules! block {
    (
        $(#[doc = $doc:literal])+
        $vis:vis $Block:ident $(as $type_name:literal)? {
            $(follows { $document:literal })?
            inputs { $(
                $(#[doc = $in_doc:literal])+
                $(#[alias = $in_alias:literal])*
                $(#[latched_by = $latch:literal])?
                $in_name:literal => $in:ident: $in_type:ident $([$in_unit:literal])? $(= $default:expr)?
            ),* $(,)? }
            outputs { $(
                $(#[doc = $out_doc:literal])+
                $(#[alias = $out_alias:literal])*
                $out_name:literal => $out:ident: $out_type:ident $([$out_unit:literal])?
            ),* $(,)? }
            $(state { $($(#[$word_attr:meta])* $word:ident: $word_type:ty),* $(,)? })?
            $(buffer { $buffer:expr })?
            $(computes { $($sentence:literal),* $(,)? })?
            $(status { $($code:expr => $word_name:literal $(($ours:ident))? : $meaning:expr),* $(,)? })?
            $(decisions { $($decision:expr),* $(,)? })?
        }
    ) => {
        $(#[doc = $doc])+
        #[derive(Clone, Copy, Debug)]
        $vis struct $Block;

        /// Input pins.
        #[derive(Clone, Copy, Debug, PartialEq)]
        $vis struct Inputs { $($(#[doc = $in_doc])+ pub $in: $crate::block!(@type $in_type)),* }

        impl Default for Inputs {
            /// What the pins hold when nothing is connected.
            fn default() -> Self {
                Self { $($in: $crate::block!(@default $($default)?)),* }
            }
        }

        /// Output pins.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        $vis struct Outputs { $($(#[doc = $out_doc])+ pub $out: $crate::block!(@type $out_type)),* }

        /// Private state; the default is the state before the first call.
        #[derive(Clone, Copy, Debug, PartialEq)]
        $vis struct State { $($($(#[$word_attr])* $word: $word_type),*)? }

        impl Default for State {
            /// All zero.
            fn default() -> Self {
                <Self as $crate::Words>::read(&[])
            }
        }

        $crate::block!(@slots Inputs { $($in)* });
        $crate::block!(@slots Outputs { $($out)* });

        impl $crate::Words for State {
            const LEN: usize = 0 $($(+ <$word_type as $crate::StateField>::WORDS)*)?;
            #[inline(always)]
            fn read(words: &[u64]) -> Self {
                let mut words = words.iter();
                let _ = &mut words;
                Self { $($($word: $crate::StateField::take(&mut words)),*)? }
            }
            #[inline(always)]
            fn write(self, words: &mut [u64]) {
                let mut words = words.iter_mut();
                let _ = &mut words;
                $($($crate::StateField::put(self.$word, &mut words);)*)?
            }
        }

        impl $crate::Declaration for $Block {
            type Inputs = Inputs;
            type Outputs = Outputs;
            type State = State;
            $(const BUFFER: usize = $buffer;)?
            const NAME: &'static str = $crate::block!(@name $Block $($type_name)?);
            const DOC: &'static str = concat!($($doc),+);
            const FOLLOWS: Option<&'static str> = $crate::block!(@option $($document)?);
            const INPUTS: &'static [$crate::Pin] = &[$($crate::Pin {
                name: $in_name,
                pin_type: <$crate::block!(@type $in_type) as $crate::PinValue>::TYPE,
                unit: concat!($($in_unit)?),
                default: $crate::block!(@pin_default $in_type $($default)?),
                names_task: <$crate::block!(@type $in_type) as $crate::PinValue>::NAMES_TASK,
                aliases: &[$($in_alias),*],
                latched_by: $crate::block!(@option $($latch)?),
                raw_doc: concat!($($in_doc),+),
            }),*];
            const OUTPUTS: &'static [$crate::Pin] = &[$($crate::Pin {
                name: $out_name,
                pin_type: <$crate::block!(@type $out_type) as $crate::PinValue>::TYPE,
                unit: concat!($($out_unit)?),
                default: $crate::PinDefault::Required,
                names_task: false,
                aliases: &[$($out_alias),*],
                latched_by: None,
                raw_doc: concat!($($out_doc),+),
            }),*];
            const COMPUTES: &'static [&'static str] = &[$($($sentence),*)?];
            const STATUS: &'static [$crate::StatusWord] = &[$($($crate::StatusWord {
                code: $code,
                name: $word_name,
                origin: $crate::block!(@origin $($ours)?),
                meaning: $meaning,
            }),*)?];
            const DECISIONS: &'static [$crate::Decision] = &[$($($decision),*)?];

            #[inline]
            fn is_error(outputs: &Outputs) -> bool {
                const INDICATION: Option<$crate::Indication> =
                    $crate::Indication::among(<$Block as $crate::Declaration>::OUTPUTS);
                let Some(indication) = INDICATION else { return false };
                let slots = [$($crate::PinValue::into_slot(outputs.$out)),*];
                indication.is_error(slots[indication.place()])
            }
        }
    };

    (@first $pins:ident $slot:ident) => { let _ = $slot; };
    (@first $pins:ident $slot:ident $first:ident $($pin:ident)*) => {
        $pins.$first = $crate::PinValue::from_slot($slot);
    };

    (@slots $Pins:ident { $($pin:ident)* }) => {
        impl $crate::Slots for $Pins {
            const LEN: usize = <[&str]>::len(&[$(stringify!($pin)),*]);
            #[inline]
            fn read(slots: &[f64]) -> Self {
                let mut slots = slots.iter();
                let _ = &mut slots;
                Self { $($pin: $crate::PinValue::from_slot(slots.next().copied().unwrap_or_default())),* }
            }
            #[inline]
            fn set_first(&mut self, slot: f64) {
                $crate::block!(@first self slot $($pin)*);
            }
            #[inline]
            fn write(self, slots: &mut [f64]) {
                for (slot, value) in slots.iter_mut().zip([$($crate::PinValue::into_slot(self.$pin)),*]) {
                    *slot = value;
                }
            }
        }
    };

    (@name $Block:ident) => { stringify!($Block) };
    (@name $Block:ident $type_name:literal) => { $type_name };

    (@type Ob) => { $crate::Ob };
    (@type $type:ident) => { $type };

    (@origin) => { $crate::Origin::Document };
    (@origin ours) => { $crate::Origin::Ours };

    (@option) => { None };
    (@option $value:literal) => { Some($value) };

    (@default) => { Default::default() };
    (@default $default:expr) => { $default };

    // Traits cannot convert in a constant yet, so the types are told apart by name.
    (@pin_default $type:ident) => { $crate::PinDefault::Required };
    (@pin_default f64 $default:expr) => { $crate::PinDefault::Value($default) };
    (@pin_default bool $default:expr) => { $crate::PinDefault::Value($default as u8 as f64) };
    (@pin_default Ob $default:expr) => { $crate::PinDefault::of_ob($default) };
    (@pin_default $type:ident $default:expr) => { $crate::PinDefault::Value($default as $type as f64) };
}

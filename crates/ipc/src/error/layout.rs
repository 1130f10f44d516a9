//! What can be wrong with the layout of frames, or with how it was announced.

use thiserror::Error;

/// Why a [`FrameLayout`](crate::FrameLayout) cannot be announced.
#[derive(Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LayoutError {
    /// The layout has no signal.
    #[error("the frame has no signal; give it at least one")]
    Empty,
    /// A signal's name, type or unit has a control character.
    #[error(
        "channel {channel}: {word:?} cannot be announced; a name has no control characters, which could do anything to a terminal"
    )]
    Word {
        /// Index of the signal.
        channel: usize,
        /// Its name, type or unit.
        word: String,
    },
    /// Two signals have the same name, so a reader that asks for it would get either.
    #[error("channels {first} and {channel} are both called {name:?}; give each a name of its own")]
    Duplicate {
        /// Index of the first signal with that name.
        first: usize,
        /// Index of the second.
        channel: usize,
        /// The name.
        name: String,
    },
    /// The layout has more signals than the 65,536 that a frame can have.
    #[error("there are {signals} signals; a frame has at most 65536")]
    TooMany {
        /// Number of signals.
        signals: usize,
    },
    /// A signal's name, type or unit is longer than 255 bytes.
    #[error("channel {channel}: a name, type or unit of {bytes} bytes; at most 255 are possible")]
    LongWord {
        /// Index of the signal.
        channel: usize,
        /// Length of the word.
        bytes: usize,
    },
}

/// Why a message on a layout service is not a valid [`Announcement`](crate::Announcement).
#[derive(Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum AnnouncementError {
    /// It is not JSON of this form.
    #[error("it is not the JSON of a layout: {cause}")]
    Json {
        /// Where and why.
        cause: String,
    },
    /// It is longer than the longest layout.
    #[error("it has {bytes} bytes, which is more than any layout needs")]
    TooLong {
        /// Length of the message.
        bytes: usize,
    },
    /// It describes a layout that is not valid.
    #[error(transparent)]
    Layout(LayoutError),
    /// `layout` is not a number of 16 hexadecimal digits, or is 0.
    #[error("its \"layout\" is {text:?}; 16 hexadecimal digits that are not all 0 are needed")]
    Number {
        /// The value of `layout`.
        text: String,
    },
}

/// Why a reader cannot find a value in a frame, see [`FrameLayout::find`](crate::FrameLayout::find) and
/// [`check_channel`](crate::FrameLayout::check_channel).
#[derive(Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LayoutConflict {
    /// The frames have too few channels.
    #[error("its frames have {available} channel{}, {needed} {} needed", plural(*available), is_or_are(*needed))]
    TooFewChannels {
        /// Channels of the frames.
        available: usize,
        /// Channels that are needed.
        needed: usize,
    },
    /// No channel has the name.
    #[error("its frames have no signal {needed:?}; there is: {available}")]
    NoSignal {
        /// The name that is needed.
        needed: String,
        /// The names of the frame's signals.
        available: String,
    },
    /// A channel carries another type.
    #[error(
        "channel {channel} ({name}) carries {available}, {needed} is needed{}",
        type_remedy(available, needed)
    )]
    ValueType {
        /// Index of the channel.
        channel: usize,
        /// The signal's name, or `-` if it has none.
        name: String,
        /// Type that the frame carries.
        available: String,
        /// Type that is needed.
        needed: String,
    },
}
fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

fn is_or_are(count: usize) -> &'static str {
    if count == 1 { "is" } else { "are" }
}

/// What an input of a configuration says where a writer's INT should feed an LREAL: only a wire
/// converts.
fn type_remedy(available: &str, needed: &str) -> &'static str {
    if (available, needed) == ("INT", "LREAL") {
        "; write type = \"INT\" at the input: a wire from it feeds LREAL pins all the same"
    } else {
        ""
    }
}

isochrone_model::debug_as_display!(LayoutError, AnnouncementError, LayoutConflict);

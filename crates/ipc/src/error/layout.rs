//! Errors of layouts and their announcements.

use thiserror::Error;

/// Why a [`FrameLayout`](crate::FrameLayout) cannot be announced: the channel, and what is wrong with it.
#[derive(Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct LayoutError(pub(crate) String);

/// Why a message on a layout service is not a valid [`Announcement`](crate::Announcement).
#[derive(Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct AnnouncementError(pub(crate) String);

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

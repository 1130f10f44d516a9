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
/// [`check_channel`](crate::FrameLayout::check_channel): what the frames carry, and what is needed.
#[derive(Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct LayoutConflict(pub(crate) String);

isochrone_model::debug_as_display!(LayoutError, AnnouncementError, LayoutConflict);

//! Where a reader learns what is announced of a service's frames.

use crate::{Announcement, LayoutWatcher, ParticipantRef, Service, ToldLayouts};

#[derive(Debug)]
pub(crate) enum LayoutSource<'p, S: Service> {
    /// From a port of its own, in an ordinary thread, which also makes good failed connections.
    Heard { participant: ParticipantRef<'p, S>, watcher: LayoutWatcher<S> },
    /// From another thread, which does both.
    Told(ToldLayouts),
}

impl<S: Service> LayoutSource<'_, S> {
    /// Takes the announcements since the last call; returns whether there is a new one.
    pub(crate) fn look(&mut self) -> bool {
        match self {
            Self::Heard { participant, watcher } => {
                participant.tend();
                watcher.look(participant)
            }
            Self::Told(told) => told.look(),
        }
    }

    /// The announcement of the frames with this number.
    pub(crate) fn find(&self, number: u64) -> Option<&Announcement> {
        match self {
            Self::Heard { watcher, .. } => watcher.find(number),
            Self::Told(told) => {
                let found = told.known().iter().rfind(|known| known.number == number);
                found.map(AsRef::as_ref)
            }
        }
    }

    /// What was announced last.
    pub(crate) fn newest(&self) -> Option<&Announcement> {
        match self {
            Self::Heard { watcher, .. } => watcher.newest(),
            Self::Told(told) => told.known().last().map(AsRef::as_ref),
        }
    }

    /// What keeps the reader from hearing announcements, and the way out, if it is known here.
    pub(crate) fn obstacle(&self) -> Option<String> {
        match self {
            Self::Heard { watcher, .. } => watcher.obstacle(),
            Self::Told(_) => None,
        }
    }
}

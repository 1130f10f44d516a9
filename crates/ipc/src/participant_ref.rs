//! The participant of a port that needs it for as long as it lives.

use std::ops::Deref;
use std::sync::Arc;

use crate::{Participant, Service};

/// A participant that somebody else keeps, or shares: [`SignalReader::open`](crate::SignalReader::open) takes a
/// reference or an [`Arc`].
#[derive(Debug)]
pub struct ParticipantRef<'p, S: Service>(Kept<'p, S>);

#[derive(Debug)]
enum Kept<'p, S: Service> {
    Elsewhere(&'p Participant<S>),
    Here(Arc<Participant<S>>),
}

impl<S: Service> Deref for ParticipantRef<'_, S> {
    type Target = Participant<S>;

    fn deref(&self) -> &Participant<S> {
        match &self.0 {
            Kept::Elsewhere(participant) => participant,
            Kept::Here(participant) => participant,
        }
    }
}

impl<'p, S: Service> From<&'p Participant<S>> for ParticipantRef<'p, S> {
    fn from(participant: &'p Participant<S>) -> Self {
        Self(Kept::Elsewhere(participant))
    }
}

impl<S: Service> From<Arc<Participant<S>>> for ParticipantRef<'_, S> {
    fn from(participant: Arc<Participant<S>>) -> Self {
        Self(Kept::Here(participant))
    }
}

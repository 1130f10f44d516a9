//! Errors of domains and of joining them.

use std::fmt::Display;

use thiserror::Error;

/// Most bytes of root path and prefix. iceoryx2's paths end at 255, and its own names take the rest;
/// it panics beyond.
pub(crate) const MAX_DOMAIN_BYTES: usize = 120;

/// Why a [`Domain`](crate::Domain) cannot be used: the file and the place in it, what is wrong there, and what to do.
#[derive(Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct DomainError(String);

impl DomainError {
    pub(crate) fn new(sentence: String) -> Self {
        Self(sentence)
    }

    /// What is wrong with a configuration file as a whole.
    pub(crate) fn of_file(path: &str, what: &str) -> Self {
        Self(format!("iceoryx2 configuration {path}: {what}"))
    }

    /// What is wrong at a line and a column of it, both from 1.
    pub(crate) fn at(path: &str, (line, column): (usize, usize), what: &str) -> Self {
        Self(format!("iceoryx2 configuration {path}:{line}:{column}: {what}"))
    }
}

/// Why [`Participant::join`](crate::Participant::join) failed: the domain or the name, what is wrong with it, and what
/// to do.
#[derive(Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct JoinError(String);

impl JoinError {
    pub(crate) fn of_name(name: &str) -> Self {
        Self(format!("node name {name:?}: iceoryx2 takes at most 128 ASCII characters"))
    }

    /// The obstacle to joining the domain of this root path and prefix.
    pub(crate) fn of_domain(domain: &str, cause: impl Display) -> Self {
        Self(format!("cannot join the iceoryx2 domain {domain}: {cause}"))
    }
}

isochrone_model::debug_as_display!(DomainError, JoinError);

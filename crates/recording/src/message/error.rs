//! What is wrong with a definition.

/// Why a message type cannot be used: the definition, its line, what is wrong and what would be right.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", isochrone_model::escaped(_0))]
pub struct DefinitionError(pub(crate) String);

isochrone_model::debug_as_display!(DefinitionError);

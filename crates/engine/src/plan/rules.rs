//! The rules that a configuration is checked against.

use isochrone_blocks::{BlockType, CATALOGUE};

/// What a configuration is checked against beside itself.
pub struct Rules<'a> {
    /// The block types that it may name.
    pub catalogue: &'a [BlockType],
    /// Whether the transport can carry a service of this name; `Err` says why not.
    pub service_name: fn(&str) -> Result<(), String>,
}

impl Default for Rules<'_> {
    /// The library's blocks, and any service name that is not empty.
    fn default() -> Self {
        Self {
            catalogue: CATALOGUE,
            service_name: |name| match name {
                "" => Err("it is empty".into()),
                _ => Ok(()),
            },
        }
    }
}

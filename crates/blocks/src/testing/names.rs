//! Pins with their values, for messages.

use core::fmt;

use crate::Pin;

/// `x = NaN, gain = 2.0`.
pub(super) struct Named<'a>(pub(super) &'a [Pin], pub(super) &'a [f64]);

impl fmt::Display for Named<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (pin, slot)) in self.0.iter().zip(self.1).enumerate() {
            let separator = if index == 0 { "" } else { ", " };
            write!(f, "{separator}{} = {slot:?}", pin.name)?;
        }
        Ok(())
    }
}

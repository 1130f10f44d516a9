//! Who looks on while a bench runs.

use std::time::Duration;

use isochrone_timing::{Distribution, Warning};

/// Who looks on while a bench runs.
pub trait Onlooker: Sync {
    /// A bench, or a part of it, begins that takes `total`, with these arms.
    fn begin(&self, total: Duration, arms: &[&str]) -> Box<dyn View>;

    /// Something came up that makes results doubtful. It is in the report as well.
    fn warn(&self, _warning: &Warning) {}
}

/// What an onlooker sees, until it is dropped.
pub trait View {
    /// It takes another time in all than was thought.
    fn expect(&self, _total: Duration) {}

    /// How much of the time has passed.
    fn pass(&self, _elapsed: Duration) {}

    /// A line about the arm in this place, made only where somebody can see it.
    fn say(&self, _arm: usize, _so_far: &dyn Fn() -> String) {}

    /// What an arm has measured so far.
    fn show(&self, arm: usize, so_far: &Distribution) {
        self.say(arm, &|| so_far.summary().to_string());
    }
}

/// Nobody looks on.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoView;

impl View for NoView {}

impl Onlooker for NoView {
    fn begin(&self, _: Duration, _: &[&str]) -> Box<dyn View> {
        Box::new(Self)
    }
}

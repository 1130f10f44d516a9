//! The action of a task after missed releases.

/// The action of a task after missed releases.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Overrun {
    /// Skip them and go on with the release that is current: the grid is kept, inputs are fresh.
    #[default]
    Skip,
    /// Run them late, back to back, a few in a row at most; then skip.
    CatchUp,
    /// End the loop after the cycle that came late, so that its frame tells of it.
    Stop,
}

impl Overrun {
    /// Every policy.
    pub const ALL: [Self; 3] = [Self::Skip, Self::CatchUp, Self::Stop];

    /// The word in configurations: `skip`, `catch_up` or `stop`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Skip => "skip",
            Self::CatchUp => "catch_up",
            Self::Stop => "stop",
        }
    }
}

/// Missed releases that are too many: the node stops, as a PLC does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissLimit {
    /// This many missed releases, 1 to 1000 ...
    pub misses: u32,
    /// ... within this many cycles of the grid.
    pub cycles: u64,
}

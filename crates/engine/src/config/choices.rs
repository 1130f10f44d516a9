//! Values that are one of a few words, or a word with a number.

/// The CPU of a task's thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cpu {
    /// The best CPU at the time that the node starts.
    Auto {
        /// That CPU, once it is known.
        chosen: Option<u32>,
    },
    /// Any CPU; the kernel may move the thread.
    Any,
    /// This CPU.
    Number(u32),
}

impl Cpu {
    /// The choices that are written as a word.
    pub const WORDS: [Self; 2] = [Self::Auto { chosen: None }, Self::Any];

    /// The word that it is written as; `number` for a number.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Auto { .. } => "auto",
            Self::Any => "any",
            Self::Number(_) => "number",
        }
    }

    /// Whether it is chosen when the node starts.
    pub const fn is_auto(self) -> bool {
        matches!(self, Self::Auto { .. })
    }

    /// The CPU, if the configuration names it or it is chosen.
    pub const fn number(self) -> Option<u32> {
        match self {
            Self::Number(cpu) => Some(cpu),
            Self::Auto { chosen } => chosen,
            Self::Any => None,
        }
    }
}

impl std::fmt::Display for Cpu {
    /// The choice in the configuration, whatever CPU was chosen.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(cpu) => cpu.fmt(f),
            word => f.write_str(word.as_str()),
        }
    }
}

/// The value of a stale input.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum OnStale {
    /// The last value.
    #[default]
    Hold,
    /// The default.
    Default,
    /// The default, approached at this rate in units per second; and at the same rate it comes back
    /// to the samples.
    Ramp(f64),
}

impl OnStale {
    /// The choices that are words.
    pub const WORDS: [Self; 2] = [Self::Hold, Self::Default];

    /// The word in configurations: `hold`, `default`, and `ramp` where a rate belongs to it.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Default => "default",
            Self::Ramp(_) => "ramp",
        }
    }
}

impl std::fmt::Display for OnStale {
    /// As a configuration says it, without quotation marks.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Ramp(rate) => write!(f, "{{ ramp = {rate:?} }}"),
            word => f.write_str(word.as_str()),
        }
    }
}

/// How frames with doubtful flags, that is any but `FORCED`, are treated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Bad {
    /// As good ones: their samples are taken.
    #[default]
    Ignore,
    /// As missing: the input is stale until a good frame arrives.
    Stale,
}

impl Bad {
    /// Both choices.
    pub const ALL: [Self; 2] = [Self::Ignore, Self::Stale];

    /// The word in configurations: `ignore` or `stale`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Ignore => "ignore",
            Self::Stale => "stale",
        }
    }
}

/// What a start does if the retained state is damaged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum OnDamaged {
    /// It ends with the reason and the way out.
    #[default]
    Stop,
    /// It starts without the state, which it puts aside.
    Cold,
}

impl OnDamaged {
    /// All choices.
    pub const ALL: [Self; 2] = [Self::Stop, Self::Cold];

    /// The word in configurations: `stop` or `cold`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Stop => "stop",
            Self::Cold => "cold",
        }
    }
}

impl std::fmt::Display for OnDamaged {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

/// When a node that goes on from its retained state begins to send.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum OnWarmStart {
    /// With its first cycle.
    #[default]
    Send,
    /// When somebody has looked at it and lets it.
    Confirm,
}

impl OnWarmStart {
    /// All choices.
    pub const ALL: [Self; 2] = [Self::Send, Self::Confirm];

    /// The word in configurations: `send` or `confirm`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Send => "send",
            Self::Confirm => "confirm",
        }
    }
}

impl std::fmt::Display for OnWarmStart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

/// What a node retains over a restart, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Retain {
    /// Older state of blocks and inputs is not taken, in ns.
    pub for_ns: u64,
    /// How often it is written, in ns.
    pub every_ns: u64,
    /// What a start does if it is damaged.
    pub on_damaged: OnDamaged,
    /// When a start that goes on from it begins to send.
    pub on_warm_start: OnWarmStart,
}

impl Default for Retain {
    fn default() -> Self {
        Self {
            for_ns: 600_000_000_000,
            every_ns: 1_000_000_000,
            on_damaged: OnDamaged::Stop,
            on_warm_start: OnWarmStart::Send,
        }
    }
}

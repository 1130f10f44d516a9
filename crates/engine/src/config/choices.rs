//! Values that are one of a few words, or a word with a number.

/// Where the thread of a task runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cpu {
    /// On the CPU that is the best one when the node starts.
    Auto {
        /// That CPU, once it is known.
        chosen: Option<u32>,
    },
    /// On any CPU; the kernel may move it.
    Any,
    /// On this CPU.
    Number(u32),
}

impl Cpu {
    /// Those that are written as a word.
    pub const WORDS: [Self; 2] = [Self::Auto { chosen: None }, Self::Any];

    /// The word that it is written as; that of a number is `number`.
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
    /// What the configuration says, whatever is chosen.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(cpu) => cpu.fmt(f),
            word => f.write_str(word.as_str()),
        }
    }
}

/// What a stale input reads.
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

/// What a frame that is in doubt is taken for: one with any flag but `FORCED`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Bad {
    /// A good one: its samples are taken.
    #[default]
    Ignore,
    /// None: the input is stale until a good frame comes.
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

//! How a task waits for its release.

/// Upper bound of an adaptive margin, in ns: a longer one would cost more CPU time than most
/// wake-ups need.
pub const LONGEST_ADAPTIVE_MARGIN_NS: u64 = 200_000;

/// How a task waits for its release: CPU time against punctuality.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wake {
    /// Sleep until the release. Costs no CPU time; late by the system's wake-up latency.
    Sleep,
    /// Sleep until a margin before the release, then watch the clock.
    Hybrid(Margin),
    /// Watch the clock all the time. Costs a whole CPU, and with real-time priority the kernel's
    /// throttling takes that CPU away for 50 ms of every second unless it is switched off.
    Spin,
}

impl Wake {
    /// Every way to wait, the hybrid one with the default margin.
    pub const ALL: [Self; 3] = [Self::Sleep, Self::Hybrid(Margin::DEFAULT), Self::Spin];

    /// The word in configurations and reports: `sleep`, `hybrid` or `spin`.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Sleep => "sleep",
            Self::Hybrid(_) => "hybrid",
            Self::Spin => "spin",
        }
    }

    /// How long before the release a hybrid wait is awake; the other waits have no margin.
    pub const fn margin(self) -> Option<Margin> {
        match self {
            Self::Hybrid(margin) => Some(margin),
            Self::Sleep | Self::Spin => None,
        }
    }
}

/// How long before the release a hybrid wait is awake.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Margin {
    /// Always this long, in ns.
    Fixed(u64),
    /// As long as the observed wake-up latency asks for, but no longer than this part of the
    /// period or [`LONGEST_ADAPTIVE_MARGIN_NS`]: the most that the wait costs of a CPU.
    Adaptive {
        /// 0 to 1.
        cpu_budget: f64,
    },
}

impl Margin {
    /// Adaptive, at most a fifth of a CPU.
    pub const DEFAULT: Self = Self::Adaptive { cpu_budget: 0.2 };

    /// The longest that this margin becomes for a task of this period; both in ns.
    pub fn longest_ns(self, period_ns: u64) -> u64 {
        match self {
            Self::Fixed(margin_ns) => margin_ns.min(period_ns),
            Self::Adaptive { cpu_budget } => {
                let budget_ns = (cpu_budget * period_ns as f64).max(0.0) as u64;
                budget_ns.min(LONGEST_ADAPTIVE_MARGIN_NS)
            }
        }
    }

    /// The fixed length in ns.
    pub const fn fixed_ns(self) -> Option<u64> {
        match self {
            Self::Fixed(margin_ns) => Some(margin_ns),
            Self::Adaptive { .. } => None,
        }
    }

    /// The part of a CPU that an adaptive margin may cost.
    pub const fn cpu_budget(self) -> Option<f64> {
        match self {
            Self::Fixed(_) => None,
            Self::Adaptive { cpu_budget } => Some(cpu_budget),
        }
    }
}

impl Default for Margin {
    /// [`Margin::DEFAULT`].
    fn default() -> Self {
        Self::DEFAULT
    }
}

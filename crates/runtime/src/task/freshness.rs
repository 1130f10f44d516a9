//! The value and quality of an input, from the samples that arrived. No ports, no clock.

use isochrone_blocks::PinType;
use isochrone_engine::config::{Bad, OnStale};
use isochrone_engine::{InputPlan, InputReading};
use isochrone_ipc::Flags;

/// A value as it arrived, with times that have been checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample {
    pub(crate) value: f64,
    /// When its age begins, in ns.
    pub(crate) sampled_ns: u64,
    /// Of the oldest sample behind it, in ns.
    pub(crate) source_ns: u64,
    /// Of its frame.
    pub(crate) flags: Flags,
}

/// Whether an input is ok, and why.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum InputState {
    /// No sample has come yet.
    Waiting,
    /// None has come since the restart that gave it its value back.
    Restored,
    /// Its newest sample is fresh and good.
    Good,
    /// Its last sample is older than its `max_age`.
    Stale,
    /// Its sender said that it ends.
    Stopped,
    /// Its newest frame has these flags, which the configuration treats as stale.
    Doubted(Flags),
    /// It does not take this sample.
    Rejected(f64),
    /// Its newest frame has no value for it.
    Missing(Missing),
}

/// Why a frame has no value for an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Missing {
    /// Its layout is not known yet.
    Layout,
    /// Its layout has no signal that fits the input, or names no signals.
    Signal,
    /// Its layout has the signal in another unit.
    Unit,
    /// It has this many values, and the input reads a channel beyond them.
    Channel { channel: usize, values: usize },
}

impl InputState {
    /// Whether both have the same reason, apart from sample and flags.
    pub(crate) fn is_like(self, other: Self) -> bool {
        let kind = std::mem::discriminant::<Self>;
        match (self, other) {
            (Self::Missing(own), Self::Missing(other)) => own == other,
            (Self::Waiting | Self::Restored, Self::Waiting | Self::Restored) => true,
            _ => kind(&self) == kind(&other),
        }
    }

    /// Whether the input is ok.
    pub(crate) fn is_ok(self) -> bool {
        self == Self::Good
    }
}

/// How often and for how long an input was not ok.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    /// How often it ceased to be ok.
    pub(crate) falls: u64,
    /// How long it was not ok in total, including the wait for its first sample, in ns.
    pub(crate) not_ok_ns: u64,
}

/// The samples that an input takes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Accepted {
    value_type: PinType,
    range: Option<(f64, f64)>,
    finite: bool,
}

impl Accepted {
    /// From its service.
    pub(crate) fn of_service(plan: &InputPlan) -> Self {
        let InputPlan { value_type, range, finite, .. } = *plan;
        Self { value_type, range, finite }
    }

    /// All that a type can hold: from the program, which knows what it gives.
    pub(crate) fn all_of(value_type: PinType) -> Self {
        Self { value_type, range: None, finite: false }
    }

    fn takes(&self, value: f64) -> bool {
        self.value_type.holds(value)
            && (value.is_finite() || !self.finite)
            && self.range.is_none_or(|(min, max)| (min..=max).contains(&value))
    }

    /// Why it does not take a value.
    pub(crate) fn refusal(&self, value: f64) -> String {
        let value_type = self.value_type;
        match self.range {
            _ if !value_type.holds(value) => format!("which {value_type} cannot hold"),
            Some((min, max)) if value.is_finite() => {
                format!("which is out of its range from {min:?} to {max:?}")
            }
            _ => "which is not finite".to_owned(),
        }
    }
}

/// One input: its last good sample, and the outcome of the newest frame.
#[derive(Debug)]
pub(crate) struct Freshness {
    accepted: Accepted,
    default: f64,
    max_age_ns: Option<u64>,
    on_stale: OnStale,
    bad: Bad,
    /// Step of a ramp in a cycle.
    step: f64,
    /// The last sample that was taken.
    last: Option<Sample>,
    /// `last` is of an earlier run of the node.
    is_restored: bool,
    has_come: bool,
    newest: Newest,
    /// When the age of the newest sample begins, whether or not the sample was accepted.
    newest_ns: u64,
    /// No sample, accepted or not, has arrived for longer than `max_age`.
    is_silent: bool,
    /// The sender's last frame has arrived.
    has_stopped: bool,
    reads: f64,
    /// It reads the last sample, neither the default nor a value of a ramp.
    is_on_sample: bool,
    was_ok: bool,
    read_ns: Option<u64>,
    tally: Tally,
}

/// What became of the newest sample.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Newest {
    Taken,
    Doubted(Flags),
    Rejected(f64),
    Missing(Missing),
}

impl Freshness {
    /// An input of a task of this period, without a sample.
    pub(crate) fn new(plan: &InputPlan, accepted: Accepted, period_ns: u64) -> Self {
        let step = match plan.on_stale {
            OnStale::Ramp(rate) => rate * (period_ns as f64 / 1e9),
            OnStale::Hold | OnStale::Default => 0.0,
        };
        Self {
            accepted,
            default: plan.default,
            max_age_ns: plan.max_age_ns,
            on_stale: plan.on_stale,
            bad: plan.bad,
            step,
            last: None,
            is_restored: false,
            has_come: false,
            newest: Newest::Taken,
            newest_ns: 0,
            is_silent: false,
            has_stopped: false,
            reads: plan.default,
            is_on_sample: false,
            was_ok: false,
            read_ns: None,
            tally: Tally::default(),
        }
    }

    /// Takes a sample; `false` if it is rejected.
    pub(crate) fn offer(&mut self, sample: Sample) -> bool {
        let Sample { value, flags, sampled_ns, .. } = sample;
        (self.newest_ns, self.has_come) = (sampled_ns, true);
        self.has_stopped = flags.contains(Flags::STOPPED);
        let is_bad = !flags.without(Flags::FORCED | Flags::STOPPED).is_empty();
        self.newest = if self.bad == Bad::Stale && is_bad {
            Newest::Doubted(flags)
        } else if self.accepted.takes(value) {
            (self.last, self.is_restored) = (Some(sample), false);
            Newest::Taken
        } else {
            Newest::Rejected(value)
        };
        !matches!(self.newest, Newest::Rejected(_))
    }

    /// Records a frame with these flags that has no value for the input.
    pub(crate) fn miss(&mut self, flags: Flags, why: Missing) {
        self.has_stopped = flags.contains(Flags::STOPPED);
        self.newest = Newest::Missing(why);
    }

    /// Begins with the last value of an earlier run, which is stale, if it takes such a value.
    pub(crate) fn restore(&mut self, value: f64) {
        if !self.accepted.takes(value) {
            return;
        }
        let (sampled_ns, source_ns, flags) = (0, 0, Flags::NONE);
        self.last = Some(Sample { value, sampled_ns, source_ns, flags });
        (self.is_restored, self.is_on_sample, self.reads) = (true, true, value);
    }

    /// Whether it was restored, and no sample has come since, taken or not.
    pub(crate) fn awaits_sample(&self) -> bool {
        self.is_restored && !self.has_come
    }

    /// The value of the input in the cycle that began at `now_ns`. Call it once a cycle, as a ramp advances by one
    /// step.
    pub(crate) fn read(&mut self, now_ns: u64) -> InputReading {
        let is_stale = self.is_stale(now_ns);
        let silent_ns = now_ns.saturating_sub(self.newest_ns);
        self.is_silent = self.max_age_ns.is_some_and(|max_age_ns| silent_ns > max_age_ns);
        let sample = self.last.filter(|_| !is_stale || self.on_stale == OnStale::Hold);
        let target = sample.map_or(self.default, |sample| sample.value);
        self.reads = match self.on_stale {
            OnStale::Ramp(_) if sample.is_none() || !self.is_on_sample => {
                approach(self.reads, target, self.step)
            }
            _ => target,
        };
        let has_landed = self.reads.to_bits() == target.to_bits();
        self.is_on_sample = sample.is_some() && has_landed;
        let is_ok = self.last.is_some() && !is_stale && self.newest == Newest::Taken;
        self.count(is_ok, now_ns);
        let dated = self.last.filter(|_| !self.is_restored);
        let age_ns = dated.map(|last| now_ns.saturating_sub(last.sampled_ns));
        // A constant default has no sample as its source.
        let source = self.last.filter(|_| sample.is_some() || !has_landed);
        InputReading {
            value: self.reads,
            ok: is_ok,
            age_s: age_ns.map_or(f64::INFINITY, |age_ns| age_ns as f64 / 1e9),
            source_ns: source.map_or(0, |source| source.source_ns),
            flags: self.flags(is_stale, source),
        }
    }

    fn is_stale(&self, now_ns: u64) -> bool {
        let Some(last) = self.last else { return false };
        let age_ns = now_ns.saturating_sub(last.sampled_ns);
        self.is_restored
            || self.has_stopped
            || matches!(self.newest, Newest::Doubted(_))
            || self.max_age_ns.is_some_and(|max_age_ns| age_ns > max_age_ns)
    }

    fn flags(&self, is_stale: bool, source: Option<Sample>) -> Flags {
        let mut flags = source.map_or(Flags::NONE, |source| source.flags.handed_on());
        if is_stale {
            flags |= Flags::STALE;
        }
        if !self.is_on_sample {
            flags |= Flags::SUBSTITUTE;
        }
        match self.newest {
            Newest::Taken => {}
            Newest::Doubted(of_frame) => flags |= of_frame.handed_on() & Flags::UPSTREAM,
            Newest::Rejected(_) | Newest::Missing(_) => flags |= Flags::REJECTED,
        }
        flags
    }

    fn count(&mut self, is_ok: bool, now_ns: u64) {
        // The time until now counts for the state before.
        if let Some(read_ns) = self.read_ns.replace(now_ns).filter(|_| !self.was_ok) {
            let waited_ns = now_ns.saturating_sub(read_ns);
            self.tally.not_ok_ns = self.tally.not_ok_ns.saturating_add(waited_ns);
        }
        self.tally.falls += u64::from(self.was_ok && !is_ok);
        self.was_ok = is_ok;
    }

    /// Why the input is ok, or why not, as it was last read.
    pub(crate) fn state(&self) -> InputState {
        match self.newest {
            _ if self.was_ok => InputState::Good,
            Newest::Rejected(_) | Newest::Missing(_) if self.has_stopped && self.last.is_some() => {
                InputState::Stopped
            }
            // The last sample was rejected, and none has arrived since.
            Newest::Rejected(_) if self.is_silent => InputState::Stale,
            Newest::Rejected(sample) => InputState::Rejected(sample),
            Newest::Missing(why) => InputState::Missing(why),
            Newest::Doubted(flags) => InputState::Doubted(flags),
            Newest::Taken if self.is_restored => InputState::Restored,
            Newest::Taken if self.last.is_none() => InputState::Waiting,
            Newest::Taken if self.has_stopped => InputState::Stopped,
            Newest::Taken => InputState::Stale,
        }
    }

    /// How often and for how long the input was not ok.
    pub(crate) fn tally(&self) -> Tally {
        self.tally
    }
}

/// One step from a value to another, which is reached exactly.
fn approach(from: f64, to: f64, step: f64) -> f64 {
    let distance = to - from;
    if !from.is_finite() || !to.is_finite() || distance.abs() <= step {
        return to;
    }
    let next = from + step.copysign(distance);
    if next != from {
        next
    } else if distance > 0.0 {
        // The step is smaller than the spacing of numbers of this size.
        from.next_up()
    } else {
        from.next_down()
    }
}

#[cfg(test)]
#[path = "freshness_tests.rs"]
mod tests;

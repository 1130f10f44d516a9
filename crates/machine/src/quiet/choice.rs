//! The choice of a CPU, and its reasons.

use std::{fmt, iter};

use super::observation::BoundThread;
use crate::quiet::{Observation, ObservedCpu};

/// A chosen CPU. Displayed as its reasons, a plain sentence each: `it is isolated; CPU 1 is as good, and the last
/// is taken`.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The CPU.
    pub cpu: usize,
    /// The reasons for it, the most important first.
    pub reasons: Vec<Reason>,
}

/// What spoke for a CPU, each among those for which the reasons before it spoke, and what has to be put up
/// with there.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// The process may use no other.
    Only,
    /// It is not among those to avoid.
    Off {
        /// One of them.
        avoided: Avoided,
    },
    /// Speaks against it, as against all: that it had better not be chosen.
    Despite {
        /// Why not.
        avoided: Avoided,
    },
    /// Just as many threads are bound to each other one.
    NoneFree,
    /// Fewer threads are bound to it than to others.
    Apart {
        /// How many are bound to it.
        bound: usize,
        /// One that is bound to another.
        other: BoundThread,
    },
    /// Speaks against it: what is bound to it.
    Shared {
        /// The threads.
        with: Vec<BoundThread>,
    },
    /// The kernel leaves it alone.
    Isolated,
    /// Fewer threads are bound to the other CPUs of its core.
    OwnCore,
    /// Devices interrupt it less often than others.
    Interrupts {
        /// How often, per second.
        per_second: f64,
        /// The CPU that they interrupt most.
        worst: usize,
        /// How often they interrupt that one, per second.
        worst_per_second: f64,
    },
    /// Devices have interrupted it less often than others since the machine started.
    InterruptsSinceBoot {
        /// How often.
        count: u64,
        /// The CPU that they have interrupted most.
        worst: usize,
        /// How often they have interrupted that one.
        worst_count: u64,
    },
    /// Speaks against it: devices interrupt it more often than another one, against which more important reasons
    /// spoke.
    Noisy {
        /// How often, per second.
        per_second: f64,
        /// The CPU that they interrupt least.
        best: usize,
        /// How often they interrupt that one, per second.
        best_per_second: f64,
    },
    /// It has the highest number of CPUs that are alike.
    Last {
        /// The others.
        alike: Vec<usize>,
    },
}

/// A CPU that a thread had better not run on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Avoided {
    /// Its number.
    pub cpu: usize,
    /// The reasons against it.
    pub has: String,
}

/// Up to this many device interrupts per second more make no difference: one that takes 10 us meets one
/// cycle in a thousand.
const RATE_TOLERANCE: f64 = 100.0;
/// Up to this many interrupts since the start make no difference: devices have them when they are set up.
const COUNT_TOLERANCE: f64 = 1_000.0;
/// Less than this times as many make no difference: another moment would show it the other way round.
const LIKE: f64 = 2.0;
/// As many of the threads that share a CPU are named.
const NAMED: usize = 3;

impl Observation {
    /// Chooses the CPU for one more thread by these rules, each among the CPUs that those before it have left: the
    /// fewest threads bound to it, isolated, the fewest threads bound to the rest of its core, the fewest device
    /// interrupts per second, the fewest since the machine started, the last. `None` if there is none.
    pub fn choose(&self) -> Option<Choice> {
        self.choose_off(&[])
    }

    /// As [`choose`](Self::choose), first of all among the CPUs that are not to be avoided, if there are any.
    pub fn choose_off(&self, avoided: &[Avoided]) -> Option<Choice> {
        let mut left: Vec<&ObservedCpu> = self.cpus.iter().collect();
        let mut reasons = Vec::new();
        if let [only] = left.as_slice() {
            let reasons = iter::once(Reason::Only).chain(shared(only.bound.clone())).collect();
            return Some(Choice { cpu: only.cpu, reasons });
        }
        let narrow = [
            Self::apart as fn(&Self, &mut Vec<&ObservedCpu>) -> Option<Reason>,
            Self::isolated,
            Self::own_core,
            Self::interrupts,
            Self::interrupts_since_boot,
        ];
        reasons.extend(off(&mut left, avoided));
        let reasons_before = reasons.len();
        for narrow in narrow {
            reasons.extend(narrow(self, &mut left));
        }
        let (last, alike) = left.split_last()?;
        if !alike.is_empty() {
            reasons.push(Reason::Last { alike: alike.iter().map(|cpu| cpu.cpu).collect() });
        }
        // What speaks for several CPUs is told of the one that is chosen in the end.
        for reason in &mut reasons {
            match (reason, last.interrupts) {
                (Reason::Interrupts { per_second, .. }, Some(has)) => *per_second = has.per_second,
                (Reason::InterruptsSinceBoot { count, .. }, Some(has)) => *count = has.since_boot,
                _ => {}
            }
        }
        // After the reason why there is nothing better.
        let behind = reasons.len().min(reasons_before + 1);
        let despite = avoided.iter().find(|avoided| avoided.cpu == last.cpu);
        let despite = despite.map(|avoided| Reason::Despite { avoided: avoided.clone() });
        // One that it had better avoid is told once.
        let others = last.bound.iter().filter(|thread| {
            !avoided.iter().any(|it| it.cpu == last.cpu && it.has.starts_with(&thread.name))
        });
        let shared = shared(others.cloned().collect());
        reasons.splice(behind..behind, despite.into_iter().chain(shared));
        reasons.extend(self.noisy(last));
        Some(Choice { cpu: last.cpu, reasons })
    }

    fn apart(&self, left: &mut Vec<&ObservedCpu>) -> Option<Reason> {
        let bound = left.iter().map(|cpu| cpu.bound.len()).min()?;
        let lost = keep(left, |cpu| cpu.bound.len() == bound);
        match lost.iter().rev().find_map(|cpu| cpu.bound.first()) {
            Some(other) => Some(Reason::Apart { bound, other: other.clone() }),
            None => (bound > 0).then_some(Reason::NoneFree),
        }
    }

    fn isolated(&self, left: &mut Vec<&ObservedCpu>) -> Option<Reason> {
        let is_any = left.iter().any(|cpu| cpu.is_isolated);
        if is_any {
            keep(left, |cpu| cpu.is_isolated);
        }
        is_any.then_some(Reason::Isolated)
    }

    fn own_core(&self, left: &mut Vec<&ObservedCpu>) -> Option<Reason> {
        let on_core = |of: &ObservedCpu| -> usize {
            let others =
                self.cpus.iter().filter(|cpu| cpu.cpu != of.cpu && of.core.contains(cpu.cpu));
            others.map(|cpu| cpu.bound.len()).sum()
        };
        let fewest = left.iter().map(|cpu| on_core(cpu)).min()?;
        let lost = keep(left, |cpu| on_core(cpu) == fewest);
        (!lost.is_empty()).then_some(Reason::OwnCore)
    }

    fn interrupts(&self, left: &mut Vec<&ObservedCpu>) -> Option<Reason> {
        let rate = |cpu: &ObservedCpu| cpu.interrupts.map(|interrupts| interrupts.per_second);
        let (per_second, worst) = keep_quiet(left, rate, RATE_TOLERANCE)?;
        let worst_per_second = rate(worst)?;
        Some(Reason::Interrupts { per_second, worst: worst.cpu, worst_per_second })
    }

    /// That devices interrupt another CPU less often by far.
    fn noisy(&self, chosen: &ObservedCpu) -> Option<Reason> {
        let rate = |cpu: &ObservedCpu| cpu.interrupts.map(|interrupts| interrupts.per_second);
        let rates = self.cpus.iter().map(|cpu| Some((cpu.cpu, rate(cpu)?)));
        let rates = rates.collect::<Option<Vec<_>>>()?;
        let (best, best_per_second) = rates.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let per_second = rate(chosen)?;
        let is_noisy = per_second > best_per_second.mul_add(LIKE, RATE_TOLERANCE);
        is_noisy.then_some(Reason::Noisy { per_second, best, best_per_second })
    }

    fn interrupts_since_boot(&self, left: &mut Vec<&ObservedCpu>) -> Option<Reason> {
        let count = |cpu: &ObservedCpu| cpu.interrupts.map(|interrupts| interrupts.since_boot);
        let known = |cpu: &ObservedCpu| count(cpu).map(|count| count as f64);
        let (fewest, worst) = keep_quiet(left, known, COUNT_TOLERANCE)?;
        let (count, worst_count) = (fewest as u64, count(worst)?);
        Some(Reason::InterruptsSinceBoot { count, worst: worst.cpu, worst_count })
    }
}

/// Leaves those that are not to be avoided, unless that is none.
fn off(left: &mut Vec<&ObservedCpu>, avoided: &[Avoided]) -> Option<Reason> {
    let why = |cpu: &ObservedCpu| avoided.iter().find(|avoided| avoided.cpu == cpu.cpu);
    if left.iter().all(|cpu| why(cpu).is_some()) {
        return None;
    }
    let lost = keep(left, |cpu| why(cpu).is_none());
    lost.into_iter().rev().find_map(why).map(|avoided| Reason::Off { avoided: avoided.clone() })
}

fn shared(with: Vec<BoundThread>) -> Option<Reason> {
    (!with.is_empty()).then_some(Reason::Shared { with })
}

/// Keeps the CPUs with about the least, and returns what the last of them has and the CPU with the most,
/// if that is gone. Does nothing unless it is known of all of them.
fn keep_quiet<'a>(
    left: &mut Vec<&'a ObservedCpu>,
    amount: impl Fn(&ObservedCpu) -> Option<f64>,
    tolerance: f64,
) -> Option<(f64, &'a ObservedCpu)> {
    let amounts = left.iter().map(|cpu| amount(cpu)).collect::<Option<Vec<f64>>>()?;
    let least = amounts.into_iter().reduce(f64::min)?;
    let is_quiet = |cpu: &ObservedCpu| {
        amount(cpu).is_some_and(|amount| amount <= least.mul_add(LIKE, tolerance))
    };
    let lost = keep(left, is_quiet);
    let worst = lost
        .into_iter()
        .max_by(|a, b| amount(a).partial_cmp(&amount(b)).unwrap_or(std::cmp::Ordering::Equal))?;
    Some((amount(left.last()?)?, worst))
}

/// Keeps some, and returns the others.
fn keep<'a>(
    left: &mut Vec<&'a ObservedCpu>,
    is_kept: impl Fn(&ObservedCpu) -> bool,
) -> Vec<&'a ObservedCpu> {
    let (kept, lost) = left.iter().partition(|cpu| is_kept(cpu));
    *left = kept;
    lost
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, reason) in self.reasons.iter().enumerate() {
            let separator = if index > 0 { "; " } else { "" };
            write!(f, "{separator}{reason}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Only => f.write_str("it is the only CPU that this process may use"),
            Self::Off { avoided } => write!(f, "CPU {} is left to {}", avoided.cpu, avoided.has),
            Self::Despite { avoided } => {
                write!(f, "it has {}, because no CPU is without such a task", avoided.has)
            }
            Self::NoneFree => f.write_str("every CPU has a task already"),
            Self::Apart { bound: 0, other } => {
                write!(f, "no task is pinned to it, and CPU {} has {}", other.cpu, Named(other))
            }
            Self::Apart { bound, other } => {
                write!(f, "only {} pinned to it, and more to CPU {}", tasks(*bound), other.cpu)
            }
            Self::Shared { with } => {
                let named: Vec<_> =
                    with.iter().take(NAMED).map(|thread| Named(thread).to_string()).collect();
                let named = named.join(", ");
                match with.len().saturating_sub(NAMED) {
                    0 if with.len() == 1 => write!(f, "{named} runs there too"),
                    0 => write!(f, "{named} run there too"),
                    more => write!(f, "{named} and {more} more run there too"),
                }
            }
            Self::Isolated => f.write_str("it is isolated"),
            Self::OwnCore => f.write_str("fewer tasks are pinned to its core than to others"),
            Self::Interrupts { per_second, worst, worst_per_second } => write!(
                f,
                "devices interrupt it {per_second:.0} times per second, and CPU {worst} {worst_per_second:.0} times"
            ),
            Self::InterruptsSinceBoot { count, worst, worst_count } => write!(
                f,
                "devices have interrupted it {count} times since the machine started, and CPU {worst} {worst_count} times"
            ),
            Self::Noisy { per_second, best, best_per_second } => write!(
                f,
                "devices interrupt it {per_second:.0} times per second, and CPU {best} only {best_per_second:.0} \
                 times, which counts less"
            ),
            Self::Last { alike } => {
                let alike: Vec<String> = alike.iter().map(usize::to_string).collect();
                match alike.as_slice() {
                    [one] => write!(f, "CPU {one} is as good, and the last is taken"),
                    many => {
                        write!(f, "CPUs {} are as good, and the last is taken", many.join(", "))
                    }
                }
            }
        }
    }
}

fn tasks(count: usize) -> String {
    if count == 1 { "one task is".to_owned() } else { format!("{count} tasks are") }
}

/// A thread, as it is told from others.
struct Named<'a>(&'a BoundThread);

impl fmt::Display for Named<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The name of a thread may hold anything.
        let name: String =
            self.0.name.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
        match self.0.process {
            Some(process) => write!(f, "{name} (pid {process})"),
            None => f.write_str(&name),
        }
    }
}

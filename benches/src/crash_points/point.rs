//! A crash point: whose life, in which company, at which system call.

use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

use clap::ValueEnum;

use super::call::Call;

/// What the process that is struck does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, ValueEnum)]
pub enum Role {
    /// `publish`
    Publisher,
    /// `run`
    Node,
    /// `subscribe`
    Subscriber,
}

/// Who else is in the domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, ValueEnum)]
pub enum Circumstance {
    /// Nobody was there yet.
    Cold,
    /// The processes of the other roles run, and go on running.
    Beside,
    /// As `Beside`, and a process of the same role was killed before, while it ran.
    Restart,
    /// A publisher, a node and a subscriber were killed while they ran; what they left is there.
    Dead,
}

impl Circumstance {
    /// Whether others run.
    pub(super) fn has_company(self) -> bool {
        match self {
            Self::Beside | Self::Restart => true,
            Self::Cold | Self::Dead => false,
        }
    }
}

/// Which part of the process's life.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, ValueEnum)]
pub enum Phase {
    /// From the program's first instruction.
    Start,
    /// From the delivery of SIGINT to a process that runs.
    End,
}

/// What happens to the process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Blow {
    /// SIGKILL instead of the call.
    Kill,
    /// SIGSTOP after the call, and SIGCONT later.
    Stop,
}

/// One instruction of one process. Calls are counted for each thread and phase from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Point {
    /// Whose life.
    pub role: Role,
    /// In which company.
    pub circumstance: Circumstance,
    /// In which part of it.
    pub phase: Phase,
    /// In which thread, in the order of their creation; 0 is the one that runs `main`.
    pub thread: usize,
    /// At which system call.
    pub call: Call,
    /// At which of these calls, from 1.
    pub k: u32,
    /// How many instructions of the program after it; 0: instead of it.
    pub steps: u32,
}

/// `publisher:cold:start:fchmod:16`; `…:16+500`, 500 instructions later; `…:16@2` in thread 2.
impl Display for Point {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (role, circumstance) = (name(self.role), name(self.circumstance));
        write!(f, "{role}:{circumstance}:{}:{}:{}", name(self.phase), self.call, self.k)?;
        if self.steps > 0 {
            write!(f, "+{}", self.steps)?;
        }
        if self.thread > 0 {
            write!(f, "@{}", self.thread)?;
        }
        Ok(())
    }
}

impl FromStr for Point {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(':').collect();
        let (role, circumstance, phase, call, place) = match parts[..] {
            [role, circumstance, phase, call, place] => (role, circumstance, phase, call, place),
            [role, circumstance, call, place] => (role, circumstance, "start", call, place),
            _ => {
                return Err(
                    "give role:circumstance:phase:call:k, or …:k+instructions@thread".into()
                );
            }
        };
        let (place, thread) = place.split_once('@').unwrap_or((place, "0"));
        let (k, steps) = place.split_once('+').unwrap_or((place, "0"));
        let number = |text: &str| format!("{text:?} is no number of a call or a thread");
        Ok(Self {
            role: Role::from_str(role, false)?,
            circumstance: Circumstance::from_str(circumstance, false)?,
            phase: Phase::from_str(phase, false)?,
            thread: thread.parse().map_err(|_| number(thread))?,
            call: call.parse()?,
            steps: steps.parse().map_err(|_| number(steps))?,
            k: k.parse().ok().filter(|k| *k > 0).ok_or_else(|| number(k))?,
        })
    }
}

/// The name that the command line knows a value by.
pub fn name<V: ValueEnum>(value: V) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_reads_back_as_it_was_written() {
        for text in ["publisher:cold:start:fchmod:16", "node:beside:end:unlink:3+70@2"] {
            assert_eq!(text.parse::<Point>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn a_point_without_a_phase_is_one_of_the_start() {
        let point: Point = "publisher:cold:fchmod:16".parse().unwrap();
        assert_eq!(point.phase, Phase::Start);
    }

    #[test]
    fn what_is_no_point_is_refused() {
        for text in
            ["", "node", "node:cold:start:fchmod:0", "node:cold:start:jump:1", "x:cold:close:1"]
        {
            assert!(text.parse::<Point>().is_err(), "{text}");
        }
    }
}

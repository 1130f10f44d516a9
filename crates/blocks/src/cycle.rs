//! The cycle that a block is stepped in: number, period, and the sample times that `callOB` can name.

use crate::{Ob, status};

/// The cycle of a task.
#[derive(Clone, Copy, Debug)]
pub struct Cycle<'a> {
    index: u64,
    period_ns: u64,
    sample_time_s: f64,
    obs: &'a [(i16, u64)],
}

impl<'a> Cycle<'a> {
    /// Cycle `index` (skipped cycles included) of a task with period `period_ns`; `obs` lists the
    /// OB number and the period in nanoseconds of every task of the node that has a number.
    pub fn new(index: u64, period_ns: u64, obs: &'a [(i16, u64)]) -> Self {
        Self { index, period_ns, sample_time_s: sample_time_s(period_ns), obs }
    }

    /// Index on the task's grid; cycles that an overrun skipped count too.
    #[inline]
    pub fn index(&self) -> u64 {
        self.index
    }

    /// The task's configured period in nanoseconds.
    #[inline]
    pub fn period_ns(&self) -> u64 {
        self.period_ns
    }

    /// The task's configured period in seconds.
    #[inline]
    pub fn period_s(&self) -> f64 {
        self.sample_time_s
    }

    /// Nanoseconds on the task's grid since cycle `last`, cycles that an overrun skipped included; a period where
    /// there was none, and at least one.
    #[inline]
    pub fn elapsed_ns(&self, last: Option<u64>) -> u64 {
        let cycles = last.map_or(1, |last| self.index.saturating_sub(last).max(1));
        cycles.saturating_mul(self.period_ns)
    }

    /// Period in nanoseconds of the task that `ob` names: the configured one, never a measured one.
    /// `Err` is the status word: [`status::OB_UNAVAILABLE`] or [`status::QRY_CINT`].
    #[inline]
    pub fn period_ns_of(&self, ob: Ob) -> Result<u64, u16> {
        self.of_task(ob, self.period_ns, |period_ns| period_ns)
    }

    /// Sample time in seconds of the task that `ob` names: [`period_ns_of`](Self::period_ns_of) in seconds.
    #[inline]
    pub fn sample_time_s(&self, ob: Ob) -> Result<f64, u16> {
        // That of the caller is divided once a cycle, for all instances.
        self.of_task(ob, self.sample_time_s, sample_time_s)
    }

    /// What the calling task has, or what follows from the period of the one that `ob` names.
    #[inline]
    fn of_task<T>(&self, ob: Ob, of_caller: T, of_period: impl Fn(u64) -> T) -> Result<T, u16> {
        match ob {
            Ob::Caller => Ok(of_caller),
            Ob::Task { period_ns } => Ok(of_period(period_ns)),
            Ob::Number(number) => match self.obs.iter().find(|(ob, _)| *ob == number) {
                Some(&(_, period_ns)) => Ok(of_period(period_ns)),
                None if is_cyclic_ob(number) => Err(status::OB_UNAVAILABLE),
                None => Err(status::QRY_CINT),
            },
        }
    }
}

/// Whether `number` is one that a cyclic interrupt OB can have: 30 to 38, or 123 and above.
pub fn is_cyclic_ob(number: i16) -> bool {
    matches!(number, 30..=38 | 123..)
}

#[inline]
fn sample_time_s(period_ns: u64) -> f64 {
    period_ns as f64 / 1e9
}

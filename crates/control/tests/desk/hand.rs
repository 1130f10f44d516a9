//! A node whose cycles are stepped by hand.

use isochrone_control::desk::*;
use isochrone_engine::orders::{Inbox, Replacement};
use isochrone_engine::{Plan, Rules, Source, TaskEngine};
use isochrone_model::*;

/// When everything comes back from its cycle.
pub(crate) const UNIX_NS: u64 = 7;

pub(crate) struct Hand {
    pub(crate) operator: Operator,
    pub(crate) engines: Vec<TaskEngine>,
    pub(crate) inboxes: Vec<Inbox>,
    /// The next cycle of each task.
    pub(crate) next: Vec<u64>,
    /// What has come back, until it is asked for.
    pub(crate) done: Vec<OrderOutcome>,
    /// What each task finds before its next cycle.
    pub(crate) replacements: Vec<Option<Replacement>>,
}

pub(crate) fn plan(text: &str) -> Plan {
    Plan::new(Source::new("level.toml", text), &Rules::default()).unwrap()
}

pub(crate) fn draft(text: &str) -> Draft {
    Draft::new(&plan(text)).unwrap()
}

impl Hand {
    /// Prepares to read signals, those from `offset` on, at most `limit`; returns how many there are, too.
    pub(crate) fn get<'n>(
        &self,
        names: impl IntoIterator<Item = &'n str>,
        offset: usize,
        limit: usize,
    ) -> Result<(PreparedRequest, usize), Refusal> {
        let selection = Selection::of(self.operator.signals(), names, offset, limit)?;
        let total = selection.total();
        Ok((self.operator.read(selection.with_quality()), total))
    }

    pub(crate) fn new(text: &str) -> Self {
        let plan = plan(text);
        let engines = TaskEngine::build(&plan).unwrap();
        Self {
            operator: Operator::new(&plan, Feeds::Services),
            inboxes: engines.iter().map(|_| Inbox::new(64)).collect(),
            next: vec![0; engines.len()],
            done: Vec::new(),
            replacements: engines.iter().map(|_| None).collect(),
            engines,
        }
    }

    pub(crate) fn send(&mut self, prepared: Result<PreparedRequest, Refusal>) -> u64 {
        let (number, orders) = self.operator.send(prepared.unwrap());
        for (task, order) in orders {
            self.inboxes[task].take(order).unwrap();
        }
        number
    }

    pub(crate) fn set<const N: usize>(&mut self, values: [(&str, Value); N]) -> u64 {
        let prepared = self.operator.set(values, RequestTerms::default(), &self.next);
        self.send(prepared)
    }

    pub(crate) fn force<const N: usize>(&mut self, values: [(&str, Value); N], hold: Hold) -> u64 {
        let prepared = self.operator.force(values, hold, RequestTerms::default(), &self.next);
        self.send(prepared)
    }

    pub(crate) fn release(&mut self, name: &str) -> u64 {
        self.send(self.prepare_release([name]))
    }

    pub(crate) fn prepare_release<'n>(
        &self,
        names: impl IntoIterator<Item = &'n str> + Clone,
    ) -> Result<PreparedRequest, Refusal> {
        let unmatched = self.operator.signals().unmatched(names.clone());
        self.operator.release(names, unmatched, RequestTerms::default(), &self.next)
    }

    /// Sends another configuration, for the next cycle of each task.
    pub(crate) fn change(&mut self, text: &str) -> ChangeSummary {
        let prepared = self.operator.change(draft(text), RequestTerms::default()).unwrap();
        let summary = prepared.summary().clone();
        let (_, replacements) = self.operator.send_change(prepared, &self.next).unwrap();
        self.replacements = replacements.into_iter().map(Some).collect();
        summary
    }

    /// Runs a cycle of a task, with all that is done before and after it.
    pub(crate) fn step(&mut self, task: usize) {
        let (engine, inbox, cycle) =
            (&mut self.engines[task], &mut self.inboxes[task], self.next[task]);
        let (operator, done) = (&mut self.operator, &mut self.done);
        if let Some(mut replacement) = self.replacements[task].take() {
            engine.replace(&mut replacement, cycle);
            done.push(OrderOutcome::Applied(operator.replaced(task, replacement, UNIX_NS)));
        }
        engine.expire(cycle, |ended| {
            done.push(OrderOutcome::Applied(operator.expired(task, ended, cycle, UNIX_NS)))
        });
        inbox.apply(engine, cycle, 0, |order| done.push(operator.done(task, order, UNIX_NS)));
        engine.step(cycle);
        inbox.read(engine, cycle, |order| done.push(operator.done(task, order, UNIX_NS)));
        self.next[task] += 1;
    }

    /// Runs so many cycles of each task, in turn.
    pub(crate) fn steps(&mut self, cycles: usize) {
        for _ in 0..cycles {
            (0..self.engines.len()).for_each(|task| self.step(task));
        }
    }

    pub(crate) fn value(&self, name: &str) -> f64 {
        let signal = self.operator.signals().find(name).unwrap();
        self.engines[signal.task].image()[signal.slot]
    }

    /// The entries of the journal for what has come back since they were asked for.
    pub(crate) fn entries(&mut self) -> Vec<Entry> {
        let done = self.done.drain(..).filter_map(|done| match done {
            OrderOutcome::Applied(entry) => Some(entry),
            OrderOutcome::TooLate { .. }
            | OrderOutcome::Released { .. }
            | OrderOutcome::Read(_) => None,
        });
        done.collect()
    }
}

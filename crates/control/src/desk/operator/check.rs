//! Collecting the faults of a request.

use std::collections::HashSet;

use isochrone_engine::Pattern;
use isochrone_model::{Code, Finding, Refusal};

use super::{Next, Operator};
use crate::desk::refusal;
use crate::desk::signals::{Matches, Signal, Signals};

/// How many names are compared with misspelt names of one request.
const COMPARISONS: usize = 20_000;

/// The faults of a request so far.
pub(super) struct Check<'s> {
    signals: &'s Signals,
    /// The signals that are to replace those, task by task.
    next: Option<&'s Next>,
    /// The code of the first finding.
    code: Code,
    findings: Vec<Finding>,
    seen: HashSet<(usize, usize)>,
    pub(super) is_empty: bool,
    comparisons: usize,
}

impl<'s> Check<'s> {
    pub(super) fn new(signals: &'s Signals) -> Self {
        let (code, findings, seen) = (Code::WrongValue, Vec::new(), HashSet::new());
        Self { signals, next: None, code, findings, seen, is_empty: true, comparisons: 0 }
    }

    /// For a request that writes, which is about the signals that each task has now.
    pub(super) fn of_writing(operator: &'s Operator) -> Self {
        Self { next: operator.next_plan.as_deref(), ..Self::new(&operator.signals) }
    }

    /// The signal of a name, which the request may have only once.
    pub(super) fn find(&mut self, name: &str) -> Option<Signal<'s>> {
        let signal = self.known(name)?;
        if !self.seen.insert((signal.task, signal.slot)) {
            let message = format!("\"{name}\" is given twice in one request");
            self.refuse(Refusal::one(Code::WrongValue, name, message, "name it once"));
            return None;
        }
        Some(signal)
    }

    pub(super) fn known(&mut self, name: &str) -> Option<Signal<'s>> {
        self.is_empty = false;
        let found = self.locate(name);
        if found.is_none() {
            self.note_unknown(name);
        }
        found
    }

    /// The signal of a name in the task that has it now.
    fn locate(&self, name: &str) -> Option<Signal<'s>> {
        let Some(next) = self.next else { return self.signals.locate(name) };
        let new = next.signals.locate(name).filter(|signal| next.has_returned(signal.task));
        new.or_else(|| self.signals.locate(name).filter(|signal| !next.has_returned(signal.task)))
    }

    /// The signals that match a pattern. `None`: there are none.
    pub(super) fn matching(&mut self, name: &str) -> Option<Matches<'s>> {
        self.is_empty = false;
        let matches = self.signals.matching(&Pattern::new(name));
        if matches.total() == 0 {
            self.note_unknown(name);
            return None;
        }
        Some(matches)
    }

    /// Suggests a name, as long as the request has not used up its comparisons.
    fn note_unknown(&mut self, name: &str) {
        let is_on_its_way = |next: &&Next| {
            next.signals.locate(name).is_some() || self.signals.locate(name).is_some()
        };
        if let Some(next) = self.next.filter(is_on_its_way) {
            return self.refuse(next.refusal());
        }
        let is_affordable = self.comparisons < COMPARISONS;
        self.comparisons += self.signals.comparisons();
        self.refuse(if is_affordable {
            self.signals.unknown(name)
        } else {
            refusal::unknown(name, "nor are others of the request, for which see above")
        });
    }

    pub(super) fn note<T>(&mut self, result: Result<T, Refusal>) -> Option<T> {
        result.map_err(|refusal| self.refuse(refusal)).ok()
    }

    /// Adds a finding. If something cannot be read at all, the code is that of a wrong parameter, whatever else is
    /// wrong.
    pub(super) fn refuse(&mut self, refusal: Refusal) {
        if self.findings.is_empty() || refusal.code == Code::InvalidParams {
            self.code = refusal.code;
        }
        self.findings.extend(refusal.findings);
    }

    /// Keeps one of several equal findings in a row.
    pub(super) fn dedup(&mut self) {
        self.findings.dedup();
    }

    pub(super) fn into_findings(self) -> Vec<Finding> {
        self.findings
    }

    pub(super) fn end(mut self) -> Result<(), Refusal> {
        if self.is_empty {
            self.refuse(refusal::empty());
        }
        if self.findings.is_empty() { Ok(()) } else { Err(Refusal::of(self.code, self.findings)) }
    }
}

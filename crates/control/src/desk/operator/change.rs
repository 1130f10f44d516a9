//! A new configuration for a running node: checked, built, and sent to its tasks.

mod checks;
mod following;
mod next;
mod values;

use std::collections::BTreeMap;
use std::sync::Arc;

use isochrone_engine::Plan;
use isochrone_engine::orders::{CarriedForce, Carry, Replacement, Store};
use isochrone_engine::{BuildError, Source, TaskEngine};
use isochrone_model::{ChangeSummary, ChangedValue, Refusal, Tuned};

use super::check::Check;
use super::{ForceRecord, Kind, Operator, PendingRequest, RequestTerms};
use crate::desk::fixed::Fixed;
use crate::desk::journal::Applied;
use crate::desk::permissions::{Intent, Permissions};
use crate::desk::refusal::{empty, waiting};
use crate::desk::signals::{ChangedPin, Kept, Signals};
use crate::desk::warnings::Warnings;

pub(super) use next::Next;

/// A new configuration with the engines of its tasks, made independently of the running one.
pub struct Draft {
    signals: Arc<Signals>,
    permissions: Permissions,
    warnings: Warnings,
    fixed: Arc<Fixed>,
    source: Source,
    file: Option<String>,
    engines: Vec<TaskEngine>,
}

impl Draft {
    /// Builds the engines of a plan.
    ///
    /// # Errors
    /// As [`TaskEngine::build`].
    pub fn new(plan: &Plan) -> Result<Self, BuildError> {
        Ok(Self {
            engines: TaskEngine::build(plan)?,
            signals: Arc::new(Signals::of(plan)),
            permissions: Permissions::of(plan),
            warnings: Warnings::of(plan),
            fixed: Arc::new(Fixed::of(plan)),
            source: plan.source.clone(),
            file: None,
        })
    }

    /// Names the file that it was read from, for the journal.
    #[must_use]
    pub fn from_file(self, file: Option<String>) -> Self {
        Self { file, ..self }
    }
}

/// The state of the operator that a change of the configuration depends on, so that the change can be prepared while
/// the operator does other things.
#[derive(Debug)]
pub struct Basis {
    signals: Arc<Signals>,
    permissions: Permissions,
    fixed: Arc<Fixed>,
    /// Obstacles that are known already.
    refused: Option<Refusal>,
    /// For each task its forces by slot.
    forces: Vec<BTreeMap<u32, String>>,
    values: BTreeMap<(usize, u32), f64>,
    /// How many requests that write were sent.
    writes: u64,
}

/// A new configuration that was checked, with the engine of each task.
#[derive(Debug)]
pub struct PreparedChange {
    replacements: Vec<Replacement>,
    values: Vec<ChangedValue>,
    tuned: Vec<Tuned>,
    next: Box<Next>,
    request: RequestTerms,
    /// How many requests that write had been sent when it was prepared.
    writes: u64,
}

impl PreparedChange {
    /// What it changes.
    pub fn summary(&self) -> &ChangeSummary {
        &self.next.applied.summary
    }

    /// The values of the pins that it changes, before and after; empty if there are more than ten thousand.
    pub fn values(&self) -> &[ChangedValue] {
        &self.values
    }

    /// Values that were set at run time and stay, although the new configuration gives others.
    pub fn tuned(&self) -> &[Tuned] {
        &self.tuned
    }

    /// The names of the signals that there will be.
    pub fn signals(&self) -> &Signals {
        &self.next.signals
    }

    /// The new engines for each task, in the order of the plan.
    pub fn replacements_mut(&mut self) -> impl Iterator<Item = &mut Replacement> {
        self.replacements.iter_mut()
    }
}

impl Operator {
    /// Prepares to run another configuration: its tasks, inputs and outputs must be those of the
    /// running one. Blocks of the same name, type and task keep their state and outputs; their
    /// parameters, and variables, keep the values that they have now, except where the constants of the
    /// two configurations differ.
    ///
    /// # Errors
    /// Everything that keeps the node from running it: a part that cannot be changed online, a forced signal that it
    /// lacks, a change of a protected block, a running value outside its limits, another request on its way.
    pub fn change(&self, draft: Draft, request: RequestTerms) -> Result<PreparedChange, Refusal> {
        self.basis().change(draft, request)
    }

    /// The basis for [`Basis::change`].
    pub fn basis(&self) -> Basis {
        let mut check = Check::new(&self.signals);
        check.is_empty = false;
        check.note(self.permissions.check(Intent::Apply));
        self.check_settled(&mut check);
        let is_on_its_way = |(_, sent): &(&u64, &PendingRequest)| match sent.kind {
            Kind::Set => !sent.writes.is_empty(),
            Kind::Force | Kind::Release | Kind::Undo { .. } => true,
            Kind::Read | Kind::Change => false,
        };
        if let Some((&transaction, _)) = self.sent.iter().find(is_on_its_way) {
            check.refuse(waiting(transaction));
        }
        let forces = self.forces.iter().map(|of| {
            let name = |forced: &Vec<ForceRecord>| {
                forced.first().map(|forced| forced.name.clone()).unwrap_or_default()
            };
            of.iter().map(|(slot, forced)| (*slot, name(forced))).collect()
        });
        Basis {
            signals: Arc::clone(&self.signals),
            permissions: self.permissions.clone(),
            fixed: Arc::clone(&self.fixed),
            refused: check.end().err(),
            forces: forces.collect(),
            values: self.values.iter().map(|(at, held)| (*at, held.value)).collect(),
            writes: self.writes,
        }
    }
}

impl Basis {
    /// As [`Operator::change`].
    ///
    /// # Errors
    /// As [`Operator::change`].
    pub fn change(self, draft: Draft, request: RequestTerms) -> Result<PreparedChange, Refusal> {
        let mut check = Check::new(&self.signals);
        check.is_empty = false;
        check.note(self.refused.clone().map_or(Ok(()), Err));
        let Draft { signals, permissions, warnings, fixed, source, file, engines } = draft;
        let differences = self.fixed.differences(&fixed);
        if !differences.is_empty() {
            // If the tasks differ, comparing their slots means nothing.
            differences.into_iter().for_each(|difference| check.refuse(difference));
            return Err(check.end().err().unwrap_or_else(empty));
        }
        let kept = Kept::of(&self.signals, &signals);
        let changed: Vec<Vec<ChangedPin>> =
            (0..signals.tasks()).map(|task| kept.changed(&self.signals, &signals, task)).collect();
        self.check_forces(&mut check, &kept);
        self.check_protected(&mut check, &kept, &signals, &changed);
        self.check_limits(&mut check, &kept, &signals, &permissions, &changed);
        check.end()?;
        let names = |(task, pins): (usize, &Vec<ChangedPin>)| {
            let slots: Vec<usize> = pins.iter().map(|pin| pin.slot).collect();
            signals.pin_names(task, &slots)
        };
        let values = self.changed_values(&signals, &changed);
        let tuned = self.tuned(&kept, &signals, &changed);
        let blocks = kept.blocks(&self.signals, &signals);
        let summary = ChangeSummary {
            added: blocks.added,
            removed: blocks.removed,
            kept: blocks.kept,
            changed: changed.iter().enumerate().flat_map(names).collect(),
            limits: self.permissions.changed_limits(&permissions),
        };
        let applied =
            Arc::new(Applied { sha256: source.sha256(), text: source.text, file, summary });
        let replacement = |(task, engine): (usize, TaskEngine)| {
            let pins = changed.get(task).map_or(&[][..], Vec::as_slice);
            let forced = self.forces.get(task).into_iter().flat_map(BTreeMap::keys).copied();
            let indexes = (&*self.signals, &*signals);
            Replacement::new(engine, carry(task, indexes, &kept, pins, forced))
        };
        let engines = engines.into_iter().enumerate();
        let replacements: Vec<_> = engines.map(replacement).collect();
        let given = |new: &Replacement| new.stores().iter().map(|store| store.slot).collect();
        let next = Box::new(Next {
            signals,
            permissions,
            warnings,
            fixed,
            kept,
            applied,
            number: 0,
            returned: vec![false; replacements.len()],
            given: replacements.iter().map(given).collect(),
        });
        let writes = self.writes;
        Ok(PreparedChange { replacements, values, tuned, next, request, writes })
    }
}

impl Operator {
    /// Gives a change its number; returns the tasks' new engines, in the order of the plan, for the caller to send to
    /// the tasks. `at` is the first cycle of each task that should have it.
    ///
    /// A task returns earlier orders in the order in which they were carried out: values read with the old engine
    /// before the box with the old engine, everything else after it.
    ///
    /// # Errors
    /// Another request that writes was sent since it was prepared: prepare it again.
    pub fn send_change(
        &mut self,
        prepared: PreparedChange,
        at: &[u64],
    ) -> Result<(u64, Vec<Replacement>), Refusal> {
        let PreparedChange { mut replacements, mut next, request, writes, .. } = prepared;
        if writes != self.writes {
            return Err(waiting(self.next - 1));
        }
        self.writes += 1;
        let number = self.next;
        self.next += 1;
        for (replacement, at) in replacements.iter_mut().zip(at) {
            replacement.address(number, *at);
        }
        next.number = number;
        let parts = replacements.len();
        let sent = PendingRequest { parts, ..PendingRequest::new(Kind::Change, request, parts) };
        self.sent.insert(number, sent);
        self.next_plan = Some(next);
        Ok((number, replacements))
    }
}

/// What a task's new engine takes over from the old one, from the old and the new index, the instances in both, the
/// changed values, and the slots that are forced in the old one.
pub(in crate::desk) fn carry(
    task: usize,
    (old, new): (&Signals, &Signals),
    kept: &Kept,
    changed: &[ChangedPin],
    forced: impl Iterator<Item = u32>,
) -> Carry {
    let forced = forced.filter_map(|from| Some((from, kept.slot(task, from as usize)?)));
    let (forced, slots): (Vec<u32>, Vec<usize>) = forced.unzip();
    let forces = forced.into_iter().zip(new.slot_forces(task, &slots));
    let mut forces: Vec<CarriedForce> =
        forces.map(|(from, force)| CarriedForce { from, force }).collect();
    forces.sort_unstable_by_key(|carried| carried.force.slot());
    Carry {
        image: kept.image(task),
        state: kept.state(task),
        imports: kept.imports(old, new, task),
        forces: forces.into(),
        stores: changed.iter().filter_map(store).collect(),
    }
}

fn store(pin: &ChangedPin) -> Option<Store> {
    let value = pin.constant?;
    Some(Store::new(pin.slot, value))
}

impl std::fmt::Debug for Draft {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Draft").field("source", &self.source.name).finish_non_exhaustive()
    }
}

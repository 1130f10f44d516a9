//! Another configuration for a node that runs: found right, built, and followed to its place.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use super::check::Check;
use super::{Action, Entry, Forced, Held, Kind, Operator, Place, Record, Request, Sent};
use crate::engine::{CarriedForce, Carry, Replacement};
use crate::operate::Value;
use crate::operate::fixed::Fixed;
use crate::operate::forces::{AtEnd, Force};
use crate::operate::journal::Applied;
use crate::operate::permissions::{Intent, Permissions};
use crate::operate::refusal::{Refusal, Refusals};
use crate::operate::signals::{ChangedPin, Kept, Role, Signals};
use crate::operate::store::Store;
use crate::operate::warnings::Warnings;
use crate::plan::Plan;
use crate::{BuildError, Source, TaskEngine};

/// What another configuration changes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ChangeSummary {
    /// Blocks that are new: by their name, or some of a block's instances as `ramp.3 to ramp.7`.
    pub added: Vec<String>,
    /// Blocks that are gone.
    pub removed: Vec<String>,
    /// Blocks that go on with their state and outputs.
    pub kept: Vec<String>,
    /// Input pins of those that have another constant or another wire; `*` stands for all instances of
    /// a block.
    pub changed: Vec<String>,
    /// Limits that differ, as `ramp.*.rate: 0.0 to 50.0 -> 0.0 to 20.0`, or `none` for no limits.
    pub limits: Vec<String>,
}

/// Another configuration with the engines of its tasks, made without a look at the running one.
pub struct Draft {
    signals: Arc<Signals>,
    permissions: Permissions,
    warnings: Warnings,
    fixed: Arc<Fixed>,
    source: Source,
    file: Option<Arc<str>>,
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
}

impl Draft {
    /// The same, as read from this file; for the journal.
    #[must_use]
    pub fn from_file(self, file: Option<Arc<str>>) -> Self {
        Self { file, ..self }
    }
}

/// What a change of the configuration depends on: the operator's part of it, so that it can be prepared
/// while the operator does other things.
#[derive(Debug)]
pub struct Basis {
    signals: Arc<Signals>,
    permissions: Permissions,
    fixed: Arc<Fixed>,
    /// What is in the way already.
    findings: Vec<Refusal>,
    /// For each task its forces by slot.
    forces: Vec<BTreeMap<u32, String>>,
    values: BTreeMap<(usize, u32), f64>,
    /// Requests that write which were sent.
    writes: u64,
}

/// Another configuration, found right, with the engine of each task.
#[derive(Debug)]
pub struct PreparedChange {
    replacements: Vec<Replacement>,
    next: Box<Next>,
    request: Request,
    /// How many requests that write had been sent when it was prepared.
    writes: u64,
}

impl PreparedChange {
    /// What it changes.
    pub fn summary(&self) -> &ChangeSummary {
        &self.next.applied.summary
    }

    /// What each task will be sent, in the order of the plan.
    pub fn replacements_mut(&mut self) -> impl Iterator<Item = &mut Replacement> {
        self.replacements.iter_mut()
    }
}

/// A configuration that is on its way to the tasks.
#[derive(Debug)]
pub(super) struct Next {
    pub(super) signals: Arc<Signals>,
    permissions: Permissions,
    warnings: Warnings,
    fixed: Arc<Fixed>,
    kept: Kept,
    applied: Arc<Applied>,
    number: u64,
    returned: Vec<bool>,
}

impl Next {
    /// Whether a task has its new engine.
    pub(super) fn has_returned(&self, task: usize) -> bool {
        self.returned.get(task).copied().unwrap_or_default()
    }

    /// Where a slot of a task stands in its new engine.
    pub(super) fn slot(&self, task: usize, slot: u32) -> Option<u32> {
        self.kept.slot(task, slot as usize).map(|slot| slot as u32)
    }
}

impl Operator {
    /// Prepares to run another configuration: its tasks, inputs and outputs must be those of the
    /// running one. Blocks of the same name, type and task keep their state and outputs; their
    /// parameters keep the values that they have now, except where the constants of the two
    /// configurations differ.
    ///
    /// # Errors
    /// All that keeps the node from running it: something that cannot be changed online, a forced
    /// signal that it does not have, a change to what is protected, a running value outside of its
    /// limits, another request that is on its way.
    pub fn change(&self, draft: Draft, request: Request) -> Result<PreparedChange, Refusals> {
        self.basis().change(draft, request)
    }

    /// What [`Basis::change`] needs.
    pub fn basis(&self) -> Basis {
        let mut check = Check::new(&self.signals);
        check.note(self.permissions.check(Intent::Apply));
        self.check_settled(&mut check);
        let is_on_its_way = |(_, sent): &(&u64, &Sent)| match sent.kind {
            Kind::Set => !sent.writes.is_empty(),
            Kind::Force | Kind::Release | Kind::Undo { .. } => true,
            Kind::Read | Kind::Change => false,
        };
        if let Some((&transaction, _)) = self.sent.iter().find(is_on_its_way) {
            check.findings.push(Refusal::Waiting { transaction });
        }
        let forces = self.forces.iter().map(|of| {
            let name = |forced: &Vec<Forced>| {
                forced.first().map(|forced| forced.name.clone()).unwrap_or_default()
            };
            of.iter().map(|(slot, forced)| (*slot, name(forced))).collect()
        });
        Basis {
            signals: Arc::clone(&self.signals),
            permissions: self.permissions.clone(),
            fixed: Arc::clone(&self.fixed),
            findings: check.findings,
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
    pub fn change(self, draft: Draft, request: Request) -> Result<PreparedChange, Refusals> {
        let mut check = Check::new(&self.signals);
        check.is_empty = false;
        check.findings.clone_from(&self.findings);
        let Draft { signals, permissions, warnings, fixed, source, file, engines } = draft;
        let differences = self.fixed.differences(&fixed);
        if !differences.is_empty() {
            // What stands where in tasks that differ means nothing.
            check.findings.extend(differences);
            return Err(check.end().err().unwrap_or_else(|| Refusal::Empty.into()));
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
        let (number, returned) = (0, vec![false; replacements.len()]);
        let next = Next { signals, permissions, warnings, fixed, kept, applied, number, returned };
        let (next, writes) = (Box::new(next), self.writes);
        Ok(PreparedChange { replacements, next, request, writes })
    }

    fn check_forces(&self, check: &mut Check<'_>, kept: &Kept) {
        let forces = self.forces.iter().enumerate();
        let forces = forces.flat_map(|(task, of)| of.iter().map(move |force| (task, force)));
        for (task, (slot, forced)) in forces {
            if kept.slot(task, *slot as usize).is_none() {
                check.findings.push(Refusal::ForcedGone { name: forced.clone() });
            }
        }
    }

    /// What is out of reach stays as it is.
    fn check_protected(
        &self,
        check: &mut Check<'_>,
        kept: &Kept,
        signals: &Signals,
        changed: &[Vec<ChangedPin>],
    ) {
        for (text, pattern) in self.permissions.protected() {
            let matches = self.signals.matching(pattern);
            let gone = matches.slots(0).find(|(task, slot)| kept.slot(*task, *slot).is_none());
            let signal = gone.and_then(|(task, slot)| self.signals.at(task, slot));
            let refusal = |name| Refusal::Protected { name, pattern: text.to_owned() };
            check.findings.extend(signal.map(|signal| refusal(signal.name)));
        }
        let pins = changed.iter().enumerate();
        let pins = pins.flat_map(|(task, pins)| pins.iter().map(move |pin| (task, pin.slot)));
        for signal in pins.filter_map(|(task, slot)| signals.at(task, slot)) {
            check.note(self.permissions.check_name(&signal));
        }
    }

    /// Values that were set and stay must lie within the new limits.
    fn check_limits(
        &self,
        check: &mut Check<'_>,
        kept: &Kept,
        signals: &Signals,
        permissions: &Permissions,
        changed: &[Vec<ChangedPin>],
    ) {
        for (&(task, slot), &held) in &self.values {
            let Some(slot) = kept.slot(task, slot as usize) else { continue };
            let is_changed = changed
                .get(task)
                .is_some_and(|pins| pins.binary_search_by_key(&slot, |pin| pin.slot).is_ok());
            let Some(signal) = signals.at(task, slot).filter(|_| !is_changed) else { continue };
            let value = Value::of(held, signal.value_type);
            // Where nothing was given, nothing is bounded.
            if !held.is_nan() {
                check.note(permissions.bound(&signal, held, value));
            }
        }
    }
}

impl Operator {
    /// Gives a change its number, and the tasks' new engines to the one who hands them to the tasks,
    /// in the order of the plan. `at` is the first cycle of each that is to have it.
    ///
    /// A task gives back what it was sent before in the order in which it was done: values that it
    /// read with the old engine before the box with the old engine, all else after it.
    ///
    /// # Errors
    /// Another request that writes was sent since it was prepared: prepare it again.
    pub fn send_change(
        &mut self,
        prepared: PreparedChange,
        at: &[u64],
    ) -> Result<(u64, Vec<Replacement>), Refusals> {
        let PreparedChange { mut replacements, mut next, request, writes, .. } = prepared;
        if writes != self.writes {
            return Err(Refusal::Waiting { transaction: self.next - 1 }.into());
        }
        self.writes += 1;
        let number = self.next;
        self.next += 1;
        for (replacement, at) in replacements.iter_mut().zip(at) {
            (replacement.number, replacement.at) = (number, *at);
        }
        next.number = number;
        let Request { client, comment, .. } = request;
        let (kind, tasks, parts) = (Kind::Change, replacements.len(), replacements.len());
        let writes = Default::default();
        self.sent.insert(number, Sent { kind, client, comment, at: None, tasks, parts, writes });
        self.next_plan = Some(next);
        Ok((number, replacements))
    }

    /// Takes back the box of a task that has its new engine. `unix_ns` is now, in ns of UTC since 1970.
    pub fn replaced(&mut self, task: usize, replacement: Replacement, unix_ns: u64) -> Entry {
        let Replacement { number, cycle, carry, .. } = replacement;
        let applied = self.follow(task, &carry.stores);
        let (mut client, mut comment) = (Default::default(), None);
        if let Some(sent) = self.sent.get_mut(&number) {
            (client, comment) = (sent.client.clone(), sent.comment.clone());
            sent.tasks -= 1;
            if sent.tasks == 0 {
                self.sent.remove(&number);
            }
        }
        let changed = |store: &Store| super::changed(store.slot, store.before, Some(store.value));
        let entry = self.add(Record {
            sequence: 0,
            transaction: number,
            task,
            cycle: cycle.unwrap_or_default(),
            unix_ns,
            action: Action::Apply,
            parts: 1,
            changes: carry.stores.iter().map(changed).collect(),
            client,
            comment,
            configuration: applied,
        });
        let is_over = |next: &Next| next.returned.iter().all(|returned| *returned);
        if let Some(next) = self.next_plan.take_if(|next| is_over(next)) {
            let Next { signals, mut permissions, warnings, fixed, .. } = *next;
            permissions.unwritten = self.permissions.unwritten.take();
            (self.signals, self.permissions) = (signals, permissions);
            (self.warnings, self.fixed) = (warnings, fixed);
        }
        entry
    }

    /// The change of the configuration that is on its way to the tasks.
    pub fn changing(&self) -> Option<u64> {
        self.next_plan.as_ref().map(|next| next.number)
    }

    /// Finds fault with a request that writes while a change is on its way.
    pub(super) fn check_settled(&self, check: &mut Check<'_>) {
        check.findings.extend(self.changing().map(|transaction| Refusal::Changing { transaction }));
    }

    /// What is known of a task's values follows them to their new slots. Returns the configuration.
    fn follow(&mut self, task: usize, stores: &[Store]) -> Option<Arc<Applied>> {
        let Self { signals, next_plan, values, forces, journal, changes, .. } = self;
        let next = next_plan.as_deref_mut()?;
        let is_held = |slot: u32| {
            let is_parameter = |signal: super::Signal<'_>| signal.role == Role::Parameter;
            next.signals.at(task, slot as usize).is_some_and(is_parameter)
                && stores.binary_search_by_key(&slot, |store| store.slot).is_err()
        };
        let follow = |((of, slot), held): ((usize, u32), Held)| {
            if of != task {
                return Some(((of, slot), held));
            }
            let slot = next.slot(task, slot).filter(|slot| is_held(*slot))?;
            Some(((task, slot), held))
        };
        *values = std::mem::take(values).into_iter().filter_map(follow).collect::<HashMap<_, _>>();
        if let Some(forces) = forces.get_mut(task) {
            let known = std::mem::take(forces).into_iter();
            *forces = known.filter_map(|(slot, f)| Some((next.slot(task, slot)?, f))).collect();
        }
        journal.follow(task, |slot| {
            let known = || signals.at(task, slot as usize);
            let gone = || {
                let signal = known().map(|signal| (signal.name, signal.value_type));
                signal.map_or(Place::Slot(slot), |signal| Place::Gone(Box::new(signal)))
            };
            next.slot(task, slot).map_or_else(gone, Place::Slot)
        });
        if let Some(changes) = changes.get_mut(task) {
            *changes += 1;
        }
        if let Some(returned) = next.returned.get_mut(task) {
            *returned = true;
        }
        Some(Arc::clone(&next.applied))
    }
}

/// What of a task's old engine goes into the new one: of the old and the new index, what both have and
/// what has changed, and the slots that are forced in the old one.
pub(in crate::operate) fn carry(
    task: usize,
    (old, new): (&Signals, &Signals),
    kept: &Kept,
    changed: &[ChangedPin],
    forced: impl Iterator<Item = u32>,
) -> Carry {
    let forced = forced.filter_map(|from| Some((from, kept.slot(task, from as usize)?)));
    let (forced, slots): (Vec<u32>, Vec<usize>) = forced.unzip();
    let taints = new.taints(task, &slots);
    let carried = |((from, slot), taints): ((u32, usize), Box<[u32]>)| {
        let at_end = match new.at(task, slot)?.role {
            Role::Wired | Role::Output => AtEnd::Recompute,
            Role::Input | Role::Parameter | Role::Ok | Role::Age => AtEnd::Restore,
        };
        let force = Force { slot: slot as u32, at_end, taints, ..Force::default() };
        Some(CarriedForce { from, force })
    };
    let slots = forced.into_iter().zip(slots).zip(taints);
    let mut forces: Vec<CarriedForce> = slots.filter_map(carried).collect();
    forces.sort_unstable_by_key(|carried| carried.force.slot);
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

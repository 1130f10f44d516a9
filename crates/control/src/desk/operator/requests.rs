//! Checking requests: each is prepared, or refused with all findings.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use isochrone_engine::Pattern;
use isochrone_engine::orders::{MAX_FORCES, Order, ReadSlot, Store, Work};
use isochrone_model::{Code, Finding, Hold, Refusal, Role, Value, Written};

use super::check::Check;
use super::{Feeds, ForceRecord, Kind, Operator, PreparedRequest, RequestTerms, Selection};
use crate::desk::permissions::Intent;
use crate::desk::refusal::wrong_value;
use crate::desk::signals::Signal;
use crate::desk::warnings::{ValueWarning, Warnings};

/// The longest force that ends by itself, in s: about thirty years.
const MAX_SECONDS: f64 = 1e9;

impl Operator {
    /// Checks that operators may set values at all.
    ///
    /// # Errors
    /// They may not.
    pub fn check_may_set(&self) -> Result<(), Refusal> {
        self.permissions.check(Intent::Set)
    }

    /// Prepares to give parameters, variables, and inputs that the program feeds, new values. `next` is the
    /// first cycle of each task that has not begun.
    ///
    /// While another configuration is on its way, names refer to the signals that each task has now.
    ///
    /// # Errors
    /// Everything that is wrong with the request.
    pub fn set<'n, V: Into<Written>>(
        &self,
        values: impl IntoIterator<Item = (&'n str, V)>,
        request: RequestTerms,
        next: &[u64],
    ) -> Result<PreparedRequest, Refusal> {
        let mut check = Check::of_writing(self);
        let mut feeds: BTreeMap<usize, Vec<(u32, f64)>> = BTreeMap::new();
        let mut stores: BTreeMap<usize, Vec<Store>> = BTreeMap::new();
        let mut sets_parameter = false;
        for (name, value) in values {
            let Some(signal) = check.find(name) else { continue };
            let value = value.into();
            let found = self.settable(&signal, &request).and_then(|()| match signal.role {
                Role::Input => self.allowed(&signal, &value),
                _ => {
                    sets_parameter = true;
                    self.permissions.check_name(&signal)?;
                    self.check_not_given(&signal)?;
                    self.allowed(&signal, &value)
                }
            });
            let Some(slot) = check.note(found) else { continue };
            if signal.role == Role::Input {
                feeds.entry(signal.task).or_default().push((signal.slot as u32, slot));
            } else {
                stores.entry(signal.task).or_default().push(Store::new(signal.slot, slot));
            }
        }
        if sets_parameter {
            check.note(self.permissions.check(Intent::Set));
        }
        let tasks: BTreeSet<usize> = feeds.keys().chain(stores.keys()).copied().collect();
        let at = self.check_at(&mut check, &request, tasks.iter().copied(), next);
        check.end()?;
        let warnings = self.warn_of_set(&stores);
        let work = |task| {
            let feeds = feeds.remove(&task).unwrap_or_default().into();
            (task, Work::Set { feeds, stores: sorted(stores.remove(&task)) })
        };
        let orders = tasks.into_iter().map(work).collect();
        Ok(prepared(orders, request, Kind::Set, warnings, at).due(at, next))
    }

    /// Prepares to hold signals at values. `next` as with [`set`](Self::set).
    ///
    /// # Errors
    /// Everything that is wrong with the request.
    pub fn force<'n, V: Into<Written>>(
        &self,
        values: impl IntoIterator<Item = (&'n str, V)>,
        hold: Hold,
        request: RequestTerms,
        next: &[u64],
    ) -> Result<PreparedRequest, Refusal> {
        let mut check = Check::of_writing(self);
        check.note(self.permissions.check(Intent::Force));
        if let Hold::Seconds(seconds) = hold
            && !(seconds > 0.0 && seconds <= MAX_SECONDS)
        {
            let message = format!("a force cannot last {seconds:?} s");
            let help =
                "write seconds greater than 0 that cycles can count, or hold it until its release";
            check.refuse(Refusal::one(Code::WrongValue, "", message, help));
        }
        let mut stores: BTreeMap<usize, Vec<Store>> = BTreeMap::new();
        for (name, value) in values {
            let Some(signal) = check.find(name) else { continue };
            let allowed = match signal.role {
                Role::Age => {
                    let name = &signal.name;
                    let message =
                        format!("\"{name}\" is the age of an input, which cannot be forced");
                    let help = "force the input, or its \".ok\"";
                    Err(Refusal::one(Code::NotWritable, name, message, help))
                }
                _ => self.permissions.check_name(&signal),
            };
            let allowed = allowed.and_then(|()| self.check_stays(&signal));
            let found = allowed.and_then(|()| self.allowed(&signal, &value.into()));
            let Some(slot) = check.note(found) else { continue };
            stores.entry(signal.task).or_default().push(Store::new(signal.slot, slot));
        }
        for (task, stores) in &stores {
            let Some(known) = self.forces.get(*task) else { continue };
            let again = stores.iter().filter(|store| known.contains_key(&store.slot)).count();
            let pending = self.forced_again.get(*task).copied().unwrap_or_default();
            if known.len() + stores.len() - again > MAX_FORCES || pending + again > MAX_FORCES {
                let message = format!(
                    "task \"{}\" has room for {MAX_FORCES} forces, and these would make it more",
                    self.signals.task_name(*task)
                );
                check.refuse(Refusal::one(Code::Busy, "", message, "release some of them first"));
            }
        }
        let at = self.check_at(&mut check, &request, stores.keys().copied(), next);
        check.end()?;
        let replaced = self.forced_among(&stores).map(|name| ValueWarning::Replaced { name });
        let warnings = replaced.chain(self.warn(&stores)).collect();
        let work = |(task, unsorted)| {
            let stores = sorted(Some(unsorted));
            (task, self.signals_of(task).force(task, stores, self.cycles(task, hold)))
        };
        let orders = stores.into_iter().map(work).collect();
        Ok(prepared(orders, request, Kind::Force, warnings, at).due(at, next))
    }

    /// Prepares to release forces, including those on their way. Names may be patterns, which stand for the forced
    /// signals that they match: if there are none, there is nothing to do. Check first for patterns that match no
    /// signal at all, with [`Signals::unmatched`](crate::desk::Signals::unmatched). `next` as with
    /// [`set`](Self::set).
    ///
    /// # Errors
    /// Everything that is wrong with the request.
    pub fn release<'n>(
        &self,
        names: impl IntoIterator<Item = &'n str>,
        unmatched: Vec<Finding>,
        request: RequestTerms,
        next: &[u64],
    ) -> Result<PreparedRequest, Refusal> {
        let mut check = Check::of_writing(self);
        check.note(self.permissions.check(Intent::Release));
        let mut unmatched = unmatched.into_iter().peekable();
        let mut slots: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for name in names {
            check.is_empty = false;
            let found: Vec<(usize, u32)> = if Pattern::is_glob(name) {
                let pattern = Pattern::new(name);
                let forced = self.forces.iter().enumerate();
                let forced = forced.flat_map(|(task, of)| of.iter().map(move |f| (task, f)));
                let matches = |forces: &[ForceRecord]| {
                    forces.first().is_some_and(|forced| pattern.matches(&forced.name))
                };
                let forced = forced.filter(|(_, (_, forces))| matches(forces));
                forced.map(|(task, (slot, _))| (task, *slot)).collect()
            } else {
                let Some(signal) = check.find(name) else { continue };
                let slot = signal.slot as u32;
                let of_task = self.forces.get(signal.task);
                let is_forced = of_task.is_some_and(|of| of.contains_key(&slot));
                is_forced.then_some((signal.task, slot)).into_iter().collect()
            };
            let of_none = unmatched.next_if(|finding| finding.name == name);
            if found.is_empty() && !Pattern::is_glob(name) {
                let message = format!("\"{name}\" is not forced");
                let help = "name a signal that is; `forces` lists them";
                check.refuse(Refusal::one(Code::NotWritable, name, message, help));
            } else if found.is_empty()
                && let Some(finding) = of_none
            {
                check.refuse(Refusal::of(Code::UnknownName, vec![finding]));
            }
            found.into_iter().for_each(|(task, slot)| slots.entry(task).or_default().push(slot));
        }
        let at = self.check_at(&mut check, &request, slots.keys().copied(), next);
        check.end()?;
        let work = |(task, slots): (usize, Vec<u32>)| {
            let of_task = self.forces.get(task);
            let forces = slots.iter().filter_map(|slot| of_task?.get(slot)).map(Vec::len).sum();
            (task, Work::release(slots, forces))
        };
        let orders = slots.into_iter().map(work).collect();
        Ok(prepared(orders, request, Kind::Release, Vec::new(), at).due(at, next))
    }

    /// Prepares to read signals, which must have been selected from [the current index](Selection::is_of).
    pub fn read(&self, selection: Selection) -> PreparedRequest {
        debug_assert!(selection.is_of(&self.signals), "they are of another configuration");
        let mut slots: BTreeMap<usize, Vec<ReadSlot>> = BTreeMap::new();
        for (task, slot) in &selection.page {
            slots.entry(*task).or_default().push(self.read_slot(*task, *slot as u32));
        }
        // While another configuration is on its way, its slots may be asked for instead.
        let behind = match self.next_plan {
            None => selection.behind,
            Some(_) => BTreeMap::new(),
        };
        let work = |(task, slots): (usize, Vec<_>)| {
            let evidence = behind.get(&task).map(|behind| Box::new(behind.evidence()));
            (task, Work::Read { values: slots.into(), evidence })
        };
        let read_from = selection.page.iter().map(|(task, _)| *task).collect();
        let orders = slots.into_iter().map(work).collect();
        let prepared = prepared(orders, RequestTerms::default(), Kind::Read, Vec::new(), None);
        PreparedRequest { read_from, behind, ..prepared }
    }

    /// Where a value is read that is named as in the configuration before a change that is on its way.
    fn read_slot(&self, task: usize, slot: u32) -> ReadSlot {
        let Some(next) = &self.next_plan else {
            return ReadSlot { slot, moved: ReadSlot::GONE, value: 0.0 };
        };
        let moved = next.slot(task, slot).unwrap_or(ReadSlot::GONE);
        let slot = if next.has_returned(task) { moved } else { slot };
        ReadSlot { slot, moved, value: 0.0 }
    }

    /// Whether this client can set a signal at all.
    fn settable(&self, signal: &Signal<'_>, request: &RequestTerms) -> Result<(), Refusal> {
        let name = &signal.name;
        let (message, help) = match signal.role {
            Role::Variable | Role::Parameter => return Ok(()),
            Role::Input => {
                let service = signal.service.filter(|_| self.feeds == Feeds::Services);
                match service {
                    None if !request.is_remote => return Ok(()),
                    None => (
                        format!(
                            "\"{name}\" is an input, which the program that runs the node gives"
                        ),
                        "have the program give it, or force it".into(),
                    ),
                    Some(service) => (
                        format!("\"{name}\" is an input, which is read from service \"{service}\""),
                        "publish the value there, or force it".into(),
                    ),
                }
            }
            Role::Wired => {
                let signals = self.signals_of(signal.task);
                let source = signals.source_name(signal.task, signal.slot).unwrap_or_default();
                (
                    format!("\"{name}\" is wired to \"{source}\", which would write over it"),
                    format!("set what \"{source}\" is computed from, or force the pin"),
                )
            }
            Role::Output => (
                format!("\"{name}\" is an output pin, which its block computes"),
                "set an input pin of the block, or force it".into(),
            ),
            Role::Ok => (worth(name), "force it".into()),
            Role::Age => {
                (worth(name), "it counts by itself; force the input, or its \".ok\"".to_owned())
            }
        };
        Err(Refusal::one(Code::NotWritable, name, message, help))
    }

    /// Whether a signal exists and can be written, whichever engine its task has when it applies the request.
    pub(super) fn check_stays(&self, signal: &Signal<'_>) -> Result<(), Refusal> {
        let Some(next) = self.next_of(signal.task) else { return Ok(()) };
        let slot = next.slot(signal.task, signal.slot as u32);
        let moved = slot.and_then(|slot| next.signals.at(signal.task, slot as usize));
        let is_it = |moved: Signal<'_>| moved.role == signal.role;
        moved.is_some_and(is_it).then_some(()).ok_or_else(|| next.refusal())
    }

    /// As [`check_stays`](Self::check_stays), and whether a configuration on its way keeps the value that is set.
    pub(super) fn check_not_given(&self, signal: &Signal<'_>) -> Result<(), Refusal> {
        self.check_stays(signal)?;
        let Some(next) = self.next_of(signal.task) else { return Ok(()) };
        let slot = next.slot(signal.task, signal.slot as u32);
        let is_given = slot.is_some_and(|slot| next.gives(signal.task, slot));
        if is_given { Err(next.refusal()) } else { Ok(()) }
    }

    /// The slot of a value, if the signal can have it, also in a configuration on its way to its task.
    pub(super) fn allowed(&self, signal: &Signal<'_>, value: &Written) -> Result<f64, Refusal> {
        let value = self.signals.value_of(signal, value)?;
        if let Value::Task { period_ns } = value
            && self.signals.task_of_period(period_ns).is_none()
        {
            return Err(wrong_value(&signal.name, value, signal.value_type));
        }
        let mut slots = self.permissions_of(signal.task).map(|of| of.slot(signal, value));
        let first = slots.next().unwrap_or_else(|| self.permissions.slot(signal, value))?;
        slots.try_fold(first, |_, slot| slot)
    }

    /// How many cycles of a task a force lasts; `None`: until it is released.
    pub fn cycles(&self, task: usize, hold: Hold) -> Option<u64> {
        let Hold::Seconds(seconds) = hold else { return None };
        let period_ns = self.signals.task(task).map_or(1, |task| task.period_ns);
        Some(((seconds * 1e9 / period_ns as f64).round() as u64).max(1))
    }

    /// Warnings about errors that blocks will report with new values at their pins.
    pub(super) fn warn(&self, stores: &BTreeMap<usize, Vec<Store>>) -> Vec<ValueWarning> {
        let mut warnings = Vec::new();
        for (task, stores) in stores {
            let new: HashMap<u32, f64> = stores.iter().map(|s| (s.slot, s.value)).collect();
            let value = |slot: u32| {
                let held = || self.values.get(&(*task, slot)).map(|held| held.value);
                new.get(&slot).copied().or_else(held)
            };
            let slots = || stores.iter().map(|store| store.slot as usize);
            let signals = self.signals_of(*task);
            warnings.extend(self.warnings.of_instances(signals, *task, slots(), value));
            warnings.extend(Warnings::of_latches(signals, *task, slots(), value));
        }
        warnings
    }

    /// As [`warn`](Self::warn), and warnings about new values that a force keeps from their blocks.
    pub(super) fn warn_of_set(&self, stores: &BTreeMap<usize, Vec<Store>>) -> Vec<ValueWarning> {
        let forced = self.forced_among(stores).map(|name| ValueWarning::Forced { name });
        forced.chain(self.warn(stores)).collect()
    }

    /// The names of signals that are forced, or about to be.
    fn forced_among(&self, stores: &BTreeMap<usize, Vec<Store>>) -> impl Iterator<Item = String> {
        let all = stores.iter().flat_map(|(task, of)| of.iter().map(move |store| (*task, store)));
        all.filter_map(|(task, store)| {
            self.forces.get(task)?.get(&store.slot)?;
            Some(self.signal_at(task, store.slot)?.name)
        })
    }
}

/// The refusal to set `ok` or `age` of an input.
fn worth(name: &str) -> String {
    format!("\"{name}\" tells what the value of an input is worth, so it cannot be set")
}

pub(super) fn prepared(
    work: Vec<(usize, Work)>,
    request: RequestTerms,
    kind: Kind,
    warnings: Vec<ValueWarning>,
    at: Option<u64>,
) -> PreparedRequest {
    let order = |(task, work)| (task, Order::new(at, work));
    let orders = work.into_iter().map(order).collect();
    let (due, behind) = (BTreeMap::new(), BTreeMap::new());
    PreparedRequest { orders, request, kind, due, warnings, read_from: Vec::new(), behind }
}

impl PreparedRequest {
    /// Makes the request due in cycle `at`, or in the next cycle of each task: `next` as with [`Operator::set`].
    pub(super) fn due(self, at: Option<u64>, next: &[u64]) -> Self {
        let cycle = |task| at.or(next.get(task).copied()).unwrap_or_default();
        let due = self.tasks().map(|task| (task, cycle(task))).collect();
        Self { due, ..self }
    }
}

pub(super) fn sorted(stores: Option<Vec<Store>>) -> Box<[Store]> {
    let mut stores = stores.unwrap_or_default();
    stores.sort_unstable_by_key(|store| store.slot);
    stores.into()
}

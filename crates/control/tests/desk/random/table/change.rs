//! Other entries for a reference.

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use super::rows::{Kind, Row, instances, rows, source};
use super::{Reference, Values};
use isochrone_testing::graphs::Entry;

/// Other entries for a node, which each task has from a cycle on.
pub(super) struct Change {
    pub(super) entries: Rc<Vec<Entry>>,
    pub(super) at: [u64; 2],
    pub(super) is_done: [bool; 2],
}

impl Reference {
    /// Whether other entries may take the place of these.
    pub(crate) fn may_change(&self, new: &[Entry]) -> bool {
        self.waiting.iter().all(Vec::is_empty)
            && self.forces.keys().all(|name| self.is_kept(name, new))
    }

    /// Whether a signal is one of an instance of the same name, type and task.
    fn is_kept(&self, name: &str, new: &[Entry]) -> bool {
        let task = self.task_of(name);
        let Some((instance, _)) = name.rsplit_once('.') else { return true };
        let block_type = |entries: &[Entry]| {
            let mut all = instances(entries, task).into_iter();
            all.find(|(.., known)| known == instance).map(|(e, ..)| entries[e].block_type.name)
        };
        block_type(&self.entries[task]).is_some_and(|known| block_type(new) == Some(known))
    }

    /// Whether a signal is one of the same kind, whichever entries its task goes by when a request comes
    /// to it; `is_set`: and those on their way do not say what it is.
    pub(crate) fn stays(&self, name: &str, is_set: bool) -> bool {
        let task = self.task_of(name);
        let Some(change) = self.change.as_ref().filter(|change| !change.is_done[task]) else {
            return true;
        };
        let row = |rows: &[Row]| rows.iter().find(|row| row.name == name).cloned();
        let rows = row(&self.rows[task]).zip(row(&rows(&change.entries, task)));
        self.is_kept(name, &change.entries)
            && rows.is_some_and(|(old, new)| {
                let is_left = old.initial.to_bits() == new.initial.to_bits();
                old.kind == new.kind && (is_left || !is_set)
            })
    }

    /// Whether a task goes by the entries that are on their way to the other one.
    pub(crate) fn is_ahead(&self, task: usize) -> bool {
        self.change.as_ref().is_some_and(|change| change.is_done[task])
    }

    pub(crate) fn change(&mut self, entries: Rc<Vec<Entry>>, at: [u64; 2]) {
        self.change = Some(Change { entries, at, is_done: [false; 2] });
    }

    /// Hands a task over to its new entries, if it is to have them at a cycle.
    pub(crate) fn hand_over(&mut self, task: usize, cycle: u64) {
        let Some(mut change) = self.change.take() else { return };
        if cycle >= change.at[task] && !change.is_done[task] {
            change.is_done[task] = true;
            let other = 1 - task;
            let has_other = change.is_done[other];
            // What the other one reads until it changes is what this one has left; then it is what is
            // handed over.
            let left = (!has_other).then(|| self.finished[task].clone());
            let known = (!has_other).then(|| self.seen_after(task, &change.entries));
            self.enter(task, change.entries.clone());
            self.frozen[task] = known;
            self.frozen[other] = left;
        }
        self.change = Some(change).filter(|change| change.is_done != [true; 2]);
    }

    /// What a task with new entries knows of the other one, which has the old ones still.
    fn seen_after(&self, task: usize, new: &[Entry]) -> Values {
        let other = 1 - task;
        let mut seen: Values =
            rows(new, other).into_iter().map(|row| (row.name, row.initial)).collect();
        let entries = &self.entries[task];
        for (entry, instance, _) in instances(entries, task) {
            for at in &entries[entry].pins {
                if let Some((name, from, _)) = source(entries, task, instance, *at)
                    && from == other
                    && self.is_kept(&name, new)
                {
                    let value = self.seen(task, other, &name);
                    seen.insert(name, value);
                }
            }
        }
        seen
    }

    /// What a task reads of a value that is not of its own cycle.
    pub(super) fn seen(&self, task: usize, from: usize, name: &str) -> f64 {
        let frozen = self.frozen[task].as_ref().filter(|_| from != task);
        frozen.unwrap_or(&self.finished[from])[name]
    }

    fn enter(&mut self, task: usize, entries: Rc<Vec<Entry>>) {
        let before: HashMap<String, Row> =
            self.rows[task].iter().map(|row| (row.name.clone(), row.clone())).collect();
        let after = rows(&entries, task);
        let kept: HashSet<String> = after
            .iter()
            .filter(|row| before.contains_key(&row.name) && self.is_kept(&row.name, &entries))
            .map(|row| row.name.clone())
            .collect();
        for gone in before.keys().filter(|name| !kept.contains(*name)) {
            self.given.remove(gone);
            self.now.remove(gone);
            self.lose(gone);
        }
        for row in &after {
            let known = before.get(&row.name).filter(|_| kept.contains(&row.name));
            if known.is_none() {
                self.now.insert(row.name.clone(), row.initial);
            }
            let is_given = known.is_some_and(|known| match (known.kind, row.kind) {
                (Kind::Parameter, Kind::Parameter) => {
                    known.initial.to_bits() == row.initial.to_bits()
                }
                (known, now) => known == now && now != Kind::Wired,
            });
            if !is_given {
                self.given.insert(row.name.clone(), row.initial);
                self.lose(&row.name);
            }
            // What no cycle computes shows what it was given.
            let is_forced = self.forces.contains_key(&row.name);
            if row.kind == Kind::Parameter && !is_forced {
                self.now.insert(row.name.clone(), self.given[&row.name]);
            }
        }
        let mut states = HashMap::new();
        for (index, _, name) in instances(&entries, task) {
            let words = entries[index].block_type.state_words;
            let known = self.states.get(&name).filter(|_| {
                kept.contains(&format!("{name}.{}", entries[index].block_type.outputs[0].name))
            });
            states.insert(name, known.cloned().unwrap_or_else(|| vec![0; words]));
        }
        let own: HashSet<String> =
            instances(&self.entries[task], task).into_iter().map(|(.., name)| name).collect();
        self.states.retain(|name, _| !own.contains(name));
        self.states.extend(states);
        (self.rows[task], self.entries[task]) = (after, entries);
        self.finished[task] = self.now.clone();
    }

    /// Forgets what was set.
    pub(super) fn lose(&mut self, name: &str) {
        let history = self.history.remove(name).into_iter().flatten();
        self.lost.extend(history.map(|(number, _)| number));
    }
}

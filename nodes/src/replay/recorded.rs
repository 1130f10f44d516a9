//! The parts of a recording beside its rows: read first, as what was done before a cycle may stand
//! behind its row.

use std::collections::BTreeMap;
use std::path::Path;

use isochrone_control::desk::Replay;
use isochrone_engine::Plan;
use isochrone_model::{Action, Entry};
use isochrone_processes::Stop;
use isochrone_recording::{FileCondition, Item, MAX_RECORD_BYTES, Mark, RecordedNode};
use isochrone_runtime::journal::entry_of_line;
use isochrone_runtime::state::NodeState;
use isochrone_timing::units::counted;

use crate::base::failure::Failure;
use crate::base::mcap_file::{Gaps, lack, open, unreadable, warn_of_damage};
use crate::base::terminal;
use crate::replay::operations::{Operations, Tally};

/// A recording of a node, but for its rows.
pub(super) struct Recorded {
    pub(super) node: RecordedNode,
    pub(super) configuration: Option<String>,
    /// The state that the run went on with.
    pub(super) state_before: Option<NodeState>,
    /// Lines of the journal, in order.
    lines: Vec<String>,
    /// Of each task, by name, in the order of its appearance: the rows that were lost at its end.
    tasks: Vec<(String, Option<Lost>)>,
    pub(super) condition: FileCondition,
    pub(super) gaps: Gaps,
}

/// Rows that were lost, and none came after them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lost {
    pub(super) count: u64,
}

impl Recorded {
    /// Reads a recording once.
    ///
    /// # Errors
    /// It is not a recording of a node, it cannot be read, or the replay should stop.
    pub(super) fn read(path: &Path, stop: &Stop) -> Result<Self, Failure> {
        let file = path.display();
        let mut reader = open(path)?;
        let (mut configuration, mut lines, mut bytes) = (None, Vec::new(), 0);
        let mut tasks: Vec<(String, Option<Lost>)> = Vec::new();
        let mut state_before = None;
        let (mut frames, mut gaps) = (0_u64, Gaps::default());
        while let Some(item) = reader.next_item().map_err(|error| unreadable(path, &error))? {
            if stop.is_due() {
                return Err(Failure::inconclusive(format!(
                    "the replay was stopped while it first read {file}; nothing was compared"
                )));
            }
            gaps.note(&item);
            match item {
                Item::Row(row) => {
                    let name = &row.layout.task;
                    match tasks.iter_mut().find(|(task, _)| task == name) {
                        // The head of this row repeats it.
                        Some((_, lost)) => *lost = None,
                        None => tasks.push((name.clone(), None)),
                    }
                }
                Item::Entry(entry) => {
                    bytes += entry.line.len();
                    if bytes > MAX_RECORD_BYTES {
                        return Err(Failure::usage(format!(
                            "the journal in {file} has over {} MiB, so it is none of a node",
                            MAX_RECORD_BYTES >> 20
                        )));
                    }
                    lines.push(entry.line);
                }
                Item::Configuration(text) => {
                    configuration.get_or_insert(text);
                }
                Item::Mark(mark) if mark.kind == Mark::LOST => {
                    let task = mark.service.rsplit('/').next().unwrap_or_default();
                    let now = Some(Lost { count: mark.count });
                    match tasks.iter_mut().find(|(name, _)| name == task) {
                        Some((_, lost)) => *lost = now,
                        // All of its rows.
                        None => tasks.push((task.to_owned(), now)),
                    }
                }
                Item::State(bytes) => {
                    let state = NodeState::of_bytes(&bytes).map_err(|damage| {
                        Failure::usage(format!(
                            "the state that the run went on with cannot be read from {file}: {damage}"
                        ))
                    })?;
                    state_before.get_or_insert(state);
                }
                Item::Mark(_) => {}
                Item::Frame(_) => frames += 1,
            }
        }
        let condition = reader.condition().clone();
        let none = |what: String| {
            warn_of_damage(path, &condition);
            Err(Failure::usage(what))
        };
        let Some(node) = reader.node().cloned() else {
            return none(match (frames, reader.other_messages()) {
                (0, 0) => format!("{file} has neither cycles of a node nor frames"),
                (0, others) => format!(
                    "{file} has no cycles of a node, only {} of another program; replay what `isochrone run \
                     --record` wrote",
                    counted(others, "message")
                ),
                (frames, _) => format!(
                    "{file} is a recording of services ({}), without the inputs and the configuration of a \
                     node; publish it again with `isochrone publish --from {file}`, or record the node itself \
                     with `isochrone run --record`",
                    counted(frames, "frame")
                ),
            });
        };
        if tasks.is_empty() {
            return none(format!("{file} has no cycle of \"{}\"", node.name));
        }
        Ok(Self { node, configuration, state_before, lines, tasks, condition, gaps })
    }

    /// The journal entries of the run, for a plan.
    ///
    /// # Errors
    /// An entry does not fit the plan.
    pub(super) fn operations(&self, plan: &Plan) -> Result<Operations, String> {
        let mut replay = Replay::new(plan);
        let mut entries: BTreeMap<_, Vec<Entry>> = BTreeMap::new();
        for (number, line) in (1_u64..).zip(&self.lines) {
            let at = |why: String| format!("entry {number} of the recorded journal: {why}");
            let (task, entry) = entry_of_line(line, plan).map_err(at)?;
            replay.check(&entry).map_err(|refusals| at(refusals.to_string()))?;
            entries.entry((task, entry.cycle)).or_default().push(entry);
        }
        Ok(Operations::new(plan, entries))
    }

    /// The journal entries of the run that can be applied to another plan, and those that cannot.
    pub(super) fn operations_for_other(&self, plan: &Plan) -> (Operations, Tally, u64) {
        let mut replay = Replay::new(plan);
        let mut entries: BTreeMap<_, Vec<Entry>> = BTreeMap::new();
        let (mut unfit, mut changes) = (Tally::default(), std::collections::BTreeSet::new());
        for line in &self.lines {
            let (task, entry) = match entry_of_line(line, plan) {
                Ok(entry) => entry,
                Err(why) => {
                    unfit.add(|| why);
                    continue;
                }
            };
            if entry.action == Action::Apply {
                changes.insert(entry.transaction);
                continue;
            }
            match replay.check(&entry) {
                Ok(()) => entries.entry((task, entry.cycle)).or_default().push(entry),
                Err(refusals) => unfit.add(|| refusals.to_string()),
            }
        }
        (Operations::new(plan, entries), unfit, changes.len() as u64)
    }

    /// The rows that were lost at the end of a task.
    pub(super) fn lost_at_end(&self, task: &str) -> Option<Lost> {
        self.tasks.iter().find(|(name, _)| name == task)?.1
    }

    /// Prints remarks on the file.
    pub(super) fn note(&self, path: &Path) {
        if let Some(lack) = lack(path, &self.condition, &self.gaps) {
            terminal::note(&format!("note: {lack}"));
        }
        let (version, own) = (&self.node.version, env!("CARGO_PKG_VERSION"));
        if version != own {
            terminal::note(&format!(
                "warning: the run was made by version {version}, and this is {own}; what blocks compute may \
                 differ"
            ));
        }
    }
}

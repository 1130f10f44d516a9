//! A run that is repeated: what its journal says was done and missed.

use std::path::Path;

use isochrone_engine::{Plan, Source, TaskEngine};
use isochrone_runtime::journal::{JournalFile, JournaledRun, Missed, Unclear};
use isochrone_timing::units::counted;

use super::{Args, entering};
use crate::failure::Failure;
use crate::operations::{Operations, Tally};
use crate::terminal;

/// What was done and missed in a run.
pub(super) struct Past {
    operations: Operations,
    /// Of each task its missed cycles, in order: first and last.
    missed: Vec<Vec<(u64, u64)>>,
    /// Cycles without a row of inputs.
    unrecorded: Tally,
}

impl Past {
    /// Reads a run of a journal; without a number, the last. Notes what is to be known of it.
    pub(super) fn read(path: &Path, run: Option<u64>, plan: &Plan) -> Result<Self, Failure> {
        let file = JournalFile::read_run(path, run).map_err(Failure::usage)?;
        let run = file.run(run).map_err(Failure::usage)?;
        let entries = file.entries(run, plan).map_err(Failure::usage)?;
        note_run(path, &file, run, plan);
        let mut missed = vec![Vec::new(); plan.tasks.len()];
        for range in &run.missed {
            let Missed { task, first, last } = &range.content;
            let of_task = plan.task_index(task).and_then(|task| missed.get_mut(task));
            of_task.into_iter().for_each(|ranges| ranges.push((*first, *last)));
        }
        missed.iter_mut().for_each(|ranges| ranges.sort_unstable());
        let operations = Operations::new(plan, entries);
        Ok(Self { operations, missed, unrecorded: Tally::default() })
    }

    /// Whether a cycle did not run.
    pub(super) fn is_missed(&self, task: usize, cycle: u64) -> bool {
        let Some(ranges) = self.missed.get(task) else { return false };
        let before = ranges.partition_point(|(first, _)| *first <= cycle);
        before.checked_sub(1).is_some_and(|range| ranges[range].1 >= cycle)
    }

    /// Does what was done before a cycle.
    pub(super) fn apply(&mut self, task: usize, cycle: u64, engine: &mut TaskEngine) {
        self.operations.apply(task, cycle, engine);
    }

    /// Notes that the recorded inputs have no row for a cycle of a task.
    pub(super) fn note_unrecorded(&mut self, task: usize, cycle: u64) {
        if !self.is_missed(task, cycle) {
            self.unrecorded.add(|| cycle.to_string());
        }
    }

    /// Says what in the simulation was not as in the run.
    pub(super) fn note_end(&self) {
        let left = self.operations.left();
        if left > 0 {
            terminal::note(&format!(
                "note: changes of the run outside of the simulated cycles: {left}"
            ));
        }
        let Tally { count, first } = &self.unrecorded;
        if *count > 0 {
            let cycles = counted(*count, "cycle");
            terminal::note(&format!(
                "note: the inputs have no row for {cycles}, which read the row before; the first: {first}"
            ));
        }
        let Tally { count, first } = &self.operations.differences;
        if *count > 0 {
            let values = counted(*count, "value");
            terminal::note(&format!(
                "warning: {values} differed from the run, so its inputs are not those of the run; the \
                 first: {first}"
            ));
        }
    }
}

/// The configuration that a journal keeps of a run.
pub(super) fn recorded(path: &Path, args: &Args) -> Result<Source, Failure> {
    let file = JournalFile::read_run(path, args.run).map_err(Failure::usage)?;
    let header = &file.run(args.run).map_err(Failure::usage)?.header.content;
    let text = header.configuration.as_deref().ok_or_else(|| {
        let (path, run) = (path.display(), header.run);
        Failure::usage(format!(
            "{path} does not keep the configuration of run {run}: version {} of isochrone wrote it; leave \
             out --recorded and give the file as it was then",
            header.version
        ))
    })?;
    Ok(Source::new(args.file.display().to_string(), text))
}

/// Says which run is repeated, and for which tasks it is exact.
fn note_run(path: &Path, file: &JournalFile, run: &JournaledRun, plan: &Plan) {
    let (path, header) = (path.display(), &run.header.content);
    if let Some(line) = file.cut_line {
        terminal::note(&format!(
            "note: {path}:{line}: the last line is incomplete and left out: the node was killed"
        ));
    }
    if header.version != env!("CARGO_PKG_VERSION") {
        terminal::note(&format!(
            "warning: run {} was made by version {}, and this is {}; what blocks compute may differ",
            header.run,
            header.version,
            env!("CARGO_PKG_VERSION")
        ));
    }
    let changes = counted(run.entries.len() as u64, "change");
    let length = |range: &Missed| range.last.saturating_sub(range.first).saturating_add(1);
    let missed = run.missed.iter().map(|range| length(&range.content));
    let missed = counted(missed.fold(0, u64::saturating_add), "missed cycle");
    let applied = run.entries.iter().filter_map(|entry| entry.content.configuration.as_deref());
    let exact = entering::note(plan, &entering::of(plan, &applied.collect()));
    terminal::note(&format!("note: run {} of {path}: {changes}, {missed}{exact}", header.run));
    if run.end.is_none() {
        let last = match run.entries.last() {
            Some(entry) => format!(
                "its last change is that of cycle {} of task \"{}\"",
                entry.content.cycle, entry.content.task
            ),
            None => "it has no change".into(),
        };
        terminal::note(&format!(
            "note: {path}:{}: run {} has no end: the node was killed, could not write more, or still \
             runs; {last}",
            run.last_line(),
            header.run
        ));
    }
    for range in &run.unclear {
        let Unclear { task, first, last, missed } = &range.content;
        terminal::note(&format!(
            "warning: {path}:{}: {missed} of cycles {first} to {last} of task \"{task}\" were missed, and \
             it is not known which; the simulation runs them all",
            range.line
        ));
    }
}

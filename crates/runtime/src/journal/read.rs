//! Reading a journal file.

use std::collections::BTreeMap;
use std::path::Path;

use isochrone_engine::Plan;
use isochrone_engine::operate::{Entry, Replay};

use super::error::JournalError;
use super::line::{Line, Missed, RunEnd, RunHeader, Unclear};
use super::lines::{JournalLines, without_place};
use crate::control::JournalEntry;

/// A journal file that was read.
#[derive(Debug, Default)]
pub struct JournalFile {
    path: String,
    /// Its runs that were read, in the order in which they were written.
    pub runs: Vec<JournaledRun>,
    /// Least and greatest number of a run in it.
    numbers: Option<(u64, u64)>,
    /// Line of an incomplete last line, from 1: the node was killed while it wrote.
    pub cut_line: Option<usize>,
}

/// A run of a node, as its journal tells.
#[derive(Debug, Clone)]
pub struct JournaledRun {
    /// What it is of.
    pub header: Numbered<RunHeader>,
    /// What was done, in order.
    pub entries: Vec<Numbered<JournalEntry>>,
    /// Ranges of cycles that did not run.
    pub missed: Vec<Numbered<Missed>>,
    /// Ranges of cycles of which some did not run.
    pub unclear: Vec<Numbered<Unclear>>,
    /// Its end. `None`: the node was killed, could not write to its end, or still runs.
    pub end: Option<Numbered<RunEnd>>,
}

impl JournaledRun {
    /// The last line that the file has of it, from 1.
    pub fn last_line(&self) -> usize {
        let of = |lines: Option<usize>| lines.unwrap_or_default();
        [
            self.header.line,
            of(self.entries.last().map(|one| one.line)),
            of(self.missed.last().map(|one| one.line)),
            of(self.unclear.last().map(|one| one.line)),
            of(self.end.as_ref().map(|one| one.line)),
        ]
        .into_iter()
        .fold(0, usize::max)
    }
}

/// Which runs of a file are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Wanted {
    All,
    /// The last of a number; `None`: of all.
    One(Option<u64>),
}

/// What stands in a line.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbered<T> {
    /// The line, from 1.
    pub line: usize,
    /// What stands there.
    pub content: T,
}

impl JournalFile {
    /// Reads all runs of a file.
    ///
    /// # Errors
    /// It cannot be read, is no journal, is of another format, or has no runs.
    pub fn read(path: &Path) -> Result<Self, JournalError> {
        Self::read_those(path, Wanted::All)
    }

    /// Reads one run of a file, the one of a number or the last, and keeps nothing of the others: a file
    /// may have months of them.
    ///
    /// # Errors
    /// As [`read`](Self::read) and [`run`](Self::run).
    pub fn read_run(path: &Path, number: Option<u64>) -> Result<Self, JournalError> {
        let file = Self::read_those(path, Wanted::One(number))?;
        file.run(number)?;
        Ok(file)
    }

    fn read_those(path: &Path, wanted: Wanted) -> Result<Self, JournalError> {
        let mut file = Self { path: path.display().to_string(), ..Self::default() };
        let mut is_wanted = false;
        let mut lines = JournalLines::open(path)?;
        for next in &mut lines {
            let (line, content) = next?;
            if let Line::Run(header) = &content {
                let number = header.run;
                let (first, last) = file.numbers.unwrap_or((number, number));
                file.numbers = Some((first.min(number), last.max(number)));
                is_wanted = match wanted {
                    Wanted::All => true,
                    Wanted::One(one) => one.is_none_or(|one| one == number),
                };
                if is_wanted && wanted != Wanted::All {
                    file.runs.clear();
                }
            }
            let run = file.runs.last_mut();
            match (content, run) {
                _ if !is_wanted => {}
                (Line::Run(header), _) => file.runs.push(JournaledRun {
                    header: Numbered { line, content: header },
                    entries: Vec::new(),
                    missed: Vec::new(),
                    unclear: Vec::new(),
                    end: None,
                }),
                (Line::Entry(content), Some(run)) => run.entries.push(Numbered { line, content }),
                (Line::Missed(content), Some(run)) => run.missed.push(Numbered { line, content }),
                (Line::Unclear(content), Some(run)) => run.unclear.push(Numbered { line, content }),
                (Line::End(content), Some(run)) => run.end = Some(Numbered { line, content }),
                // The first line is that of a run.
                (_, None) => {}
            }
        }
        file.cut_line = lines.cut_line();
        Ok(file)
    }

    /// The run of a number; `None`: the last.
    ///
    /// # Errors
    /// There is none of this number.
    pub fn run(&self, number: Option<u64>) -> Result<&JournaledRun, JournalError> {
        let of_number =
            |run: &&JournaledRun| number.is_none_or(|number| run.header.content.run == number);
        let (first, last) = self.numbers.unwrap_or_default();
        self.runs.iter().rev().find(of_number).ok_or_else(|| JournalError::NoRun {
            path: self.path.clone(),
            run: number.unwrap_or_default(),
            first,
            last,
        })
    }

    /// What was done in a run to the tasks of its configuration, by task and cycle, in order.
    ///
    /// # Errors
    /// The run is of another configuration, or an entry does not fit it.
    pub fn entries(
        &self,
        run: &JournaledRun,
        plan: &Plan,
    ) -> Result<BTreeMap<(usize, u64), Vec<Entry>>, JournalError> {
        let sha256 = plan.source.sha256();
        let Numbered { line, content: header } = &run.header;
        if header.sha256 != sha256 {
            return Err(JournalError::OtherConfiguration {
                path: self.path.clone(),
                line: *line,
                header: Box::new(header.clone()),
                found: plan.source.name.clone(),
                sha256,
            });
        }
        if header.is_cut {
            let (path, line, run) = (self.path.clone(), *line, header.run);
            return Err(JournalError::Cut { path, line, run });
        }
        let mut replay = Replay::new(plan);
        let mut entries: BTreeMap<_, Vec<Entry>> = BTreeMap::new();
        for Numbered { line, content } in &run.entries {
            let bad =
                |reason| JournalError::BadLine { path: self.path.clone(), line: *line, reason };
            let entry = to_entry(content, plan).map_err(bad)?;
            replay.check(&entry).map_err(|refusals| JournalError::Unfit {
                path: self.path.clone(),
                line: *line,
                refusals,
            })?;
            entries.entry((entry.task, entry.cycle)).or_default().push(entry);
        }
        Ok(entries)
    }
}

/// What one line of a journal file says was done to a task of a plan.
///
/// # Errors
/// It is no line that a node of this version can have written of an entry of this plan; why, as part of a
/// sentence.
pub fn entry_of_line(line: &str, plan: &Plan) -> Result<Entry, String> {
    match serde_json::from_str(line) {
        Ok(Line::Entry(content)) => to_entry(&content, plan),
        Ok(_) => Err("a line that is no entry".into()),
        Err(error) => Err(without_place(&error.to_string())),
    }
}

fn to_entry(content: &JournalEntry, plan: &Plan) -> Result<Entry, String> {
    let task = plan.task_index(&content.task);
    content.to_entry(task.ok_or_else(|| format!("there is no task \"{}\"", content.task))?)
}

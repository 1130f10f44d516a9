//! Suggestions for names that do not exist, made once all diagnostics are known: comparing a name with every other is
//! the most expensive part of checking a wrong file.

use std::cell::OnceCell;

use super::names::Names;
use crate::Diagnostic;
use crate::diagnostic::Among;
use crate::diagnostics::MOST_SHOWN;
use crate::nearest::KnownNames;

/// Comparisons that are spent on diagnostics beyond those that are shown.
const COMPARISONS: usize = 200_000;

/// The names of one kind and their list.
struct Candidates<'a> {
    known: KnownNames<'a>,
    listing: String,
}

impl<'a> Candidates<'a> {
    fn new(names: impl IntoIterator<Item = &'a str>) -> Self {
        let known = KnownNames::new(names.into_iter().filter(|name| !name.is_empty()));
        Self { listing: known.listing(), known }
    }
}

impl Names<'_> {
    /// Gives help to the diagnostics about names that do not exist. Beyond the first ones of a file, and
    /// beyond a bound on the work, that is the list of names instead of the nearest.
    pub(super) fn suggest(&self, diagnostics: &mut [Diagnostic]) {
        diagnostics.sort_by_key(|diagnostic| diagnostic.span.start);
        let (tasks, inputs, blocks) = (OnceCell::new(), OnceCell::new(), OnceCell::new());
        let (tasks_and_inputs, inputs_and_blocks) = (OnceCell::new(), OnceCell::new());
        let task_names = || self.tasks.iter().map(|task| task.name);
        let block_names = || self.entries.iter().map(|entry| entry.name);
        let mut spent = 0;
        for (position, diagnostic) in diagnostics.iter_mut().enumerate() {
            let Some((written, among)) = diagnostic.sought.take().map(|sought| *sought) else {
                continue;
            };
            let candidates = match among {
                Among::Tasks => tasks.get_or_init(|| Candidates::new(task_names())),
                Among::Inputs => inputs.get_or_init(|| Candidates::new(self.values_in_order())),
                Among::Blocks => blocks.get_or_init(|| Candidates::new(block_names())),
                Among::TasksAndInputs => tasks_and_inputs
                    .get_or_init(|| Candidates::new(task_names().chain(self.values_in_order()))),
                Among::InputsAndBlocks => inputs_and_blocks.get_or_init(|| {
                    Candidates::new(self.values_in_order().into_iter().chain(block_names()))
                }),
            };
            spent += candidates.known.len();
            // What stands behind a dot is of the name before it.
            let (base, rest) = written.split_at(written.find('.').unwrap_or(written.len()));
            let is_compared = position < MOST_SHOWN || spent <= COMPARISONS;
            let near = is_compared.then(|| candidates.known.nearest(base)).flatten();
            let help = match near {
                Some(near) => format!("did you mean \"{near}{rest}\"?"),
                None => candidates.listing.clone(),
            };
            *diagnostic = diagnostic.clone().help(help);
        }
    }
}

//! Signals that a request names, to be read.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::check::Check;
use crate::operate::Pattern;
use crate::operate::quality::Behind;
use crate::operate::refusal::Refusals;
use crate::operate::signals::{Signal, Signals};

/// Names that are looked at while others wait.
const AT_ONCE: usize = 5000;

/// Signals that a request names, each once and in its order, or a page of them.
///
/// Looking for the names of a large node takes milliseconds. It needs the index of the names alone, so
/// whoever shares an [`Operator`](super::Operator) need not hold it meanwhile.
#[derive(Debug)]
pub struct Selection {
    pub(super) signals: Arc<Signals>,
    /// Tasks and slots.
    pub(super) page: Vec<(usize, usize)>,
    /// For each task what its signals are computed from, where that is not too much to look through.
    pub(super) behind: BTreeMap<usize, Behind>,
    total: usize,
}

impl Selection {
    /// Looks for names, which may be patterns. Those from `offset` on are in the page, at most `limit`.
    ///
    /// # Errors
    /// A name, or pattern, is of no signal, or the patterns are compared with too many.
    pub fn of<'n>(
        signals: &Arc<Signals>,
        names: impl IntoIterator<Item = &'n str>,
        offset: usize,
        limit: usize,
    ) -> Result<Self, Refusals> {
        let names: Vec<&str> = names.into_iter().collect();
        let mut check = Check::new(signals);
        let (mut page, mut total) = (Vec::new(), 0);
        if let [only] = names[..]
            && Pattern::is_glob(only)
        {
            if let Some(matches) = check.matching(only) {
                page.extend(matches.slots(offset).take(limit));
                total = matches.total();
            }
        } else {
            let mut seen = Seen::none_of(signals);
            let mut take = |place: (usize, usize)| {
                if seen.is_new(place) {
                    if total >= offset && page.len() < limit {
                        page.push(place);
                    }
                    total += 1;
                }
            };
            for name in names {
                if !Pattern::is_glob(name) {
                    check.known(name).into_iter().for_each(|one| take((one.task, one.slot)));
                } else if let Some(matches) = check.matching(name) {
                    check.searched += matches.total();
                    matches.slots(0).for_each(&mut take);
                }
            }
        }
        check.end()?;
        Ok(Self::with_page(signals, page, total))
    }

    fn with_page(signals: &Arc<Signals>, page: Vec<(usize, usize)>, total: usize) -> Self {
        let mut slots: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        page.iter().for_each(|(task, slot)| slots.entry(*task).or_default().push(*slot));
        let behind = slots.into_iter();
        let behind = behind.filter_map(|(task, of)| Some((task, Behind::of(signals, task, &of)?)));
        Self { behind: behind.collect(), signals: Arc::clone(signals), page, total }
    }

    /// All signals of a node, or a page of them.
    pub fn of_all(signals: &Arc<Signals>, offset: usize, limit: usize) -> Self {
        let all = signals.all();
        Self::with_page(signals, all.slots(offset).take(limit).collect(), all.total())
    }

    /// Whether looking for names may take longer than the others who ask a node should wait: names that are
    /// not known are compared with those that are, and patterns with all.
    pub fn takes_long<'n>(signals: &Signals, names: impl IntoIterator<Item = &'n str>) -> bool {
        let mut looked_at = 0;
        names.into_iter().any(|name| {
            looked_at += match Pattern::is_glob(name) {
                true => signals.slots(),
                false if signals.locate(name).is_some() => 1,
                false => signals.comparisons(),
            };
            looked_at > AT_ONCE
        })
    }

    /// A page of these, which must be all that were looked for.
    pub fn page(&self, offset: usize, limit: usize) -> Self {
        let page = self.page.iter().skip(offset).take(limit).copied().collect();
        Self::with_page(&self.signals, page, self.total)
    }

    /// The signals of the page.
    pub fn signals(&self) -> impl Iterator<Item = Signal<'_>> {
        self.page.iter().filter_map(|(task, slot)| self.signals.at(*task, *slot))
    }

    /// Whether they were looked for among these.
    pub fn is_of(&self, signals: &Arc<Signals>) -> bool {
        Arc::ptr_eq(&self.signals, signals)
    }

    /// How many signals there are, in the page or not.
    pub fn total(&self) -> usize {
        self.total
    }
}

/// The slots of each task that were there before: a bit for each.
struct Seen(Vec<Box<[u64]>>);

impl Seen {
    fn none_of(signals: &Signals) -> Self {
        let slots = (0..signals.tasks()).map(|task| signals.task(task).map_or(0, |of| of.slots));
        let words = |slots: usize| vec![0; slots.div_ceil(64)].into();
        Self(slots.map(words).collect())
    }

    fn is_new(&mut self, (task, slot): (usize, usize)) -> bool {
        let word = self.0.get_mut(task).and_then(|of| of.get_mut(slot / 64));
        word.is_some_and(|word| {
            let before = *word;
            *word |= 1 << (slot % 64);
            *word != before
        })
    }
}

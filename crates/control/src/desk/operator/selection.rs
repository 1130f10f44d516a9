//! The signals that a request reads.

use std::collections::BTreeMap;
use std::sync::Arc;

use isochrone_engine::Pattern;
use isochrone_model::{Finding, Refusal};

use super::check::Check;
use crate::desk::quality::Behind;
use crate::desk::signals::{Matches, Signal, Signals};

/// The signals that a request names, each once and in its order, or a page of them.
///
/// Searching the names of a node with a million instances takes up to some tenths of a second. The search needs only
/// the index of names, so a shared [`Operator`](super::Operator) need not be locked meanwhile.
#[derive(Debug)]
pub struct Selection {
    pub(super) signals: Arc<Signals>,
    /// Tasks and slots.
    pub(super) page: Vec<(usize, usize)>,
    /// For each task, what its signals are computed from, if that was asked for and is not too much to look through.
    pub(super) behind: BTreeMap<usize, Behind>,
    total: usize,
}

impl Selection {
    /// Selects signals by names, which may be patterns. The page has at most `limit` of them, from `offset` on.
    ///
    /// # Errors
    /// A name or pattern matches no signal.
    pub fn of<'n>(
        signals: &Arc<Signals>,
        names: impl IntoIterator<Item = &'n str>,
        offset: usize,
        limit: usize,
    ) -> Result<Self, Refusal> {
        let names: Vec<&str> = names.into_iter().collect();
        let mut check = Check::new(signals);
        let (mut page, mut total) = (Vec::new(), 0);
        if let [only] = names[..]
            && Pattern::is_glob(only)
        {
            if let Some(matches) = check.matching(only) {
                page = page_of(&matches, offset, limit);
                total = matches.total();
            }
        } else {
            let mut seen = SlotSet::none_of(signals);
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
                    matches.slots(0).for_each(&mut take);
                }
            }
            page.shrink_to_fit();
        }
        check.end()?;
        Ok(Self::with_page(signals, page, total))
    }

    fn with_page(signals: &Arc<Signals>, page: Vec<(usize, usize)>, total: usize) -> Self {
        Self { signals: Arc::clone(signals), page, behind: BTreeMap::new(), total }
    }

    /// Also finds what the signals of the page are computed from, which a reading needs to give the quality of their
    /// values.
    #[must_use]
    pub fn with_quality(mut self) -> Self {
        let mut slots: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        self.page.iter().for_each(|(task, slot)| slots.entry(*task).or_default().push(*slot));
        let behind = |(task, of): (usize, Vec<usize>)| {
            let behind = Behind::of(&self.signals, task, &of)?;
            Some((task, behind))
        };
        self.behind = slots.into_iter().filter_map(behind).collect();
        self
    }

    /// All signals of a node, or a page of them.
    pub fn of_all(signals: &Arc<Signals>, offset: usize, limit: usize) -> Self {
        let all = signals.all();
        Self::with_page(signals, page_of(&all, offset, limit), all.total())
    }

    /// The signals of the page.
    pub fn signals(&self) -> impl Iterator<Item = Signal<'_>> {
        self.page.iter().filter_map(|(task, slot)| self.signals.at(*task, *slot))
    }

    /// Whether it was selected from this index.
    pub fn is_of(&self, signals: &Arc<Signals>) -> bool {
        Arc::ptr_eq(&self.signals, signals)
    }

    /// How many signals were selected, on all pages.
    pub fn total(&self) -> usize {
        self.total
    }
}

impl Signals {
    /// A finding for each pattern that matches no signal. Takes as long as [`Selection::of`].
    pub fn unmatched<'n>(&self, names: impl IntoIterator<Item = &'n str>) -> Vec<Finding> {
        let mut check = Check::new(self);
        let patterns = names.into_iter().filter(|name| Pattern::is_glob(name));
        for pattern in patterns.filter(|pattern| !Pattern::is_for_all(pattern)) {
            check.matching(pattern);
        }
        check.into_findings()
    }
}

/// Allocates only the page, however many match.
fn page_of(matches: &Matches<'_>, offset: usize, limit: usize) -> Vec<(usize, usize)> {
    let count = matches.total().saturating_sub(offset).min(limit);
    let mut page = Vec::with_capacity(count);
    page.extend(matches.slots(offset).take(count));
    page
}

/// The slots of each task that were selected before: a bit for each.
struct SlotSet(Vec<Box<[u64]>>);

impl SlotSet {
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

#[cfg(test)]
mod tests {
    use super::*;
    use isochrone_engine::{Plan, Rules, Source};

    /// Of a node with so many instances of a block.
    fn signals(count: usize) -> Arc<Signals> {
        let text = format!(
            "[node]\nname = \"n\"\n[[task]]\nname = \"fast\"\nperiod = \"10ms\"\n[[block]]\n\
             name = \"late\"\ncount = {count}\ntype = \"LimRateOfChangeCI\"\n\
             in = {{ value = 1.0, setChangeRate = 10.0 }}\n"
        );
        Arc::new(Signals::of(&Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap()))
    }

    #[test]
    fn a_page_takes_memory_for_its_own_signals_alone() {
        const COUNT: usize = 20_000;
        let signals = signals(COUNT);
        let of = |names: &[&str], offset, limit| {
            Selection::of(&signals, names.iter().copied(), offset, limit).unwrap()
        };
        let pattern = of(&["late.*.value"], 7, 5);
        let patterns = of(&["late.*.value", "late.3.*"], 7, 5);
        let all = Selection::of_all(&signals, 7, 5);
        let rest = of(&["late.*.value"], COUNT - 2, usize::MAX);
        for (page, count) in [(&pattern, 5), (&patterns, 5), (&all, 5), (&rest, 2)] {
            assert_eq!((page.page.len(), page.page.capacity()), (count, count));
            assert!(page.total() >= COUNT);
        }
        assert_eq!(pattern.signals().next().unwrap().name, "late.7.value");
        assert_eq!(rest.signals().last().unwrap().name, format!("late.{}.value", COUNT - 1));
    }

    #[test]
    fn what_signals_are_computed_from_is_looked_for_where_they_are_to_be_read() {
        let signals = signals(5000);
        let few = Selection::of(&signals, ["late.*.delayedValue"], 10, 20).unwrap();
        assert!(few.behind.is_empty());
        let few = few.with_quality();
        assert_eq!(few.behind.len(), 1);
        let all = Selection::of(&signals, ["late.*.delayedValue"], 0, usize::MAX).unwrap();
        assert!(all.with_quality().behind.is_empty(), "that is too much to look through");
    }
}

//! What was found, for the pages that are asked for next.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use isochrone_engine::operate::{Selection, Signals};
use isochrone_model::Refusal;

use super::Search;

/// After so long without a search for the same names, what was found is not kept any longer.
pub(super) const IDLE: Duration = Duration::from_secs(10);
/// Searches of which that is kept: two of each client.
const MOST: usize = 2 * isochrone_ipc::MAX_CLIENTS;
/// Bytes that all of it may take: a node may lock its memory.
const MOST_BYTES: usize = 32 << 20;

/// What was found: least recently used first.
pub(super) struct Kept {
    found: VecDeque<Whole>,
    most_bytes: usize,
}

/// All signals of some names.
struct Whole {
    names: Option<Vec<String>>,
    selection: Selection,
    bytes: usize,
    used: Instant,
}

impl Default for Kept {
    fn default() -> Self {
        Self { found: VecDeque::new(), most_bytes: MOST_BYTES }
    }
}

impl Kept {
    /// A page, of what is kept or looked for now. What is too much to be kept is not looked for as a whole.
    pub(super) fn page(
        &mut self,
        signals: &Arc<Signals>,
        search: &Search,
        now: Instant,
    ) -> Result<Selection, Refusal> {
        self.forget_old(now);
        // Those of another configuration are of no use.
        self.found.retain(|one| one.selection.is_of(signals));
        let known = self.found.iter().position(|one| one.names == search.names);
        if let Some(mut known) = known.and_then(|place| self.found.remove(place)) {
            let page = known.selection.page(search.offset, search.limit);
            known.used = now;
            self.found.push_back(known);
            return Ok(page);
        }
        let page = search.page(signals)?;
        let bytes = names_bytes(search).saturating_add(page.whole_bytes());
        if bytes <= self.most_bytes {
            self.make_room(bytes);
            let selection = if page.is_whole() {
                page.page(0, usize::MAX)
            } else {
                search.look(signals, 0, usize::MAX)?
            };
            let names = search.names.clone();
            self.found.push_back(Whole { names, selection, bytes, used: now });
        }
        Ok(page)
    }

    /// Forgets what was not used for long.
    pub(super) fn forget_old(&mut self, now: Instant) {
        self.found.retain(|one| now.saturating_duration_since(one.used) < IDLE);
    }

    /// For one more.
    fn make_room(&mut self, bytes: usize) {
        while self.found.len() >= MOST || self.bytes() + bytes > self.most_bytes {
            if self.found.pop_front().is_none() {
                return;
            }
        }
    }

    fn bytes(&self) -> usize {
        self.found.iter().map(|one| one.bytes).sum()
    }
}

fn names_bytes(search: &Search) -> usize {
    let names = search.names.iter().flatten();
    names.map(|name| size_of::<String>() + name.len()).sum()
}

#[cfg(test)]
mod tests {
    use super::super::tests::{search, signals};
    use super::*;

    /// Instances of the node whose names are looked for, and of each a signal with this name.
    const COUNT: usize = 1000;

    fn names(page: &Selection) -> Vec<String> {
        page.signals().map(|signal| signal.name).collect()
    }

    fn kept(kept: &Kept) -> Vec<&str> {
        kept.found.iter().flat_map(|one| one.names.iter().flatten()).map(String::as_str).collect()
    }

    #[test]
    fn where_more_match_than_may_be_kept_a_page_is_looked_for_alone() {
        let signals = signals(COUNT);
        let mut few = Kept { most_bytes: 100, ..Kept::default() };
        for offset in [0, 3, COUNT - 2] {
            let asked = search("late.*.value", offset, 3);
            let page = few.page(&signals, &asked, Instant::now()).unwrap();
            let expected: Vec<_> =
                (offset..COUNT.min(offset + 3)).map(|i| format!("late.{i}.value")).collect();
            assert_eq!((names(&page), page.total()), (expected, COUNT));
            assert_eq!(few.bytes(), 0);
        }
    }

    #[test]
    fn pages_of_what_is_kept_are_those_of_a_search() {
        let signals = signals(COUNT);
        let mut all = Kept::default();
        let mut seen = Vec::new();
        while seen.len() < COUNT {
            let asked = search("late.*.value", seen.len(), 300);
            let page = all.page(&signals, &asked, Instant::now()).unwrap();
            assert_eq!(names(&page), names(&asked.page(&signals).unwrap()));
            assert_eq!(kept(&all), ["late.*.value"]);
            seen.extend(names(&page));
        }
        assert_eq!(seen.len(), COUNT);
        assert!(all.bytes() >= 16 * COUNT);
    }

    #[test]
    fn the_least_recently_used_makes_room_for_others() {
        let signals = signals(COUNT);
        let mut full = Kept::default();
        let ask = |kept: &mut Kept, index: usize| {
            let asked = search(&format!("late.{index}.*"), 0, 1);
            kept.page(&signals, &asked, Instant::now()).unwrap();
        };
        (0..MOST).for_each(|index| ask(&mut full, index));
        ask(&mut full, 0);
        ask(&mut full, MOST);
        assert_eq!(full.found.len(), MOST);
        assert!(kept(&full).contains(&"late.0.*"), "it was used again");
        assert!(!kept(&full).contains(&"late.1.*"));

        let each = full.bytes() / MOST;
        let mut small = Kept { most_bytes: 3 * each + each / 2, ..Kept::default() };
        (0..5).for_each(|index| ask(&mut small, index));
        assert_eq!(kept(&small), ["late.2.*", "late.3.*", "late.4.*"]);
    }

    #[test]
    fn what_is_not_asked_for_again_is_forgotten_although_others_are() {
        let signals = signals(COUNT);
        let mut some = Kept::default();
        let start = Instant::now();
        some.page(&signals, &search("late.1.*", 0, 1), start).unwrap();
        for half in 0..2 {
            let now = start + half * (IDLE / 2);
            some.page(&signals, &search("late.2.*", 0, 1), now).unwrap();
        }
        some.page(&signals, &search("late.3.*", 0, 1), start + IDLE).unwrap();
        assert_eq!(kept(&some), ["late.2.*", "late.3.*"]);
        some.forget_old(start + 3 * IDLE);
        assert!(kept(&some).is_empty());
    }

    #[test]
    fn what_was_found_in_another_configuration_is_forgotten() {
        let (before, after) = (signals(COUNT), signals(COUNT / 2));
        let mut kept = Kept::default();
        let asked = search("late.*.value", 0, 1);
        let mut total = |of| kept.page(of, &asked, Instant::now()).unwrap().total();
        assert_eq!((total(&before), total(&after)), (COUNT, COUNT / 2));
        assert_eq!(kept.found.len(), 1);
    }
}

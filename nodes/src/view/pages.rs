//! The pages that are open, and what they look at.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use serde::Deserialize;

use super::access;
use super::threads::locked;

/// Most pages that are open at a time.
pub(super) const MAX_PAGES: usize = 48;
/// A page that is open says what it looks at every 10 s, news or not. One that is not heard for so long reads nothing
/// any more: what it is told can lie between here and there for hours, and its place is free for another.
const LIFE: Duration = Duration::from_secs(30);

/// Most signals in the lines of a table that a page shows at a time.
const MAX_ROWS: usize = 120;
/// Most curves of a page.
const MAX_CURVES: usize = 16;
/// Values that the node is asked for at a time, however many pages there are, and the length of their names.
pub(super) const MAX_VALUES: usize = 1_000;
const MAX_NAME_BYTES: usize = 64 * 1024;

/// The signals that a page shows.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Look {
    /// Signals whose values it shows.
    rows: Vec<String>,
    /// Signals whose curves it shows.
    pub(super) curves: Vec<String>,
}

/// The signals to ask the node for.
pub(super) struct RequestedSignals {
    /// Signals.
    pub(super) names: Vec<String>,
    /// Lines for whose values there is no room.
    pub(super) left_out: BTreeSet<String>,
}

/// All pages that are open.
#[derive(Default)]
pub(super) struct Pages {
    looks: Mutex<BTreeMap<String, PageEntry>>,
}

/// The state of a page.
struct PageEntry {
    look: Arc<Look>,
    /// When it said so.
    heard: Instant,
}

/// A page that is open, until this is dropped.
pub(super) struct Open<'a> {
    pages: &'a Pages,
    /// A name that other pages do not know.
    pub(super) id: String,
}

impl Pages {
    /// Opens one; `None` if there are as many as there can be.
    pub(super) fn open(&self) -> std::io::Result<Option<Open<'_>>> {
        let id = access::token()?;
        let mut looks = locked(&self.looks);
        if looks.len() >= MAX_PAGES {
            return Ok(None);
        }
        looks.insert(id.clone(), PageEntry { look: Arc::default(), heard: Instant::now() });
        Ok(Some(Open { pages: self, id }))
    }

    /// Whether one is open.
    pub(super) fn is_any_open(&self) -> bool {
        !locked(&self.looks).is_empty()
    }

    /// A page looks at something else now.
    pub(super) fn look(&self, id: &str, look: Look) -> Result<(), String> {
        for (what, count, most) in
            [("signals", look.rows.len(), MAX_ROWS), ("curves", look.curves.len(), MAX_CURVES)]
        {
            if count > most {
                return Err(format!("a page shows at most {most} {what} at a time"));
            }
        }
        match locked(&self.looks).get_mut(id) {
            Some(known) => *known = PageEntry { look: Arc::new(look), heard: Instant::now() },
            None => return Err("this page is not open any more; load it again".into()),
        }
        Ok(())
    }

    /// The signals whose curves the pages show, each once.
    pub(super) fn curves(&self) -> BTreeSet<String> {
        let looks = locked(&self.looks);
        looks.values().flat_map(|known| known.look.curves.iter().cloned()).collect()
    }

    /// The signals whose values the node is asked for. `expand` gives those that a line needs, none for one
    /// that does not exist.
    pub(super) fn values(&self, expand: impl Fn(&str) -> Vec<String>) -> RequestedSignals {
        let looks: Vec<_> = locked(&self.looks).values().map(|known| known.look.clone()).collect();
        let (mut names, mut left_out) = (Vec::new(), BTreeSet::new());
        let (mut asked, mut bytes) = (BTreeSet::new(), 0);
        // The first line of each page before the second of any.
        let longest = looks.iter().map(|look| look.rows.len()).max().unwrap_or_default();
        let lines =
            (0..longest).flat_map(|line| looks.iter().filter_map(move |it| it.rows.get(line)));
        for line in lines {
            let mut new = expand(line);
            new.retain(|name| !asked.contains(name));
            let new_bytes: usize = new.iter().map(String::len).sum();
            let has_room =
                names.len() + new.len() <= MAX_VALUES && bytes + new_bytes <= MAX_NAME_BYTES;
            if !has_room {
                left_out.insert(line.clone());
                continue;
            }
            bytes += new_bytes;
            asked.extend(new.iter().cloned());
            names.extend(new);
        }
        RequestedSignals { names, left_out }
    }
}

impl Open<'_> {
    /// What it looks at.
    pub(super) fn now(&self) -> Arc<Look> {
        let looks = locked(&self.pages.looks);
        looks.get(&self.id).map(|known| known.look.clone()).unwrap_or_default()
    }

    /// Whether it was heard of not long ago.
    pub(super) fn is_alive(&self, now: Instant) -> bool {
        let looks = locked(&self.pages.looks);
        let heard = looks.get(&self.id).map(|known| known.heard);
        heard.is_some_and(|heard| now.saturating_duration_since(heard) < LIFE)
    }
}

impl Look {
    pub(super) fn rows(&self) -> &[String] {
        &self.rows
    }
}

impl Drop for Open<'_> {
    fn drop(&mut self) {
        locked(&self.pages.looks).remove(&self.id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(rows: impl IntoIterator<Item = String>) -> Look {
        Look { rows: rows.into_iter().collect(), curves: Vec::new() }
    }

    #[test]
    fn however_many_pages_there_are_the_node_is_asked_for_a_value_once_and_for_so_many_at_most() {
        let pages = Pages::default();
        let open: Vec<_> = (0..20).map(|_| pages.open().unwrap().unwrap()).collect();
        for page in &open {
            pages.look(&page.id, look(["a".to_owned(), "b".to_owned()])).unwrap();
        }
        let itself = |name: &str| vec![name.to_owned()];
        assert_eq!(pages.values(itself).names, ["a", "b"]);
        for (number, page) in open.iter().enumerate() {
            let rows = (0..MAX_ROWS).map(|row| format!("{row}.of.{number}"));
            pages.look(&page.id, look(rows)).unwrap();
        }
        let RequestedSignals { names, left_out } = pages.values(itself);
        assert_eq!((names.len(), left_out.len()), (MAX_VALUES, 20 * MAX_ROWS - MAX_VALUES));
        let first_lines = (0..20).all(|number| names.contains(&format!("0.of.{number}")));
        assert!(first_lines, "each page has a part");
        assert!(names.iter().all(|name| !left_out.contains(name)), "and the rest is known");
        drop(open);
        assert!(pages.values(itself).names.is_empty() && !pages.is_any_open());
    }

    #[test]
    fn a_page_cannot_look_at_more_than_it_shows_and_not_after_its_end() {
        let pages = Pages::default();
        let page = pages.open().unwrap().unwrap();
        let rows = (0..=MAX_ROWS).map(|row| row.to_string());
        assert!(pages.look(&page.id, look(rows)).unwrap_err().contains("at most 120 signals"));
        let id = page.id.clone();
        drop(page);
        assert!(pages.look(&id, Look::default()).unwrap_err().contains("load it again"));
    }

    #[test]
    fn a_page_that_is_not_heard_of_gives_its_place_to_another() {
        let pages = Pages::default();
        let mut open: Vec<_> = (0..MAX_PAGES).map(|_| pages.open().unwrap().unwrap()).collect();
        assert!(pages.open().unwrap().is_none(), "there are as many as there can be");
        let page = open.pop().unwrap();
        let later = Instant::now() + LIFE;
        assert!(page.is_alive(Instant::now()) && !page.is_alive(later));
        std::thread::sleep(Duration::from_millis(1));
        pages.look(&page.id, Look::default()).unwrap();
        assert!(page.is_alive(later), "it said that it looks");
        drop(page);
        assert!(pages.open().unwrap().is_some());
    }
}

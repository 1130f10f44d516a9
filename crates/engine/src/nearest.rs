//! Suggestions for misspelt names.

use std::collections::HashSet;

/// Names that exist, prepared for comparison with a misspelt one.
pub struct KnownNames<'a> {
    names: Vec<&'a str>,
    /// The same in lowercase.
    lowercase: Vec<String>,
}

impl<'a> KnownNames<'a> {
    /// Names in the order in which they are listed; duplicates count once.
    pub fn new(names: impl IntoIterator<Item = &'a str>) -> Self {
        let mut seen = HashSet::new();
        let names: Vec<&str> = names.into_iter().filter(|name| seen.insert(*name)).collect();
        let lowercase = names.iter().map(|name| name.to_lowercase()).collect();
        Self { names, lowercase }
    }

    /// How many names there are.
    pub(crate) fn len(&self) -> usize {
        self.names.len()
    }

    /// The name nearest to the written one, if one is near enough.
    pub fn nearest(&self, written: &str) -> Option<&'a str> {
        const NEAR: f64 = 0.75;
        let written = written.to_lowercase();
        self.lowercase
            .iter()
            .zip(&self.names)
            .filter(|(name, _)| may_be_near(&written, name))
            .map(|(lowercase, name)| (nearness(&written, lowercase), *name))
            .filter(|(nearness, _)| *nearness > NEAR)
            .max_by(|(a, _), (b, _)| a.total_cmp(b))
            .map(|(_, name)| name)
    }

    /// A sentence with the name nearest to the written one, or else with those that exist.
    pub fn suggestion(&self, written: &str) -> String {
        match self.nearest(written) {
            Some(name) => format!("did you mean \"{name}\"?"),
            None => self.listing(),
        }
    }

    /// A sentence with the names that exist.
    pub fn listing(&self) -> String {
        listing(self.names.iter().copied(), self.names.len())
    }
}

/// A sentence with the first of these names.
pub fn listing<'a>(names: impl Iterator<Item = &'a str>, count: usize) -> String {
    const LISTED: usize = 12;
    let first: Vec<&str> = names.take(LISTED).collect();
    match (first.join(", "), count) {
        (_, 0) => "there is none".into(),
        (first, count) if count > LISTED => format!("there are {count}: {first}, …"),
        (all, _) => format!("there is: {all}"),
    }
}

/// The name among `known` that is nearest to `written`, if one is near enough.
pub fn nearest_name<'a>(
    written: &str,
    known: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    KnownNames::new(known).nearest(written)
}

/// Whether two names can be near at all, seen by their lengths and first bytes alone.
fn may_be_near(a: &str, b: &str) -> bool {
    // Comparing takes the product of the lengths, and a file may have names of any length.
    const LONGEST: usize = 200;
    let (short, long) = (a.len().min(b.len()), a.len().max(b.len()));
    long <= LONGEST && (a.as_bytes().first() == b.as_bytes().first() || long <= 3 * short)
}

/// How alike two names are, from 0 to 1. Jaro-Winkler finds long names that begin alike, and the
/// edit distance short ones with a slip.
fn nearness(a: &str, b: &str) -> f64 {
    let edits = strsim::normalized_damerau_levenshtein(a, b) + 0.1;
    // To Jaro-Winkler, a letter or two are like every long name that begins with them.
    let (short, long) = (a.len().min(b.len()), a.len().max(b.len()));
    if short < 3 && long > 2 * short { edits } else { edits.max(strsim::jaro_winkler(a, b)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_letter_is_not_near_to_a_word_that_begins_with_it() {
        for (written, known, near) in [
            ("nope", "n", None),
            ("n", "nope", None),
            ("y1", "y", Some("y")),
            ("SP1", "SP", Some("SP")),
            ("raw", "raw_level", Some("raw_level")),
            ("setchangerate", "setChangeRate", Some("setChangeRate")),
            ("valeu", "value", Some("value")),
        ] {
            assert_eq!(nearest_name(written, [known]), near, "{written}");
        }
    }
}

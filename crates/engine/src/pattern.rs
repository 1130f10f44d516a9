//! Names with `*`.

/// A name in which `*` stands for any characters within one part of a name; parts are separated by
/// dots.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    parts: Vec<String>,
}

impl Pattern {
    /// The pattern that a text is. A text without `*` matches itself alone.
    pub fn new(text: &str) -> Self {
        Self { parts: text.split('.').map(str::to_owned).collect() }
    }

    /// Whether a text is more than a plain name.
    pub fn is_glob(text: &str) -> bool {
        text.contains('*')
    }

    /// Whether a pattern is of nothing but stars: it stands for all signals with so many parts, if there
    /// are any.
    pub fn is_for_all(name: &str) -> bool {
        name.contains('*') && name.chars().all(|c| matches!(c, '*' | '.'))
    }

    /// Whether it matches a whole name.
    pub fn matches(&self, name: &str) -> bool {
        let mut parts = name.split('.');
        self.parts
            .iter()
            .all(|pattern| parts.next().is_some_and(|part| part_matches(pattern, part)))
            && parts.next().is_none()
    }

    /// Its parts.
    pub fn parts(&self) -> &[String] {
        &self.parts
    }
}

/// Whether a part of a name matches a part of a pattern.
pub fn part_matches(pattern: &str, part: &str) -> bool {
    let mut pieces = pattern.split('*');
    let first = pieces.next().unwrap_or_default();
    let Some(mut rest) = part.strip_prefix(first) else { return false };
    let Some(last) = pieces.next_back() else { return rest.is_empty() };
    for piece in pieces {
        match rest.find(piece) {
            Some(start) => rest = rest.get(start + piece.len()..).unwrap_or_default(),
            None => return false,
        }
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_matches_within_one_part_of_a_name() {
        let rows = [
            ("ramp.value", "ramp.value", true),
            ("ramp.value", "ramp.valu", false),
            ("ramp.*", "ramp.value", true),
            ("ramp.*", "ramp.3.value", false),
            ("ramp.*.value", "ramp.3.value", true),
            ("*", "raw", true),
            ("*", "raw.ok", false),
            ("r*p.s*C*Rate", "ramp.setChangeRate", true),
            ("r*p.s*C*Rates", "ramp.setChangeRate", false),
            ("a*a.x", "a.x", false),
            ("a*a.x", "aa.x", true),
            ("**.x", "b.x", true),
            ("", "raw", false),
        ];
        for (pattern, name, matches) in rows {
            assert_eq!(Pattern::new(pattern).matches(name), matches, "{pattern} {name}");
        }
    }
}

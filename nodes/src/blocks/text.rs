//! The meaning of a block's pins and status words, in words. Blocks of other programs follow other
//! documents than ours, or none.

use isochrone_blocks::{BlockType, Origin, Pin, PinDefault, StatusWord};

use crate::base::numbers;

/// Where names, types, defaults, modes and status words come from.
pub(super) fn source(known: &BlockType) -> Option<String> {
    known.follows.map(|document| format!("Follows {document}."))
}

/// The document that a block follows, in short.
pub(super) fn document(known: &BlockType) -> Option<&'static str> {
    known.follows.map(|_| if follows_lgf(known) { "LGF" } else { family(known) })
}

/// The document whose blocks stand together: what follows the page's name in `follows`.
fn family(known: &BlockType) -> &'static str {
    let follows =
        known.follows.unwrap_or(if known.is_of_library() { "isochrone" } else { "this program" });
    follows.split_once(", ").map_or(follows, |(_, document)| document)
}

/// The blocks by the document that they follow, in the order in which the documents come first.
pub(super) fn families<'a>(types: &[&'a BlockType]) -> Vec<(&'static str, Vec<&'a BlockType>)> {
    let mut families: Vec<(&str, Vec<&BlockType>)> = Vec::new();
    for known in types {
        let name = family(known);
        match families.iter_mut().find(|(family, _)| *family == name) {
            Some((_, members)) => members.push(known),
            None => families.push((name, vec![known])),
        }
    }
    families
}

/// Whether a block follows a page of Siemens' Library of General Functions.
pub(super) fn follows_lgf(known: &BlockType) -> bool {
    known.follows.is_some_and(|document| document.contains("(LGF)"))
}

/// The meaning of a pin, its other names in the block's document, and when it is read.
pub(super) fn meaning(known: &BlockType, pin: &Pin) -> String {
    let aliases = pin.aliases.iter().map(|alias| match document(known) {
        Some(document) => format!(" In {document} also `{alias}`."),
        None => format!(" Also `{alias}`."),
    });
    let latch =
        pin.latched_by.map(|latch| format!(" Read in the first call and at `{latch}` only."));
    std::iter::once(pin.doc().to_owned()).chain(aliases).chain(latch).collect()
}

/// The meaning of a status word, and whether it is missing from the block's document.
pub(super) fn word_meaning(known: &BlockType, word: &StatusWord) -> String {
    match (word.origin, document(known)) {
        (Origin::Ours, Some("LGF")) => format!("{} (isochrone's word, not LGF's)", word.meaning),
        (Origin::Ours, Some(document)) => format!("{} (not a word of {document})", word.meaning),
        (Origin::Document, _) | (Origin::Ours, None) => word.meaning.into(),
    }
}

/// The value of a pin without a wire.
pub(super) fn default(pin: &Pin) -> String {
    match pin.default {
        PinDefault::Required => "required".into(),
        PinDefault::Value(slot) => numbers::literal(slot, pin.pin_type),
        PinDefault::CallingTask => "calling task".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn own(follows: Option<&'static str>) -> BlockType {
        let mut known = isochrone_blocks::CATALOGUE[0];
        known.follows = follows;
        known
    }

    fn told(known: &BlockType) -> String {
        let pins = known.outputs.iter().map(|pin| meaning(known, pin));
        let words = known.status.iter().map(|word| word_meaning(known, word));
        pins.chain(words).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn a_block_is_compared_with_the_document_that_it_follows_and_with_no_other() {
        let lgf = told(&own(isochrone_blocks::CATALOGUE[0].follows));
        assert!(lgf.contains("In LGF also `") && lgf.contains("not LGF's"), "{lgf}");
        let other = told(&own(Some("IEC 61131-3")));
        assert!(!other.contains("LGF") && other.contains("not a word of IEC 61131-3"), "{other}");
        let none = told(&own(None));
        assert!(!none.contains("LGF") && !none.contains("(not "), "{none}");
        assert!(none.contains(" Also `"), "{none}");
    }
}

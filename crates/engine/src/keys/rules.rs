//! What names and words a key takes.

use isochrone_blocks::PinType;

use super::{Form, NameRule, Range};

/// Behind `isochrone/` it is the name of an iceoryx2 node, which has at most 128 bytes.
pub(super) const MOST_NODE_NAME: usize = 118;
/// A name in a frame has at most 255 bytes, and these names are followed by a dot, a number and that of a pin or a time.
pub(crate) const MOST_ENTRY_NAME: usize = 200;

pub(super) const NODE_NAME: NameRule = NameRule {
    accepts: |name| {
        name.len() <= MOST_NODE_NAME
            && name.starts_with(|c: char| c.is_ascii_lowercase())
            && name.chars().all(|c| matches!(c, 'a'..='z' | '0'..='9' | '_' | '-'))
    },
    words: "a lowercase letter, then lowercase letters, digits, _ and -, at most 118 in all",
};

pub(super) const ENTRY_NAME: NameRule = NameRule {
    accepts: |name| {
        name.len() <= MOST_ENTRY_NAME
            && name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
    },
    words: "a letter or _, then letters, digits, _ and -, at most 200 in all",
};

/// Longest unit: what the layout of a frame has room for.
pub(super) const MOST_UNIT: usize = 255;
/// Longest comment.
pub(super) const MOST_COMMENT: usize = 1000;

pub(super) const fn integer(accepts: fn(i64) -> bool, words: &'static str) -> Form {
    Form::Integer(Range { accepts, words })
}

pub(super) const fn duration(accepts: fn(u64) -> bool, words: &'static str) -> Form {
    Form::Duration(Range { accepts, words })
}

/// Types that an input or a variable can have. WORD is a type of outputs: no pin of a library block takes one.
pub(crate) const VALUE_TYPES: [PinType; 4] =
    [PinType::Lreal, PinType::Int, PinType::Bool, PinType::Time];

/// The words of these choices, as they are written.
macro_rules! words {
    ($all:expr) => {{
        const WORDS: [&str; $all.len()] = {
            let mut words = [""; $all.len()];
            let mut index = 0;
            while index < words.len() {
                words[index] = $all[index].as_str();
                index += 1;
            }
            words
        };
        &WORDS
    }};
}

pub(super) use words;

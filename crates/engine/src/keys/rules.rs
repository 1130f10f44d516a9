//! What names and words a key takes.

use isochrone_blocks::PinType;
use isochrone_model::{Access, AlarmSeverity, Overrun, Wake};

use super::{Form, NameRule, Range};
use crate::config::{Bad, Cpu, OnDamaged, OnStale, OnWarmStart};

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

pub(super) const WAKES: [&str; 3] = {
    let [sleep, hybrid, spin] = Wake::ALL;
    [sleep.as_str(), hybrid.as_str(), spin.as_str()]
};

pub(super) const OVERRUNS: [&str; 3] = {
    let [skip, catch_up, stop] = Overrun::ALL;
    [skip.as_str(), catch_up.as_str(), stop.as_str()]
};

/// Types that an input or a variable can have. WORD is a type of outputs: no pin of a library block takes one.
pub(crate) const VALUE_TYPES: [PinType; 4] =
    [PinType::Lreal, PinType::Int, PinType::Bool, PinType::Time];

pub(super) const TYPES: [&str; 4] = {
    let [lreal, int, bool, time] = VALUE_TYPES;
    [lreal.as_str(), int.as_str(), bool.as_str(), time.as_str()]
};

pub(super) const CPUS: [&str; 2] = {
    let [auto, any] = Cpu::WORDS;
    [auto.as_str(), any.as_str()]
};

pub(super) const ON_STALES: [&str; 2] = {
    let [hold, default] = OnStale::WORDS;
    [hold.as_str(), default.as_str()]
};

pub(super) const BADS: [&str; 2] = {
    let [ignore, stale] = Bad::ALL;
    [ignore.as_str(), stale.as_str()]
};

pub(super) const CONTROLS: [&str; 4] = {
    let [off, read, set, force] = Access::ALL;
    [off.as_str(), read.as_str(), set.as_str(), force.as_str()]
};

pub(super) const SEVERITIES: [&str; 3] = {
    let [info, warning, critical] = AlarmSeverity::ALL;
    [info.as_str(), warning.as_str(), critical.as_str()]
};

pub(super) const ON_DAMAGEDS: [&str; 2] = {
    let [stop, cold] = OnDamaged::ALL;
    [stop.as_str(), cold.as_str()]
};

pub(super) const WARM_STARTS: [&str; 2] = {
    let [send, confirm] = OnWarmStart::ALL;
    [send.as_str(), confirm.as_str()]
};

//! What the channels of a frame mean, and how a service says so.

use iceoryx2::constants::{MAX_ATTRIBUTE_VALUE_LENGTH, MAX_ATTRIBUTES};
use iceoryx2::prelude::{AttributeSet, AttributeSpecifier, CallbackProgression, SemanticString};
use iceoryx2::service::attribute::{AttributeKey, AttributeValue};

use crate::notation;
use crate::{LayoutConflict, LayoutError};

const SIGNALS: &str = "signals";
const TYPES: &str = "types";
const PERIOD_NS: &str = "period_ns";

/// One channel of a frame.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SignalSpec {
    /// Such as `level.y`; empty: nobody gave it a name.
    pub name: String,
    /// `LREAL`, `INT`, `BOOL`, `TIME` or `WORD`; empty: unknown, or a channel that is not used.
    pub value_type: String,
}

/// What the channels of a frame mean.
///
/// A service carries its layout in its attributes, where every iceoryx2 program can read it
/// (`iox2 service details`):
///
/// | key | value |
/// |---|---|
/// | `signals` | the channels' names, separated by spaces |
/// | `types` | their types, likewise; `-` for an unknown one |
/// | `period_ns` | the publisher's period, decimal nanoseconds; left out when it has none |
///
/// A list of more than 256 bytes uses a shell's braces: `ramp.{0..999}.{y,done}` is what `echo ramp.{0..999}.{y,done}`
/// prints, `LREAL*1000` is that word a thousand times, and `-` is an empty one. A value of more
/// than 256 bytes goes on in `signals.1`, `signals.2` … (`types.1` …), to be joined without
/// anything in between. iceoryx2 holds 8 attributes, 2 KiB: when names and types do not fit, the
/// names are left out, and when that is not enough the types too. The values are all there.
///
/// A service that a reader had to create, because it came first, has `types` only: the names and
/// the period are the writer's to give, and attributes cannot be changed later. A service without
/// these attributes is of unknown layout, and fits everything.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FrameLayout {
    /// The channels in their order; none: the layout is unknown.
    pub signals: Vec<SignalSpec>,
    /// Time between two frames in nanoseconds, if they are periodic.
    pub period_ns: Option<u64>,
}

impl SignalSpec {
    /// A channel of this name and type.
    pub fn new(name: impl Into<String>, value_type: impl Into<String>) -> Self {
        Self { name: name.into(), value_type: value_type.into() }
    }
}

impl FrameLayout {
    /// Says whether a service can carry this layout; for checks ahead of time.
    ///
    /// # Errors
    /// There is no signal, or a name or type cannot be written.
    pub fn check(&self) -> Result<(), LayoutError> {
        self.to_attributes().map(drop)
    }

    /// Writes the layout as attributes for a service that is about to be created.
    ///
    /// # Errors
    /// As for [`check`](Self::check).
    pub fn to_attributes(&self) -> Result<AttributeSpecifier, LayoutError> {
        if self.signals.is_empty() {
            return Err(LayoutError::Empty);
        }
        for (channel, signal) in self.signals.iter().enumerate() {
            for word in [&signal.name, &signal.value_type] {
                if !notation::is_word(word) {
                    return Err(LayoutError::Word { channel, word: word.clone() });
                }
            }
        }
        let value = |word: fn(&SignalSpec) -> &str| {
            let words = || self.signals.iter().map(word);
            let plain = notation::plain(words());
            // Whoever splits at spaces reads most frames; only long lists are written in short.
            if plain.len() > MAX_ATTRIBUTE_VALUE_LENGTH { notation::write(words()) } else { plain }
        };
        let types = pieces(TYPES, &value(|signal| &signal.value_type));
        let names = match self.is_named() {
            true => pieces(SIGNALS, &value(|signal| &signal.name)),
            false => Vec::new(),
        };
        let period = self.period_ns.map(|period_ns| (PERIOD_NS.to_owned(), period_ns.to_string()));
        let period = Vec::from_iter(period);
        // Frames are read by index, so a description that is too long must not stop them.
        let described = [[&period, &types, &names].as_slice(), &[&period, &types], &[&period]]
            .into_iter()
            .find_map(|parts| specifier(parts.iter().copied().flatten()));
        Ok(described.unwrap_or_default())
    }

    /// Reads the layout from the attributes of an existing service; the unknown layout if it
    /// has none of ours.
    ///
    /// # Errors
    /// An attribute of ours does not follow the notation.
    pub fn from_attributes(attributes: &AttributeSet) -> Result<Self, LayoutError> {
        let names = words(attributes, SIGNALS)?;
        let types = words(attributes, TYPES)?;
        let period_ns = match value_of(attributes, PERIOD_NS) {
            None => None,
            Some(text) => Some(
                text.parse()
                    .map_err(|_| LayoutError::Malformed { key: PERIOD_NS.to_owned(), at: text })?,
            ),
        };
        if let (Some(names), Some(types)) = (&names, &types)
            && names.len() != types.len()
        {
            return Err(LayoutError::Uneven { signals: names.len(), types: types.len() });
        }
        let count = names.as_ref().or(types.as_ref()).map_or(0, Vec::len);
        let mut names = names.into_iter().flatten();
        let mut types = types.into_iter().flatten();
        let signals = (0..count).map(|_| SignalSpec {
            name: names.next().unwrap_or_default(),
            value_type: types.next().unwrap_or_default(),
        });
        Ok(Self { signals: signals.collect(), period_ns })
    }

    /// Whether any channel has a name: then a writer described it, and it is complete.
    pub fn is_named(&self) -> bool {
        self.signals.iter().any(|signal| !signal.name.is_empty())
    }

    /// What a reader may say of a layout: the types that it expects.
    pub(crate) fn as_expectation(&self) -> Self {
        let signals = self.signals.iter().map(|signal| SignalSpec {
            name: String::new(),
            value_type: signal.value_type.clone(),
        });
        Self { signals: signals.collect(), period_ns: None }
    }

    /// Says whether frames of this layout serve a reader who needs `needed`.
    ///
    /// Where either side does not know a channel's type, it fits. A layout without names is
    /// another reader's expectation, and says nothing about how many channels there will be.
    pub(crate) fn serves(&self, needed: &Self) -> Result<(), LayoutConflict> {
        if self.is_named() && self.signals.len() < needed.signals.len() {
            return Err(LayoutConflict::TooFewChannels {
                available: self.signals.len(),
                needed: needed.signals.len(),
            });
        }
        for (channel, (have, need)) in self.signals.iter().zip(&needed.signals).enumerate() {
            let both_known = !have.value_type.is_empty() && !need.value_type.is_empty();
            if both_known && have.value_type != need.value_type {
                let names = [&have.name, &need.name];
                let name = names.into_iter().find(|name| !name.is_empty());
                return Err(LayoutConflict::ValueType {
                    channel,
                    name: name.map_or("-", String::as_str).to_owned(),
                    available: have.value_type.clone(),
                    needed: need.value_type.clone(),
                });
            }
        }
        Ok(())
    }
}

/// The attributes as iceoryx2 takes them; `None` when they are too many.
fn specifier<'a>(
    attributes: impl Iterator<Item = &'a (String, String)>,
) -> Option<AttributeSpecifier> {
    let mut specifier = AttributeSpecifier::new();
    for (key, value) in attributes {
        let key = AttributeKey::try_from(key.as_str()).ok()?;
        let value = AttributeValue::try_from(value.as_str()).ok()?;
        specifier = specifier.define(&key, &value).ok()?;
    }
    Some(specifier)
}

impl FrameLayout {
    /// Says whether a writer of this layout keeps the names that the service promises: readers
    /// show its values under those.
    pub(crate) fn keeps_names(&self, promised: &Self) -> Result<(), LayoutConflict> {
        let pairs = self.signals.iter().zip(&promised.signals).enumerate();
        let mut named = pairs.filter(|(_, (_, promised))| !promised.name.is_empty());
        match named.find(|(_, (ours, promised))| ours.name != promised.name) {
            None => Ok(()),
            Some((channel, (ours, promised))) => Err(LayoutConflict::Name {
                channel,
                available: ours.name.clone(),
                needed: promised.name.clone(),
            }),
        }
    }
}

/// Name of the `index`-th attribute that a long value is spread over.
fn key_of(key: &str, index: usize) -> String {
    match index {
        0 => key.to_owned(),
        index => format!("{key}.{index}"),
    }
}

/// Cuts a value into attributes. They are told apart by key, because iceoryx2 sorts the values
/// of one key.
fn pieces(key: &str, value: &str) -> Vec<(String, String)> {
    let bytes = value.as_bytes().chunks(MAX_ATTRIBUTE_VALUE_LENGTH);
    bytes
        .enumerate()
        .map(|(index, piece)| (key_of(key, index), String::from_utf8_lossy(piece).into_owned()))
        .collect()
}

/// Joins what [`pieces`] cut.
fn value_of(attributes: &AttributeSet, key: &str) -> Option<String> {
    let mut joined = None;
    for index in 0..MAX_ATTRIBUTES {
        let key = AttributeKey::try_from(key_of(key, index).as_str()).ok()?;
        let mut found = false;
        attributes.iter_key_values(&key, |value| {
            let text = String::from_utf8_lossy(value.as_bytes());
            joined.get_or_insert_with(String::new).push_str(&text);
            found = true;
            CallbackProgression::Stop
        });
        if !found {
            break;
        }
    }
    joined
}

fn words(attributes: &AttributeSet, key: &str) -> Result<Option<Vec<String>>, LayoutError> {
    let malformed = |at| LayoutError::Malformed { key: key.to_owned(), at };
    value_of(attributes, key).map(|text| notation::read(&text).map_err(malformed)).transpose()
}

//! Reading the parameters of a request: every finding, not only the first.

use std::fmt;

use isochrone_engine::{escaped, nearest_name};
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::value::RawValue;

use super::{At, Code, Finding, Hold, Refusal, Values, Written};

/// The members of `params`, while they are read.
pub(super) struct Members<'a> {
    entries: Vec<(String, &'a RawValue)>,
    known: Vec<&'static str>,
    findings: Vec<Finding>,
    /// Whether a finding is about anything other than a signal's value.
    has_structural: bool,
}

impl<'a> Members<'a> {
    /// The members of `params`, which may be left out.
    pub(super) fn of(params: Option<&'a RawValue>) -> Result<Self, Refusal> {
        let entries = match params.map(|params| serde_json::from_str(params.get())) {
            None => Vec::new(),
            Some(Ok(Entries(entries))) => entries,
            Some(Err(_)) => {
                let message = "\"params\" is no object; write them by name, as in {\"names\": [\"ramp.value\"]}";
                return Err(Refusal::new(Code::InvalidParams, message));
            }
        };
        Ok(Self { entries, known: Vec::new(), findings: Vec::new(), has_structural: false })
    }

    /// A member that must be there. `None`: there is a finding.
    pub(super) fn required<T: Member>(&mut self, name: &'static str) -> Option<T> {
        match self.take(name) {
            Some(raw) => self.read(name, raw),
            None => {
                self.note(Finding::new(name, format!("\"{name}\" is missing")), T::EXPECTED);
                None
            }
        }
    }

    /// A member that may be left out, or be `null`, which means the same.
    pub(super) fn optional<T: Member>(&mut self, name: &'static str) -> Option<Option<T>> {
        match self.take(name) {
            Some(raw) => self.read(name, raw),
            None => Some(None),
        }
    }

    /// The parameters, if there are no findings.
    pub(super) fn finish<T>(mut self, read: Option<T>) -> Result<T, Refusal> {
        let known = std::mem::take(&mut self.known);
        for (name, _) in std::mem::take(&mut self.entries) {
            let shown = shown(&name);
            let message = if known.contains(&name.as_str()) {
                format!("\"{shown}\" is given twice")
            } else {
                format!("there is no parameter \"{shown}\"")
            };
            let help = match nearest_name(&name, known.iter().copied()) {
                _ if known.contains(&name.as_str()) => "leave one of them out".to_owned(),
                Some(nearest) => format!("did you mean \"{nearest}\"?"),
                None if known.is_empty() => "this method takes none".to_owned(),
                None => format!("there is: {}", known.join(", ")),
            };
            self.has_structural = true;
            self.findings.push(Finding::new(shown, message).with_help(help));
        }
        match read {
            Some(read) if self.findings.is_empty() => Ok(read),
            _ => {
                let code = if self.has_structural { Code::InvalidParams } else { Code::WrongValue };
                Err(Refusal::of(code, self.findings))
            }
        }
    }

    /// Takes a member out; of a duplicate, one stays.
    fn take(&mut self, name: &'static str) -> Option<&'a RawValue> {
        self.known.push(name);
        let index = self.entries.iter().position(|(known, _)| known == name)?;
        Some(self.entries.remove(index).1)
    }

    fn read<T: Member>(&mut self, name: &'static str, raw: &'a RawValue) -> Option<T> {
        match T::read(raw.get()) {
            Ok(read) => Some(read),
            Err(findings) if findings.is_empty() => {
                let shown = shown(raw.get());
                let message = format!("\"{name}\" cannot be {shown}");
                self.note(Finding::new(name, message), T::EXPECTED);
                None
            }
            Err(findings) => {
                self.findings.extend(findings);
                None
            }
        }
    }

    fn note(&mut self, finding: Finding, expected: &str) {
        self.has_structural = true;
        self.findings.push(finding.with_help(format!("give {expected}")));
    }
}

/// A type of parameter.
pub(super) trait Member: Sized {
    /// The expected form, in words.
    const EXPECTED: &'static str;

    /// Reads JSON. An error without findings: it is of another type.
    fn read(text: &str) -> Result<Self, Vec<Finding>>;

    /// Whether it is written in a request.
    fn is_omitted(&self) -> bool {
        false
    }
}

macro_rules! member {
    ($($type:ty: $expected:literal)*) => {$(
        impl Member for $type {
            const EXPECTED: &'static str = $expected;

            fn read(text: &str) -> Result<Self, Vec<Finding>> {
                serde_json::from_str(text).map_err(|_| Vec::new())
            }
        }
    )*};
}

member! {
    String: "a string"
    bool: "true or false"
    u64: "a whole number from 0 on, without a decimal point"
    Vec<String>: "a list of names, such as [\"ramp.value\", \"valve.*\"]"
}

impl<T: Member> Member for Option<T> {
    const EXPECTED: &'static str = T::EXPECTED;

    fn read(text: &str) -> Result<Self, Vec<Finding>> {
        if text == "null" { Ok(None) } else { T::read(text).map(Some) }
    }

    fn is_omitted(&self) -> bool {
        self.is_none()
    }
}

impl Member for Values<Written> {
    const EXPECTED: &'static str = "names and values, such as {\"ramp.setChangeRate\": 5.0}";

    fn read(text: &str) -> Result<Self, Vec<Finding>> {
        let Entries(entries) = serde_json::from_str(text).map_err(|_| Vec::new())?;
        let (mut values, mut findings) = (Vec::with_capacity(entries.len()), Vec::new());
        for (name, raw) in entries {
            match serde_json::from_str(raw.get()) {
                Ok(value) => values.push((name, value)),
                Err(_) => {
                    let (name, shown) = (shown(&name), shown(raw.get()));
                    let message = format!("\"{name}\" cannot be {shown}");
                    let help = format!("give {}", Written::EXPECTED);
                    findings.push(Finding::new(name, message).with_help(help));
                }
            }
        }
        if findings.is_empty() { Ok(Self(values)) } else { Err(findings) }
    }
}

impl Member for At {
    const EXPECTED: &'static str = Self::EXPECTED;

    fn read(text: &str) -> Result<Self, Vec<Finding>> {
        serde_json::from_str(text).map_err(|_| Vec::new())
    }
}

impl Member for Hold {
    const EXPECTED: &'static str = "a number of seconds, or null: until it is released";

    fn read(text: &str) -> Result<Self, Vec<Finding>> {
        let seconds: Option<f64> = serde_json::from_str(text).map_err(|_| Vec::new())?;
        Ok(seconds.map_or(Self::UntilReleased, Self::Seconds))
    }
}

/// As much of a text as an error shows, without control characters.
pub(super) fn shown(text: &str) -> String {
    const SHOWN: usize = 60;
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", escaped(text.get(..end).unwrap_or_default())),
        None => escaped(text).into_owned(),
    }
}

/// The members of an object, in order and including duplicates; their values are not parsed.
pub(super) struct Entries<'a>(pub(super) Vec<(String, &'a RawValue)>);

impl<'de> Deserialize<'de> for Entries<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OfEntries;
        impl<'de> Visitor<'de> for OfEntries {
            type Value = Entries<'de>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Entries<'de>, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(Entries(entries))
            }
        }
        deserializer.deserialize_map(OfEntries)
    }
}

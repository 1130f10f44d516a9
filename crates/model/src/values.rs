//! Values by name.

use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

use serde::de::{MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::Value;

/// By the name of a signal its type: `LREAL`, `INT`, `BOOL`, `TIME` or `WORD`.
pub type Types = BTreeMap<String, String>;

/// Values by name, in the order in which they are written: a JSON object. Those of a request may be
/// [as people write them](crate::Written).
///
/// A duplicate name is kept, so that the check of a request can refuse it.
#[derive(Debug, Clone, PartialEq)]
pub struct Values<V = Value>(pub Vec<(String, V)>);

impl<V: Clone> Values<V> {
    /// The value of a name; the last one, if there are several.
    pub fn get(&self, name: &str) -> Option<V> {
        self.0.iter().rfind(|(known, _)| known == name).map(|(_, value)| value.clone())
    }

    /// Names and values.
    pub fn iter(&self) -> impl Iterator<Item = (&str, V)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value.clone()))
    }
}

impl<V> Default for Values<V> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<N: Into<String>, G: Into<V>, V> FromIterator<(N, G)> for Values<V> {
    fn from_iter<I: IntoIterator<Item = (N, G)>>(values: I) -> Self {
        Self(values.into_iter().map(|(name, value)| (name.into(), value.into())).collect())
    }
}

impl<V: Serialize> Serialize for Values<V> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, value) in &self.0 {
            map.serialize_entry(name, value)?;
        }
        map.end()
    }
}

impl<'de, V: Deserialize<'de>> Deserialize<'de> for Values<V> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OfValues<V>(PhantomData<V>);
        impl<'de, V: Deserialize<'de>> Visitor<'de> for OfValues<V> {
            type Value = Values<V>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object of names and values")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Values<V>, A::Error> {
                let mut values = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    values.push(entry);
                }
                Ok(Values(values))
            }
        }
        deserializer.deserialize_map(OfValues(PhantomData))
    }
}

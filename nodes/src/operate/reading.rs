//! Values and quality of a node's signals.

use std::collections::{BTreeMap, BTreeSet};

use isochrone_control::{
    ByTask, ClientError, Code, GetParams, ReadAt, SignalDescription, SignalsParams, Types, Values,
};
use isochrone_engine::escaped;

use super::node::{Node, PATIENCE, Purpose, failure};
use crate::failure::Failure;

/// Names of one request, in bytes; far less than a message holds.
const MAX_NAME_BYTES: usize = 100_000;
/// Names of one request that a node takes.
const MAX_NAMES: usize = 4096;

/// Values, and the cycles that they are of.
#[derive(Default, serde::Serialize)]
pub(crate) struct Reading {
    /// The cycle of each task. A task whose values needed more than one request is missing.
    pub(crate) tasks: ByTask<ReadAt>,
    pub(crate) values: Values,
    /// The flags of the values that have some; `None`: the node does not say.
    pub(crate) quality: Option<BTreeMap<String, Vec<String>>>,
    /// The types of the values, where they were asked for.
    #[serde(skip)]
    pub(crate) types: Types,
}

impl Reading {
    /// The flags of a value, with blanks between them; nothing for none.
    pub(super) fn flags(&self, name: &str) -> String {
        let flags = self.quality.as_ref().and_then(|quality| quality.get(name));
        flags.map_or_else(String::new, |flags| flags.join(" "))
    }
}

impl Node {
    /// Its signals, or those that a name or glob matches.
    pub(crate) fn signals(
        &mut self,
        pattern: Option<&str>,
    ) -> Result<Vec<SignalDescription>, Failure> {
        self.client().signals(pattern).map_err(|error| failure(error, Purpose::Look))
    }

    /// As [`signals`](Self::signals); nothing where nothing matches.
    pub(super) fn signals_if_any(
        &mut self,
        pattern: &str,
    ) -> Result<Vec<SignalDescription>, Failure> {
        match self.client().signals(Some(pattern)) {
            Err(ClientError::Refused(refused)) if refused.code == Code::UnknownName => {
                Ok(Vec::new())
            }
            found => found.map_err(|error| failure(error, Purpose::Look)),
        }
    }

    /// How many signals it has, or match a glob.
    pub(super) fn count(&mut self, pattern: Option<&str>) -> Result<u64, Failure> {
        let (pattern, limit) = (pattern.map(str::to_owned), Some(1));
        match self.ask(&SignalsParams { pattern, offset: None, limit }) {
            Ok(page) => Ok(page.total),
            Err(ClientError::Refused(refused)) if refused.code == Code::UnknownName => Ok(0),
            Err(error) => Err(failure(error, Purpose::Look)),
        }
    }

    /// The values of names and globs, in their order. While the configuration is being changed, a node may
    /// have to be asked again.
    pub(crate) fn read(&mut self, names: &[String]) -> Result<Reading, Failure> {
        self.read_with(names, None)
    }

    /// As [`read`](Self::read), and their types.
    pub(super) fn read_typed(&mut self, names: &[String]) -> Result<Reading, Failure> {
        self.read_with(names, Some(true))
    }

    fn read_with(&mut self, names: &[String], types: Option<bool>) -> Result<Reading, Failure> {
        let reading = self.ask_again(PATIENCE, |_| {}, |node| node.read_once(names, types));
        let reading = reading.map_err(|error| failure(error, Purpose::Look))?;
        match unanswered(names, &reading.values) {
            Some(missing) => Err(Failure::found(format!(
                "node \"{}\" answered without the value of \"{}\": see that no other process serves \
                 isochrone/{}/control",
                self.name(),
                escaped(missing),
                self.name()
            ))),
            None => Ok(reading),
        }
    }

    fn read_once(&mut self, names: &[String], types: Option<bool>) -> Result<Reading, ClientError> {
        let mut reading = Reading { quality: Some(BTreeMap::new()), ..Reading::default() };
        let mut mixed = Vec::new();
        let mut rest = names;
        while !rest.is_empty() {
            let mut bytes = 0;
            let fits = rest.iter().take(MAX_NAMES).take_while(|name| {
                bytes += name.len();
                bytes <= MAX_NAME_BYTES
            });
            let (asked, later) = rest.split_at(fits.count().max(1));
            rest = later;
            let params = |offset| GetParams {
                names: asked.to_vec(),
                offset: Some(offset),
                limit: None,
                types,
            };
            let values = self.client().pages(params, |page| {
                for (task, at) in page.tasks {
                    match reading.tasks.get(&task) {
                        Some(known) if known.cycle != at.cycle => mixed.push(task),
                        _ => drop(reading.tasks.insert(task, at)),
                    }
                }
                match (&mut reading.quality, page.quality) {
                    (Some(all), Some(more)) => all.extend(more),
                    (all, _) => *all = None,
                }
                reading.types.extend(page.types.unwrap_or_default());
                (page.total, page.values.0)
            })?;
            reading.values.0.extend(values);
        }
        reading.tasks.retain(|task, _| !mixed.contains(task));
        Ok(reading)
    }
}

/// The first name that was asked for and has no value. A pin with several names is answered by its first,
/// so it is enough that its block is there.
fn unanswered<'n>(names: &'n [String], values: &Values) -> Option<&'n str> {
    let owner = |name: &str| name.rsplit_once('.').map(|(owner, _)| owner.to_owned());
    let answered: BTreeSet<&str> = values.iter().map(|(name, _)| name).collect();
    let owners: BTreeSet<_> = answered.iter().filter_map(|name| owner(name)).collect();
    let mut names = names.iter().map(String::as_str);
    names.find(|name| {
        if name.contains('*') {
            answered.is_empty()
        } else {
            !answered.contains(name) && !owner(name).is_some_and(|of| owners.contains(&of))
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_without_a_value_is_found_and_a_pin_of_another_name_is_none() {
        let values: Values = [("ramp.status", 1.0), ("level", 2.0)].into_iter().collect();
        let unanswered = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
            super::unanswered(&names, &values).map(str::to_owned)
        };
        assert_eq!(unanswered(&["level", "ramp.subFunctionStatus", "ramp.*"]), None);
        assert_eq!(unanswered(&["level", "scale.y"]).as_deref(), Some("scale.y"));
        assert_eq!(unanswered(&["levle"]).as_deref(), Some("levle"));
        let names = ["*".to_owned()];
        assert_eq!(super::unanswered(&names, &Values::default()), Some("*"));
    }
}

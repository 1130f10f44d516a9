//! What ROS asks about the parameters of a node, and what is answered.

use isochrone_control::{Client, ClientError, Role, SetParams, SignalDescription, Values, Written};
use isochrone_recording::message::RosValue;

use super::value::{NOT_SET, given, not_set, parameter, type_of};

/// A parameter of every node of ROS, which a control node does not have: its time is that of its grid.
const USE_SIM_TIME: &str = "use_sim_time";
/// How the journal names the bridge.
const CLIENT: &str = "isochrone-ros2";

/// The parameters of a node, and who asks it.
pub(super) struct Parameters<'c> {
    pub(super) client: &'c mut Client,
    /// Those that can be set.
    pub(super) signals: &'c [SignalDescription],
    /// What was set since it was asked last, by name.
    pub(super) changed: Vec<(String, RosValue)>,
}

/// Whether a signal is a parameter of ROS: it can be set.
pub(super) fn is_parameter(signal: &SignalDescription) -> bool {
    matches!(signal.role, Role::Parameter | Role::Variable)
}

fn texts(value: Option<&RosValue>) -> Vec<String> {
    let parts = value.map(RosValue::parts).unwrap_or_default();
    parts.iter().filter_map(|part| part.text().map(str::to_owned)).collect()
}

fn text(text: impl Into<String>) -> RosValue {
    RosValue::Text(text.into())
}

/// A `SetParametersResult`.
fn result(done: &Result<(), String>) -> RosValue {
    let reason = done.as_ref().err().cloned().unwrap_or_default();
    RosValue::Message(vec![RosValue::Number(done.is_ok().into()), text(reason)])
}

impl Parameters<'_> {
    fn find(&self, name: &str) -> Option<&SignalDescription> {
        self.signals.iter().find(|signal| signal.name == name)
    }

    /// `get_parameters`
    pub(super) fn get(&mut self, request: &RosValue) -> Result<RosValue, ClientError> {
        let names = texts(request.parts().first());
        let known: Vec<&str> =
            names.iter().filter(|name| self.find(name).is_some()).map(String::as_str).collect();
        let values =
            if known.is_empty() { Values::default() } else { self.client.values(&known)? };
        let value = |name: &String| {
            self.find(name).map_or_else(not_set, |signal| parameter(signal, values.get(name)))
        };
        Ok(several(names.iter().map(value)))
    }

    /// `get_parameter_types`
    pub(super) fn types(&self, request: &RosValue) -> RosValue {
        let names = texts(request.parts().first());
        let kind = |name: &String| f64::from(self.find(name).map_or(NOT_SET, type_of));
        RosValue::Message(vec![RosValue::Numbers(names.iter().map(kind).collect())])
    }

    /// `list_parameters`
    pub(super) fn list(&self, request: &RosValue) -> RosValue {
        let prefixes = texts(request.parts().first());
        let depth = request.parts().get(1).and_then(RosValue::number).unwrap_or_default();
        let is_listed = |name: &str| {
            let is_shallow = |rest: &str| depth == 0.0 || (rest.split('.').count() as f64) <= depth;
            let within = |prefix: &String| {
                let rest = name.strip_prefix(&**prefix)?;
                Some(rest.is_empty() || rest.strip_prefix('.').is_some_and(is_shallow))
            };
            prefixes.is_empty() && is_shallow(name)
                || prefixes.iter().any(|prefix| within(prefix) == Some(true))
        };
        let mut found: Vec<&str> = Vec::new();
        let mut above: Vec<&str> = Vec::new();
        for signal in self.signals.iter().filter(|signal| is_listed(&signal.name)) {
            found.push(&signal.name);
            if let Some((prefix, _)) = signal.name.rsplit_once('.')
                && !above.contains(&prefix)
            {
                above.push(prefix);
            }
        }
        let all = |names: Vec<&str>| RosValue::Several(names.into_iter().map(text).collect());
        RosValue::Message(vec![RosValue::Message(vec![all(found), all(above)])])
    }

    /// `describe_parameters`
    pub(super) fn describe(&self, request: &RosValue) -> RosValue {
        let names = texts(request.parts().first());
        let descriptor = |name: &String| {
            let signal = self.find(name);
            let purpose = signal.map_or_else(String::new, SignalDescription::purpose);
            let unit = signal.and_then(|signal| signal.unit.clone());
            let description = unit.map_or(purpose.clone(), |unit| format!("{purpose} [{unit}]"));
            let limits = signal.and_then(|signal| signal.limits);
            let kind = signal.map_or(NOT_SET, type_of);
            let is_float = kind == super::value::DOUBLE;
            let range = |is_of_kind: bool, number: fn(f64) -> RosValue| {
                let [least, most] = limits.filter(|_| is_of_kind).unwrap_or_default();
                let range = RosValue::Message(vec![number(least), number(most), number(0.0)]);
                RosValue::Several(
                    limits.filter(|_| is_of_kind).map(|_| range).into_iter().collect(),
                )
            };
            let is_read_only = signal.is_none_or(|signal| signal.protected == Some(true));
            RosValue::Message(vec![
                text(name.clone()),
                RosValue::Number(kind.into()),
                text(description),
                text(""),
                RosValue::Number(is_read_only.into()),
                RosValue::Number(0.0),
                range(is_float, RosValue::Number),
                range(!is_float, |number| RosValue::Integer(number as i128)),
            ])
        };
        several(names.iter().map(descriptor))
    }

    /// `set_parameters`: one transaction each.
    pub(super) fn set_each(&mut self, request: &RosValue) -> RosValue {
        let wanted = request.parts().first().map(RosValue::parts).unwrap_or_default();
        let results: Vec<RosValue> =
            wanted.iter().map(|one| result(&self.set(std::slice::from_ref(one)))).collect();
        several(results.into_iter())
    }

    /// `set_parameters_atomically`: one transaction.
    pub(super) fn set_all(&mut self, request: &RosValue) -> RosValue {
        let wanted = request.parts().first().map(RosValue::parts).unwrap_or_default();
        RosValue::Message(vec![result(&self.set(wanted))])
    }

    fn set(&mut self, wanted: &[RosValue]) -> Result<(), String> {
        let mut values: Vec<(String, Written)> = Vec::new();
        for parameter in wanted {
            let [name, value] = parameter.parts() else { return Err("no parameter".into()) };
            let name = name.text().unwrap_or_default();
            if name == USE_SIM_TIME {
                return Err(format!(
                    "{USE_SIM_TIME} cannot be set: a control node keeps the machine's time"
                ));
            }
            let Some(signal) = self.find(name) else {
                return Err(format!("there is no parameter {name:?}"));
            };
            values.push((name.to_owned(), given(signal, value)?));
        }
        if values.is_empty() {
            return Ok(());
        }
        let params = SetParams {
            values: Values(values),
            client: Some(CLIENT.into()),
            ..SetParams::default()
        };
        let done = self.client.call(&params).map_err(|error| error.to_string())?;
        for (name, now) in done.after.iter() {
            if let Some(signal) = self.find(name) {
                let now = parameter(signal, Some(now));
                self.changed.push((name.to_owned(), now));
            }
        }
        Ok(())
    }
}

/// A message whose only field has these elements.
fn several(elements: impl Iterator<Item = RosValue>) -> RosValue {
    RosValue::Message(vec![RosValue::Several(elements.collect())])
}

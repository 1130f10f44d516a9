//! Permissions that the configuration gives to operators.

use std::sync::Arc;

use isochrone_engine::Pattern;
use isochrone_engine::Plan;
use isochrone_model::{Access, Code, Refusal, Role, Value};

use super::refusal::{protected, wrong_value};
use super::signals::Signal;

/// The purpose of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Intent {
    Set,
    Acknowledge,
    Force,
    Release,
    Apply,
}

/// Why the journal is not written, as part of a sentence, such as "the journal log.jsonl cannot be written (disk
/// full)".
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unwritten {
    /// Writing is tried again.
    ForNow(Arc<str>),
    /// Nothing more is written to it until the node is started again.
    ForGood(Arc<str>),
}

impl Unwritten {
    /// The obstacle.
    pub fn reason(&self) -> &str {
        let (Self::ForNow(reason) | Self::ForGood(reason)) = self;
        reason
    }

    /// The refusal of a change while the journal is not written.
    fn refusal(&self) -> Refusal {
        let help = match self {
            Self::ForNow(_) => {
                "make it writable; the node tries again all the time, and only releases forces until then"
            }
            Self::ForGood(_) => "start the node again; until then it only releases forces",
        };
        let message = format!("nothing can be changed while {}", self.reason());
        Refusal::one(Code::Forbidden, "", message, help)
    }
}

/// The bounds of some parameters and variables.
#[derive(Debug, Clone, PartialEq)]
struct Limits {
    /// As the configuration names them.
    names: String,
    pattern: Pattern,
    min: f64,
    max: f64,
}

#[derive(Debug, Clone)]
pub(super) struct Permissions {
    control: Access,
    protected: Vec<(String, Pattern)>,
    limits: Vec<Limits>,
    /// Why the journal cannot be written, while it cannot.
    pub(super) unwritten: Option<Unwritten>,
}

impl Permissions {
    pub(super) fn of(plan: &Plan) -> Self {
        let protected = plan.protected.iter().map(|text| (text.clone(), Pattern::new(text)));
        let limits = plan.limits.iter().map(|limit| Limits {
            names: limit.names.clone(),
            pattern: Pattern::new(&limit.names),
            min: limit.min,
            max: limit.max,
        });
        let (protected, limits) = (protected.collect(), limits.collect());
        Self { control: plan.control, protected, limits, unwritten: None }
    }

    /// Whether requests of this kind are allowed at all.
    pub(super) fn check(&self, intent: Intent) -> Result<(), Refusal> {
        let (action, needs) = match intent {
            Intent::Set => ("setting a parameter", Access::Set),
            Intent::Acknowledge => ("acknowledging an alarm", Access::Set),
            Intent::Force => ("forcing a signal", Access::Force),
            Intent::Release => ("releasing a signal", Access::Force),
            Intent::Apply => ("changing the configuration", Access::Force),
        };
        if self.control < needs {
            let (control, needs) = (self.control.as_str(), needs.as_str());
            let message = format!("[node] control = \"{control}\" does not allow {action}");
            let help = format!("write control = \"{needs}\" and start the node again");
            return Err(Refusal::one(Code::Forbidden, "", message, help));
        }
        match &self.unwritten {
            // Forces can be released, and alarms acknowledged, even if the journal cannot be written.
            Some(why) if !matches!(intent, Intent::Release | Intent::Acknowledge) => {
                Err(why.refusal())
            }
            _ => Ok(()),
        }
    }

    /// The limits that differ between two configurations, each with the range before and after.
    pub(super) fn changed_limits(&self, new: &Self) -> Vec<String> {
        let of = |all: &[Limits], names: &str| {
            let bounds = |limits: &Limits| format!("{:?} to {:?}", limits.min, limits.max);
            let found = all.iter().find(|limits| limits.names == names);
            found.map_or_else(|| "none".to_owned(), bounds)
        };
        let added = new
            .limits
            .iter()
            .filter(|of_new| !self.limits.iter().any(|known| known.names == of_new.names));
        let names = self.limits.iter().chain(added).map(|limits| &limits.names);
        names
            .map(|names| (names, of(&self.limits, names), of(&new.limits, names)))
            .filter(|(_, before, after)| before != after)
            .map(|(names, before, after)| format!("{names}: {before} -> {after}"))
            .collect()
    }

    /// The patterns of protected names.
    pub(super) fn protected(&self) -> impl Iterator<Item = (&str, &Pattern)> {
        self.protected.iter().map(|(text, pattern)| (text.as_str(), pattern))
    }

    /// Whether a signal is protected.
    pub(super) fn check_name(&self, signal: &Signal<'_>) -> Result<(), Refusal> {
        // Protection of an input covers its `ok` and `age`, too.
        let owner = match signal.role {
            Role::Ok | Role::Age => signal.name.rsplit_once('.').map(|(owner, _)| owner),
            _ => None,
        };
        let protects = |(_, pattern): &&(String, Pattern)| {
            pattern.matches(&signal.name) || owner.is_some_and(|owner| pattern.matches(owner))
        };
        match self.protected.iter().find(protects) {
            Some((pattern, _)) => Err(protected(&signal.name, pattern)),
            None => Ok(()),
        }
    }

    /// The slot of a value, if the signal can have it.
    pub(super) fn slot(&self, signal: &Signal<'_>, value: Value) -> Result<f64, Refusal> {
        let slot = signal.slot_of(value);
        let slot = slot.ok_or_else(|| wrong_value(&signal.name, value, signal.value_type))?;
        // Limits apply to numbers, and a task is not a number.
        let is_number = !matches!(value, Value::Task { .. }) && !slot.is_nan();
        if is_number { self.bound(signal, slot, value) } else { Ok(slot) }
    }

    /// The limits of a parameter or a variable, if there are any: least and greatest value.
    pub(super) fn limits(&self, signal: &Signal<'_>) -> Option<[f64; 2]> {
        let of_it = |limits: &&Limits| limits.pattern.matches(&signal.name);
        let limits = self.limits.iter().filter(|_| signal.role.is_settable()).filter(of_it);
        let bounds = limits.map(|limits| [limits.min, limits.max]);
        bounds.reduce(|a, b| [a[0].max(b[0]), a[1].min(b[1])])
    }

    /// Whether a value lies within the limits of a signal.
    pub(super) fn bound(
        &self,
        signal: &Signal<'_>,
        slot: f64,
        value: Value,
    ) -> Result<f64, Refusal> {
        let is_outside = |limits: &&Limits| {
            !(limits.min..=limits.max).contains(&slot) && limits.pattern.matches(&signal.name)
        };
        match self.limits.iter().find(is_outside) {
            Some(&Limits { min, max, .. }) if signal.role.is_settable() => {
                let name = &signal.name;
                let message =
                    format!("{value} is outside the limits of \"{name}\", {min:?} to {max:?}");
                let help = match signal.role {
                    Role::Variable => "its range, or [limits], in the configuration sets them",
                    _ => "[limits] in the configuration sets them",
                };
                Err(Refusal::one(Code::WrongValue, name, message, help))
            }
            _ => Ok(slot),
        }
    }
}

//! The keys of `[[task]]` other than its name: each is a field here, read in [`read`](TaskSettings::read) and written
//! in [`written`](TaskSettings::written). Plans, `check` and `apply` use these settings as they are.

use std::ops::Range;

use isochrone_model::{Followed, format_duration_ns};
use isochrone_model::{Margin, MissLimit, Overrun, Schedule, Wake};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use toml::Spanned;

use crate::config::Cpu;
use crate::keys::{follow, on_overrun, task as keys};
use crate::parse::{Section, task as parse};
use isochrone_model::escaped;

/// The keys of a task. A key that could not be read has the value that it has when it is left out; the error about
/// it keeps the plan from being made.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TaskSettings {
    /// Period, 10 us to 1 h; 0: it could not be read.
    pub period_ns: u64,
    /// Offset of the releases on the common grid, less than the period.
    pub phase_ns: u64,
    /// Why it has this phase, with `phase = "auto"`; `None`: the configuration gives it, or leaves it at 0.
    pub phase_reason: Option<String>,
    /// OB number.
    pub ob: Option<i16>,
    /// SCHED_FIFO priority, 1 to 89; `None`: normal scheduling.
    pub priority: Option<u8>,
    /// Where its thread runs.
    #[serde(serialize_with = "cpu")]
    pub cpu: Cpu,
    /// How it waits for its releases.
    #[serde(flatten, serialize_with = "wake")]
    pub wake: Wake,
    /// The service of one of its inputs whose frames its cycles begin with.
    pub follow: Option<Followed>,
    /// Place of that service's name in the file.
    #[serde(skip)]
    pub follow_span: Range<usize>,
    /// What to do about releases that were missed.
    #[serde(serialize_with = "overrun")]
    pub overrun: Overrun,
    /// How many missed releases end the node.
    #[serde(serialize_with = "on_overrun")]
    pub on_overrun: Option<MissLimit>,
}

impl TaskSettings {
    /// Reads the keys of a `[[task]]`.
    pub(crate) fn read(section: &Section<'_>) -> Self {
        let period_ns = section.duration_ns(&keys::PERIOD);
        let period_ns = period_ns.as_ref();
        let wake = parse::wake(section, period_ns);
        let follow = section.table(&keys::FOLLOW, &follow::TABLE);
        let follow = follow.and_then(|table| parse::follow(&table, wake, period_ns));
        let follow_span = follow.as_ref().map_or(0..0, Spanned::span);
        let limit = section.table(&keys::ON_OVERRUN, &on_overrun::TABLE);
        let (phase_ns, phase_reason) = parse::phase(section, period_ns);
        Self {
            period_ns: period_ns.map_or(0, |period_ns| *period_ns.get_ref()),
            phase_ns,
            phase_reason,
            ob: section.integer(&keys::OB).map(Spanned::into_inner),
            priority: section.integer(&keys::PRIORITY).map(Spanned::into_inner),
            cpu: parse::cpu(section),
            wake,
            follow: follow.map(Spanned::into_inner),
            follow_span,
            overrun: section
                .choice(&keys::OVERRUN, &Overrun::ALL)
                .map_or(Overrun::Skip, Spanned::into_inner),
            on_overrun: limit.and_then(|table| parse::miss_limit(&table)),
        }
    }

    /// Each key with its value, as people read them; `None`: the key is left out and nothing takes its place.
    pub fn written(&self) -> Vec<(&'static str, Option<String>)> {
        let wake = self.wake.as_str();
        vec![
            (keys::PERIOD.name, Some(format_duration_ns(self.period_ns))),
            (keys::PHASE.name, Some(format_duration_ns(self.phase_ns))),
            (keys::OB.name, self.ob.map(|ob| ob.to_string())),
            (keys::PRIORITY.name, self.priority.map(|priority| priority.to_string())),
            (keys::CPU.name, Some(self.cpu.to_string())),
            (
                keys::WAKE.name,
                Some(match self.wake {
                    Wake::Sleep | Wake::Spin => wake.to_owned(),
                    Wake::Hybrid(Margin::Fixed(margin_ns)) => {
                        format!("{wake} (margin {})", format_duration_ns(margin_ns))
                    }
                    Wake::Hybrid(Margin::Adaptive { cpu_budget }) => {
                        format!("{wake} (cpu_budget {cpu_budget})")
                    }
                }),
            ),
            (
                keys::FOLLOW.name,
                self.follow.as_ref().map(|Followed { service, within_ns }| {
                    let (service, within) = (escaped(service), format_duration_ns(*within_ns));
                    format!("{{ service = \"{service}\", within = \"{within}\" }}")
                }),
            ),
            (keys::OVERRUN.name, Some(self.overrun.as_str().to_owned())),
            (
                keys::ON_OVERRUN.name,
                self.on_overrun.map(|MissLimit { misses, cycles }| {
                    format!("{{ misses = {misses}, cycles = {cycles} }}")
                }),
            ),
        ]
    }

    /// What is different in others, a sentence for each key. What was chosen when the node started is no
    /// difference, where both leave it open.
    pub fn differences(&self, new: &Self) -> Vec<String> {
        let mut new = new.clone();
        if self.phase_reason.is_some() && new.phase_reason.is_some() {
            new.phase_ns = self.phase_ns;
        }
        let shown = |value: &Option<String>| value.clone().unwrap_or_else(|| "not set".into());
        let pairs = self.written().into_iter().zip(new.written());
        pairs
            .filter(|((_, old), (_, new))| old != new)
            .map(|((key, old), (_, new))| {
                format!("its {key} is {} and would be {}", shown(&old), shown(&new))
            })
            .collect()
    }

    /// When it is due, how it waits, and what it does when it is late.
    pub fn schedule(&self) -> Schedule {
        Schedule {
            period_ns: self.period_ns,
            phase_ns: self.phase_ns,
            wake: self.wake,
            overrun: self.overrun,
            limit: self.on_overrun,
            follow_within_ns: self.follow.as_ref().map(|follow| follow.within_ns),
        }
    }

    /// The service that it follows.
    pub fn followed_service(&self) -> Option<&str> {
        self.follow.as_ref().map(|follow| follow.service.as_str())
    }
}

fn cpu<S: Serializer>(cpu: &Cpu, serializer: S) -> Result<S::Ok, S::Error> {
    cpu.number().serialize(serializer)
}

/// The margin stands beside the way to wait that it belongs to.
fn wake<S: Serializer>(wake: &Wake, serializer: S) -> Result<S::Ok, S::Error> {
    let margin = wake.margin();
    let mut map = serializer.serialize_map(None)?;
    map.serialize_entry("wake", wake.as_str())?;
    map.serialize_entry("margin_ns", &margin.and_then(Margin::fixed_ns))?;
    map.serialize_entry("cpu_budget", &margin.and_then(Margin::cpu_budget))?;
    map.end()
}

fn overrun<S: Serializer>(overrun: &Overrun, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(overrun.as_str())
}

fn on_overrun<S: Serializer>(limit: &Option<MissLimit>, serializer: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Limit {
        misses: u32,
        cycles: u64,
    }
    limit.map(|MissLimit { misses, cycles }| Limit { misses, cycles }).serialize(serializer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys::Absent;
    use crate::{Plan, Rules, Source};

    /// Makes a plan of a task that has this key, or its own value of it, with this value.
    fn plan(key: &str, value: &str) -> Result<Plan, String> {
        let mut lines = vec![("name", "\"t\""), ("period", "\"1ms\""), ("wake", "\"hybrid\"")];
        lines.retain(|(other, _)| *other != key);
        lines.push((key, value));
        let lines: String = lines.iter().map(|(key, value)| format!("{key} = {value}\n")).collect();
        let text = format!("[node]\nname = \"n\"\n[[task]]\n{lines}");
        Plan::new(Source::new("n.toml", text), &Rules::default()).map_err(|found| found.to_string())
    }

    #[test]
    fn every_key_of_a_task_is_read_and_no_other_type_is_taken_for_its_own() {
        for key in keys::TABLE.keys {
            // No key takes an array of arrays.
            let Err(found) = plan(key.name, "[[]]") else { panic!("nothing reads {}", key.name) };
            assert!(found.contains(&format!("{} is ", key.name)), "{}: {found}", key.name);
        }
    }

    #[test]
    fn the_default_of_a_key_of_a_task_is_what_a_task_without_it_has() {
        let without = &plan("period", "\"1ms\"").unwrap().tasks[0].settings;
        for key in keys::TABLE.keys {
            let Absent::Default(value) = key.absent else { continue };
            let made = plan(key.name, value).unwrap_or_else(|found| panic!("{found}"));
            assert_eq!(&made.tasks[0].settings, without, "{} = {value}", key.name);
        }
    }

    #[test]
    fn every_key_of_a_task_is_shown_as_text_and_as_json() {
        let settings = &plan("ob", "35").unwrap().tasks[0].settings;
        let (written, json) = (settings.written(), serde_json::to_value(settings).unwrap());
        // The name stands before the settings; the two kinds of margin stand with `wake` in the text.
        for key in keys::TABLE.keys.iter().filter(|key| key.name != keys::NAME.name) {
            let is_json = |end: &str| json.get(format!("{}{end}", key.name)).is_some();
            assert!(is_json("") || is_json("_ns"), "no field of the name {}: {json}", key.name);
            let is_margin = [keys::MARGIN.name, keys::CPU_BUDGET.name].contains(&key.name);
            let is_written = written.iter().any(|(name, _)| *name == key.name);
            assert!(is_written || is_margin, "`written` lacks {}", key.name);
        }
    }
}

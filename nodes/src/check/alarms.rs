//! The process alarms in what `check` shows.

use isochrone_engine::{AlarmPlan, escaped, format_duration_ns};
use isochrone_model::AlarmSeverity;
use serde::Serialize;

/// A process alarm.
#[derive(Serialize)]
pub(crate) struct AlarmRow<'a> {
    name: &'a str,
    when: &'a str,
    for_ns: u64,
    hysteresis: f64,
    severity: AlarmSeverity,
    text: &'a str,
}

impl<'a> AlarmRow<'a> {
    pub(crate) fn of(alarm: &'a AlarmPlan) -> Self {
        Self {
            name: &alarm.name,
            when: &alarm.when,
            for_ns: alarm.delay_ns,
            hysteresis: alarm.hysteresis,
            severity: alarm.severity,
            text: &alarm.text,
        }
    }

    pub(crate) fn cells(&self) -> [String; 4] {
        let mut when = escaped(self.when).into_owned();
        if self.for_ns > 0 {
            when += &format!(" for {}", format_duration_ns(self.for_ns));
        }
        if self.hysteresis > 0.0 {
            when += &format!(", hysteresis {:?}", self.hysteresis);
        }
        let text = if self.text == self.when { "" } else { self.text };
        let text = escaped(text).into_owned();
        [self.name.to_owned(), self.severity.to_string(), when, text]
    }
}

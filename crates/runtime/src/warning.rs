//! Warnings of a report: what the machine refused, and the alarms of the run.

use isochrone_cyclic::GrantRefusal;
use isochrone_timing::{Warning, WarningCode};

use crate::alarms::Alarm;
use crate::error::{SupervisorPanicked, TaskPanicked};

/// The warning for a refusal.
pub fn warning(refusal: &GrantRefusal) -> Warning {
    Warning {
        code: refusal.code().into(),
        message: refusal.to_string(),
        remedy: refusal.remedy().to_owned(),
    }
}

impl From<&Alarm> for Warning {
    fn from(alarm: &Alarm) -> Self {
        Self { code: alarm.code(), message: alarm.to_string(), remedy: alarm.remedy() }
    }
}

impl From<&TaskPanicked> for Warning {
    fn from(panic: &TaskPanicked) -> Self {
        Self::new(WarningCode::Panicked, panic.to_string())
    }
}

impl From<&SupervisorPanicked> for Warning {
    fn from(panic: &SupervisorPanicked) -> Self {
        Self::new(WarningCode::Panicked, panic.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_has_a_code_that_readers_of_reports_know() {
        let refusals = [
            GrantRefusal::of_memory("EPERM", "free memory"),
            GrantRefusal::of_cpu("EINVAL", "choose another"),
            GrantRefusal::of_priority("EPERM", "allow it"),
        ];
        let codes = refusals.each_ref().map(|refusal| warning(refusal).code);
        assert_eq!(codes, [WarningCode::LockDenied, WarningCode::CpuDenied, WarningCode::RtDenied]);
    }
}

//! Alarms about a service that stand until they end.

use std::time::{Duration, Instant};

use isochrone_timing::WarningCode;

use crate::alarms::Alarm;

/// The alarms of one service that have not ended.
#[derive(Debug, Default)]
pub(crate) struct StandingConditions {
    alarms: Vec<StandingAlarm>,
    changes: Vec<StateChange>,
}

#[derive(Debug)]
struct StandingAlarm {
    alarm: Alarm,
    /// When it was last observed; `None`: it lasts until it is ended.
    observed: Option<Instant>,
}

impl StandingAlarm {
    fn is(&self, code: &WarningCode, subject: &str) -> bool {
        self.alarm.code() == *code && self.alarm.subject() == subject
    }
}

/// An alarm that began or ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct StateChange {
    pub(crate) code: WarningCode,
    /// The service, or the input that it is about.
    pub(crate) name: String,
    /// Its sentence, with the remedy; `None`: it has ended.
    pub(crate) meaning: Option<String>,
}

impl StateChange {
    /// The beginning of an alarm.
    pub(crate) fn begin(alarm: &Alarm) -> Self {
        Self { meaning: Some(alarm.sentence()), ..Self::end(alarm) }
    }

    /// The end of an alarm.
    pub(crate) fn end(alarm: &Alarm) -> Self {
        Self { code: alarm.code(), name: alarm.subject().to_owned(), meaning: None }
    }
}

impl StandingConditions {
    /// Whether an alarm stands.
    pub(crate) fn has(&self, code: &WarningCode, subject: &str) -> bool {
        self.alarms.iter().any(|standing| standing.is(code, subject))
    }

    /// Begins or renews an alarm that was observed just now; whether it is new.
    pub(crate) fn observe(&mut self, alarm: &Alarm) -> bool {
        self.hold(alarm, Some(Instant::now()))
    }

    /// Begins an alarm that lasts until it is [ended](Self::end); whether it is new or has changed.
    pub(crate) fn begin(&mut self, alarm: &Alarm) -> bool {
        self.hold(alarm, None)
    }

    fn hold(&mut self, alarm: &Alarm, observed: Option<Instant>) -> bool {
        let (code, subject) = (alarm.code(), alarm.subject());
        if let Some(known) = self.alarms.iter_mut().find(|standing| standing.is(&code, subject)) {
            known.observed = observed;
            if observed.is_some() || known.alarm == *alarm {
                return false;
            }
            known.alarm = alarm.clone();
            self.changes.push(StateChange::begin(alarm));
            return true;
        }
        self.alarms.push(StandingAlarm { alarm: alarm.clone(), observed });
        self.changes.push(StateChange::begin(alarm));
        true
    }

    /// Ends an alarm, and returns it.
    pub(crate) fn end(&mut self, code: &WarningCode, subject: &str) -> Option<Alarm> {
        let place = self.alarms.iter().position(|standing| standing.is(code, subject))?;
        let alarm = self.alarms.remove(place).alarm;
        self.changes.push(StateChange::end(&alarm));
        Some(alarm)
    }

    /// Ends alarms that were not observed for this long, and returns them.
    pub(crate) fn expire(&mut self, longest: Duration) -> Vec<Alarm> {
        let is_over =
            |standing: &StandingAlarm| standing.observed.is_some_and(|it| it.elapsed() > longest);
        let over = self
            .alarms
            .iter()
            .filter(|standing| is_over(standing))
            .map(|standing| standing.alarm.clone());
        let over: Vec<Alarm> = over.collect();
        over.iter().filter_map(|alarm| self.end(&alarm.code(), alarm.subject())).collect()
    }

    /// The alarms that began and ended since the last call, in order.
    pub(crate) fn changes(&mut self) -> Vec<StateChange> {
        std::mem::take(&mut self.changes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn other_writer(service: &str) -> Alarm {
        Alarm::OtherWriter { service: service.to_owned(), publishers: Vec::new() }
    }

    fn told(standing: &mut StandingConditions) -> Vec<(String, bool)> {
        let changes = standing.changes().into_iter();
        changes.map(|it| (format!("{} {}", it.code, it.name), it.meaning.is_some())).collect()
    }

    #[test]
    fn a_state_comes_once_and_goes_when_it_is_not_observed_any_more() {
        let mut standing = StandingConditions::default();
        let ahead = Alarm::FutureStamps { service: "a".into(), ahead_ns: 7 };
        assert!(standing.observe(&other_writer("a")) && standing.observe(&ahead));
        assert!(!standing.observe(&other_writer("a")));
        let both = [("other_writer a".to_owned(), true), ("future_stamps a".to_owned(), true)];
        assert_eq!(told(&mut standing), both);
        assert!(standing.expire(Duration::from_secs(60)).is_empty());
        assert_eq!(standing.expire(Duration::ZERO), [other_writer("a"), ahead]);
        assert_eq!(told(&mut standing), both.map(|(what, _)| (what, false)));
        assert!(standing.observe(&other_writer("a")), "it comes again");
    }

    #[test]
    fn a_state_that_was_begun_lasts_until_it_is_ended() {
        let mut standing = StandingConditions::default();
        let far = Alarm::FarFollow { task: "t".into(), service: "a".into() };
        assert!(standing.begin(&far) && !standing.begin(&far));
        assert!(standing.expire(Duration::ZERO).is_empty());
        assert_eq!(standing.end(&WarningCode::FarFollow, "b"), None);
        assert_eq!(standing.end(&WarningCode::FarFollow, "a"), Some(far));
        assert_eq!(told(&mut standing).len(), 2);
    }
}

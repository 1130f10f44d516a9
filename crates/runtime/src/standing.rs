//! What is wrong with a service while it lasts.

use std::time::{Duration, Instant};

use isochrone_timing::WarningCode;

use crate::alarms::Alarm;

/// States of one service that were observed and are not over.
#[derive(Debug, Default)]
pub(crate) struct StandingConditions {
    held: Vec<Held>,
    changes: Vec<StateChange>,
}

#[derive(Debug)]
struct Held {
    alarm: Alarm,
    /// When it was last observed; `None`: it lasts until it is ended.
    observed: Option<Instant>,
}

impl Held {
    fn is(&self, code: &WarningCode, subject: &str) -> bool {
        self.alarm.code() == *code && self.alarm.subject() == subject
    }
}

/// A state that came or went.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct StateChange {
    pub(crate) code: WarningCode,
    /// The service, or the input that it is about.
    pub(crate) name: String,
    /// In words, with the remedy; `None`: it is over.
    pub(crate) meaning: Option<String>,
}

impl StateChange {
    /// That it came.
    pub(crate) fn begin(alarm: &Alarm) -> Self {
        Self { meaning: Some(alarm.sentence()), ..Self::end(alarm) }
    }

    /// That it is over.
    pub(crate) fn end(alarm: &Alarm) -> Self {
        Self { code: alarm.code(), name: alarm.subject().to_owned(), meaning: None }
    }
}

impl StandingConditions {
    /// Whether a state lasts.
    pub(crate) fn has(&self, code: &WarningCode, subject: &str) -> bool {
        self.held.iter().any(|held| held.is(code, subject))
    }

    /// Takes note of a state that was observed just now; whether that is news.
    pub(crate) fn observe(&mut self, alarm: &Alarm) -> bool {
        self.hold(alarm, Some(Instant::now()))
    }

    /// Takes note of a state that lasts until it is [ended](Self::end); whether that is news, or it is put
    /// otherwise than before.
    pub(crate) fn begin(&mut self, alarm: &Alarm) -> bool {
        self.hold(alarm, None)
    }

    fn hold(&mut self, alarm: &Alarm, observed: Option<Instant>) -> bool {
        let (code, subject) = (alarm.code(), alarm.subject());
        if let Some(known) = self.held.iter_mut().find(|held| held.is(&code, subject)) {
            known.observed = observed;
            if observed.is_some() || known.alarm == *alarm {
                return false;
            }
            known.alarm = alarm.clone();
            self.changes.push(StateChange::begin(alarm));
            return true;
        }
        self.held.push(Held { alarm: alarm.clone(), observed });
        self.changes.push(StateChange::begin(alarm));
        true
    }

    /// Ends a state; returns what it was.
    pub(crate) fn end(&mut self, code: &WarningCode, subject: &str) -> Option<Alarm> {
        let place = self.held.iter().position(|held| held.is(code, subject))?;
        let alarm = self.held.remove(place).alarm;
        self.changes.push(StateChange::end(&alarm));
        Some(alarm)
    }

    /// Ends those that were not observed for so long; returns what they were.
    pub(crate) fn expire(&mut self, longest: Duration) -> Vec<Alarm> {
        let is_over = |held: &Held| held.observed.is_some_and(|it| it.elapsed() > longest);
        let over = self.held.iter().filter(|held| is_over(held)).map(|held| held.alarm.clone());
        let over: Vec<Alarm> = over.collect();
        over.iter().filter_map(|alarm| self.end(&alarm.code(), alarm.subject())).collect()
    }

    /// What came and went since the last time, in its order.
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

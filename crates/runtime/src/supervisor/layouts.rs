//! The layouts of received frames, with which the supervisor resolves a node's inputs.

use std::fmt;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use isochrone_engine::config::Binding;
use isochrone_ipc::{
    Announcement, Flags, LayoutWatcher, OpenError, Participant, SenderClock, Service,
    longest_silence_ns,
};
use isochrone_timing::WarningCode;

use super::units::AnnouncedUnit;
use crate::node::alarms::Alarm;
use crate::node::standing::{StandingConditions, StateChange};
use crate::task::bindings::{Bindings, Desk, Unfit};
use crate::task::limiter::{Allowed, Limiter};

/// How long frames may have a layout that nobody announces before an alarm is raised. Publishers announce theirs
/// within half of it.
const PATIENCE: Duration = Duration::from_secs(1);

/// Resolves the inputs of one service, and raises the alarms about its frames.
pub(crate) struct Resolver<S: Service> {
    desk: Desk,
    watcher: LayoutWatcher<S>,
    /// The layout that was last sent to the cycle.
    sent: Option<Announcement>,
    /// Since when frames have had a layout that nobody announces.
    unknown_since: Option<Instant>,
    raised: Vec<Alarm>,
    standing: StandingConditions,
    /// Count of frames from other writers, as last seen.
    other_writers: u64,
    /// Since when there have been other writers whose names are not known yet.
    unnamed_since: Option<Instant>,
    /// For each input, the signal that its channel carried first.
    first_signals: Vec<Option<String>>,
    /// For each input, the units that its signal was announced in.
    units: Vec<AnnouncedUnit>,
    /// For each input, why it does not fit the layout.
    conflicts: Vec<Option<String>>,
    /// For each input, why it takes no sample; `has_reasons`: that has changed.
    reasons: Vec<Option<String>>,
    has_reasons: bool,
    /// For each input, as a publisher may change its layout again and again.
    limiters: Vec<Limiter<News>>,
    /// For messages about the whole service.
    limiter: Limiter<News>,
}

impl<S: Service> Resolver<S> {
    /// Opens the service on which layouts are announced.
    pub(crate) fn open(participant: &Participant<S>, desk: Desk) -> Result<Self, OpenError> {
        let watcher = LayoutWatcher::open(participant, &desk.service)?;
        let inputs = desk.inputs.len();
        Ok(Self {
            desk,
            watcher,
            sent: None,
            unknown_since: None,
            raised: Vec::new(),
            standing: StandingConditions::default(),
            other_writers: 0,
            unnamed_since: None,
            first_signals: vec![None; inputs],
            units: vec![AnnouncedUnit::default(); inputs],
            conflicts: vec![None; inputs],
            reasons: vec![None; inputs],
            has_reasons: false,
            limiters: std::iter::repeat_with(Limiter::default).take(inputs).collect(),
            limiter: Limiter::default(),
        })
    }

    /// Looks for new layouts and observations; call it about fifty times a second.
    pub(crate) fn tend(&mut self, participant: &Participant<S>) {
        self.watcher.look(participant);
        let unknown = self.desk.observed.unknown_layout.load(Ordering::Relaxed);
        // The layout that frames carry counts; before the first frame, the one that was announced last.
        let announced = match (unknown, &self.sent) {
            (0, None) => self.watcher.newest(),
            (0, Some(sent)) => self.watcher.find(sent.number),
            (unknown, _) => self.watcher.find(unknown),
        };
        match announced.cloned() {
            Some(announced) if self.sent.as_ref() != Some(&announced) => self.resolve(announced),
            _ => {}
        }
        self.note_unknown(unknown);
        self.note_other_writers(participant);
        self.note_observed();
        for limiter in self.limiters.iter_mut().chain([&mut self.limiter]) {
            say(limiter.held());
        }
    }

    /// Why each input takes no sample, by its name, if that has changed.
    pub(crate) fn reasons(&mut self) -> Option<Vec<(String, Option<String>)>> {
        let reasons = self.desk.inputs.iter().cloned().zip(self.reasons.iter().cloned());
        std::mem::take(&mut self.has_reasons).then(|| reasons.collect())
    }

    /// The announced units that have changed, by input.
    pub(crate) fn units(&mut self) -> Vec<(String, String)> {
        let inputs = self.desk.inputs.iter().zip(&mut self.units);
        inputs.filter_map(|(input, unit)| Some((input.clone(), unit.news()?))).collect()
    }

    /// The alarms about the service that began or ended since the last call.
    pub(crate) fn state_changes(&mut self) -> Vec<StateChange> {
        self.standing.changes()
    }

    fn set_reason(&mut self, index: usize, reason: Option<String>) {
        if let Some(known) = self.reasons.get_mut(index) {
            self.has_reasons |= *known != reason;
            *known = reason;
        }
    }

    /// The alarms that were raised, for the report.
    pub(crate) fn alarms(&mut self) -> Vec<Alarm> {
        std::mem::take(&mut self.raised)
    }

    fn resolve(&mut self, announced: Announcement) {
        let places = self.desk.wanted.iter().map(|wanted| wanted.place(&announced.layout));
        let places: Vec<_> = places.collect();
        let bindings = Bindings {
            layout: announced.number,
            clock: announced.clock(),
            period_ns: announced.layout.period_ns,
            places: places.iter().map(|it| it.as_ref().copied().map_err(Unfit::missing)).collect(),
        };
        if !self.desk.send(bindings) {
            // The cycle has not taken the previous bindings yet; the next call tries again.
            return;
        }
        let service = self.desk.service.clone();
        if announced.clock() == SenderClock::Foreign {
            let publisher = announced.publisher.clone();
            self.raise(None, Alarm::ForeignHost { service: service.clone(), publisher });
            if let Some(task) = self.desk.follower.clone() {
                let alarm = Alarm::FarFollow { task, service: service.clone() };
                if self.standing.begin(&alarm) {
                    self.raise_or_log(alarm);
                }
            }
        } else {
            self.end(None, &WarningCode::FarFollow, &service);
        }
        self.note_moved(&announced, &places);
        self.note_units(&announced, &places);
        for (index, place) in places.into_iter().enumerate() {
            let has_other_unit = matches!(place, Err(Unfit::Unit { .. }));
            let conflict = place.err().map(|conflict| conflict.to_string());
            let Some(known) = self.conflicts.get_mut(index) else { continue };
            if *known == conflict {
                continue;
            }
            known.clone_from(&conflict);
            let input = self.desk.inputs.get(index).cloned().unwrap_or_default();
            let of = |why| {
                format!("service \"{service}\" of \"{}\" does not fit: {why}", announced.publisher)
            };
            self.set_reason(index, conflict.as_ref().map(of));
            match conflict {
                // It is the alarm of its own kind.
                Some(_) if has_other_unit => {}
                Some(why) => {
                    let (service, publisher) = (service.clone(), announced.publisher.clone());
                    let alarm = Alarm::UnfitInput { input, service, publisher, why };
                    self.raise(Some(index), alarm);
                }
                None => {
                    let sentence = format!("input \"{input}\" reads service \"{service}\" again");
                    self.log(Some(index), News::Good(sentence));
                }
            }
        }
        self.sent = Some(announced);
    }

    /// Raises an alarm for inputs that are bound by channel and read another signal from now on.
    fn note_moved(&mut self, announced: &Announcement, places: &[Result<usize, Unfit>]) {
        for (index, place) in places.iter().enumerate() {
            let wanted = self.desk.wanted.get(index).map(|wanted| &wanted.binding);
            let (Ok(channel), Some(Binding::Channel(_))) = (place, wanted) else { continue };
            let signal = announced.layout.signals.get(*channel);
            let now = signal.map_or_else(String::new, |signal| signal.name.clone());
            let Some(first) = self.first_signals.get_mut(index) else { continue };
            let before = first.get_or_insert_with(|| now.clone()).clone();
            let input = self.desk.inputs.get(index).cloned().unwrap_or_default();
            if before == now {
                self.end(Some(index), &WarningCode::MovedChannel, &input);
                continue;
            }
            let service = self.desk.service.clone();
            let alarm = Alarm::MovedChannel { input, service, channel: *channel, before, now };
            if self.standing.begin(&alarm) {
                self.raise(Some(index), alarm);
            }
        }
    }

    /// Begins and ends the alarms about the units of inputs.
    fn note_units(&mut self, announced: &Announcement, places: &[Result<usize, Unfit>]) {
        for (index, place) in places.iter().enumerate() {
            let Some(unit) = self.units.get_mut(index) else { continue };
            match unit.note(&self.desk, index, place, &announced.layout) {
                Some(alarm) if self.standing.begin(&alarm) => self.raise(Some(index), alarm),
                Some(_) => {}
                None => {
                    let input = self.desk.inputs.get(index).cloned().unwrap_or_default();
                    self.end(Some(index), &WarningCode::Unit, &input);
                }
            }
        }
    }

    fn note_unknown(&mut self, unknown: u64) {
        if unknown == 0 || self.watcher.find(unknown).is_some() {
            if self.unknown_since.take().is_some() {
                for index in 0..self.conflicts.len() {
                    let conflict = self.conflicts.get(index).cloned().flatten();
                    self.set_reason(index, conflict);
                }
            }
            return;
        }
        let since = *self.unknown_since.get_or_insert_with(Instant::now);
        if since.elapsed() > PATIENCE {
            let service = self.desk.service.clone();
            for index in 0..self.desk.inputs.len() {
                let reason = format!(
                    "the frames of service \"{service}\" have a layout that nobody announces"
                );
                self.set_reason(index, Some(reason));
            }
            self.raise_once(Alarm::UnknownLayout { service, number: unknown });
        }
    }

    fn note_other_writers(&mut self, participant: &Participant<S>) {
        let other_writers = self.desk.observed.other_writers.load(Ordering::Relaxed);
        if other_writers == self.other_writers {
            return;
        }
        let service = self.desk.service.clone();
        let publishers = if self.standing.has(&WarningCode::OtherWriter, &service) {
            Some(Vec::new())
        } else {
            participant.publishers_at_once(&service)
        };
        let since = *self.unnamed_since.get_or_insert_with(Instant::now);
        if publishers.is_none() && since.elapsed() < PATIENCE {
            return;
        }
        self.unnamed_since = None;
        self.other_writers = other_writers;
        let publishers = publishers.unwrap_or_default();
        self.observe(Alarm::OtherWriter { service, publishers });
    }

    fn note_observed(&mut self) {
        let service = self.desk.service.clone();
        let observed = self.desk.observed.clone();
        match observed.ahead_ns.swap(0, Ordering::Relaxed) {
            0 => {}
            ahead_ns => self.observe(Alarm::FutureStamps { service: service.clone(), ahead_ns }),
        }
        match observed.behind_ns.swap(0, Ordering::Relaxed) {
            0 => {}
            behind_ns => self.observe(Alarm::PastStamps { service: service.clone(), behind_ns }),
        }
        match observed.old_source_ns.swap(0, Ordering::Relaxed) {
            0 => {}
            behind_ns => {
                let flags = Flags::from_bits(observed.old_source_flags.load(Ordering::Relaxed));
                self.observe(Alarm::OldSource { service: service.clone(), behind_ns, flags });
            }
        }
        let period_ns = self.sent.as_ref().and_then(|sent| sent.layout.period_ns);
        // Long enough for another frame, in which it would have been observed again.
        let longest_ns = longest_silence_ns(period_ns.unwrap_or_default()).saturating_mul(2);
        for over in self.standing.expire(Duration::from_nanos(longest_ns)) {
            self.log(None, News::Good(over.end()));
        }
        if observed.is_plain.load(Ordering::Relaxed)
            && let Some(input) = self.desk.by_signal().map(str::to_owned)
        {
            for index in self.desk.by_signals().collect::<Vec<_>>() {
                let reason = format!(
                    "the frames of service \"{service}\" do not say what they carry, so the signal \
                     cannot be found by its name"
                );
                self.set_reason(index, Some(reason));
            }
            self.raise_once(Alarm::PlainFrames { input, service });
        }
    }

    /// Raises an alarm unless one of its kind was raised before.
    fn raise_once(&mut self, alarm: Alarm) {
        if !self.has_raised(&alarm.code()) {
            self.raise(None, alarm);
        }
    }

    fn has_raised(&self, code: &WarningCode) -> bool {
        self.raised.iter().any(|raised| raised.code() == *code)
    }

    /// Begins or renews an alarm that was observed since the last call.
    fn observe(&mut self, alarm: Alarm) {
        if self.standing.observe(&alarm) {
            self.raise_or_log(alarm);
        }
    }

    /// Says that a state has come; the report has the first of its kind.
    fn raise_or_log(&mut self, alarm: Alarm) {
        if self.has_raised(&alarm.code()) {
            self.log(None, News::Bad(alarm.sentence()));
        } else {
            self.raise(None, alarm);
        }
    }

    fn end(&mut self, input: Option<usize>, code: &WarningCode, subject: &str) {
        if let Some(over) = self.standing.end(code, subject) {
            self.log(input, News::Good(over.end()));
        }
    }

    /// Logs a message about an input, or about the whole service.
    fn log(&mut self, input: Option<usize>, news: News) {
        let limiter = input.and_then(|input| self.limiters.get_mut(input));
        say(limiter.unwrap_or(&mut self.limiter).pass(news));
    }

    fn raise(&mut self, input: Option<usize>, alarm: Alarm) {
        self.log(input, News::Bad(alarm.sentence()));
        /// Bounds the memory if a publisher changes its layout again and again.
        const MOST: usize = 100;
        if self.raised.len() < MOST && !self.raised.contains(&alarm) {
            self.raised.push(alarm);
        }
    }
}

/// A log message about a service, or an input of it.
#[derive(Debug)]
enum News {
    /// Something is wrong.
    Bad(String),
    /// A fault has ended.
    Good(String),
}

impl fmt::Display for News {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Bad(sentence) | Self::Good(sentence)) = self;
        f.write_str(sentence)
    }
}

fn say(news: Option<Allowed<News>>) {
    match news {
        Some(news @ Allowed { message: News::Bad(_), .. }) => tracing::warn!("{news}"),
        Some(news) => tracing::info!("{news}"),
        None => {}
    }
}

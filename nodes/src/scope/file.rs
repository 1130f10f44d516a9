//! Files that are looked at again, or searched for a trigger.

mod readable;
mod recorded;
mod rows_of_csv;

use std::path::Path;

use isochrone_engine::Pattern;
use isochrone_scope::{
    Capture, Extremes, Head, ObservedTask, Rows, Shot, Track, TrackSignal, Trigger, Window,
};

use self::readable::{Around, Contents, Enough, Readable};
use super::captured::Captured;
use super::chosen::{check_count, edge};
use super::level;
use crate::failure::Failure;
use crate::suggestion;

/// A look at a file.
pub(super) struct Look<'a> {
    pub(super) path: &'a Path,
    /// Names and globs; all signals without any.
    pub(super) names: &'a [String],
    pub(super) window: Window,
    /// Without a trigger: so much from the first instant on, in ns. `None`: all of it.
    pub(super) length_ns: Option<u64>,
}

/// Which values of a track are wanted, by their places.
type Places = Vec<Vec<usize>>;

/// Values of a file that are shown at once: half a gigabyte.
const MOST_VALUES: usize = 1 << 26;

impl Look<'_> {
    /// Reads what is wanted: all of it, or what lies around the first instant at which a trigger fires. It may have
    /// a failure for when that was shown: the file is damaged, or ends within the shot.
    pub(super) fn capture(
        &self,
        trigger: Option<&Trigger>,
    ) -> Result<(Captured, Result<(), Failure>), Failure> {
        self.check_kind()?;
        let is_csv = self.path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
        let file: Box<dyn Readable> = if is_csv {
            Box::new(rows_of_csv::read(self.path)?)
        } else {
            Box::new(recorded::read(self.path)?)
        };
        let contents = file.contents();
        let places = self.chosen(contents)?;
        let shot = match trigger {
            Some(trigger) => self.around(trigger, &*file, contents, &places)?,
            None => self.whole(&*file, contents, &places)?,
        };
        let judged = file.judge().and_then(|()| match trigger {
            Some(_) if shot.ends_early() => {
                Err(Failure::found(format!("{} ends within the shot", self.path.display())))
            }
            _ => Ok(()),
        });
        Ok((Captured { shot, clock: contents.clock }, judged))
    }

    /// Refuses what cannot be read from its beginning again, or could be waited for without end.
    fn check_kind(&self) -> Result<(), Failure> {
        let path = self.path.display();
        let is_svg = self.path.extension().is_some_and(|it| it.eq_ignore_ascii_case("svg"));
        match self.path.metadata() {
            Ok(about) if about.is_dir() => {
                Err(Failure::usage(format!("{path} is a folder; name an .mcap or a .csv in it")))
            }
            Ok(about) if !about.is_file() => Err(Failure::usage(format!(
                "{path} is no regular file, and scope reads from the beginning more than once: write what comes \
                 from there to a file first"
            ))),
            _ if is_svg => Err(Failure::usage(format!(
                "{path} is a picture, which has no values any more; scope shows .mcap and .csv"
            ))),
            // Opening it later reports why that fails.
            _ => Ok(()),
        }
    }

    /// The places of the signals that are wanted, in the order in which they are named.
    fn chosen(&self, contents: &Contents) -> Result<Places, Failure> {
        let mut places = vec![Vec::new(); contents.tracks.len()];
        let every = ["*".to_owned()];
        let is_every = self.names.is_empty();
        let names = if is_every { &every } else { self.names };
        for name in names {
            let pattern = Pattern::new(name);
            let mut found = false;
            for (track, places) in contents.tracks.iter().zip(&mut places) {
                for (place, signal) in track.signals.iter().enumerate() {
                    let is_it = is_every || signal.name == *name || pattern.matches(&signal.name);
                    found |= is_it;
                    // Several outputs may carry a signal.
                    let is_new = |known: &usize| {
                        track.signals.get(*known).is_none_or(|known| known.name != signal.name)
                    };
                    if is_it && places.iter().all(is_new) {
                        places.push(place);
                    }
                }
            }
            if !found {
                return Err(self.unknown(name, contents));
            }
        }
        check_count(places.iter().map(Vec::len).sum())?;
        Ok(places)
    }

    fn unknown(&self, name: &str, contents: &Contents) -> Failure {
        let known = contents.tracks.iter().flat_map(|track| &track.signals);
        let question = suggestion::question(name, known.map(|signal| signal.name.as_str()));
        Failure::usage(format!("{} has no signal \"{name}\"{question}", self.path.display()))
    }

    /// All rows, or the first of them.
    fn whole(
        &self,
        file: &dyn Readable,
        contents: &Contents,
        places: &Places,
    ) -> Result<Shot, Failure> {
        let mut tracks: Vec<Track> = observed(contents, places)
            .into_iter()
            .map(|of| {
                let around = contents.around.get(&of.task).copied().unwrap_or_default();
                let Around { has_history, next } = around;
                let rows = Rows::new(of.signals.len());
                let (task, period_ns, signals) = (of.task, of.period_ns, of.signals);
                Track { task, period_ns, signals, rows, has_history, next }
            })
            .collect();
        let (mut chosen, mut values) = (Vec::new(), 0);
        let (mut begin_ns, mut end_ns) = (contents.begin_ns, contents.end_ns);
        file.rows(&mut |track, head, row| {
            let (Some(places), Some(of)) = (places.get(track), tracks.get_mut(track)) else {
                return Ok(Enough::No);
            };
            if places.is_empty() {
                return Ok(Enough::No);
            }
            let begin_ns = *begin_ns.get_or_insert(head.release_ns);
            if let Some(length_ns) = self.length_ns {
                let length_ends_ns = begin_ns.saturating_add(length_ns);
                let end_ns = *end_ns
                    .insert(contents.end_ns.map_or(length_ends_ns, |it| it.min(length_ends_ns)));
                if head.release_ns >= end_ns {
                    of.next = of.next.filter(|next| next.release_ns < end_ns).or(Some(head));
                    return Ok(Enough::No);
                }
            }
            choose(row, places, &mut chosen);
            of.rows.push(head, &chosen);
            // A row has a head as well.
            values += chosen.len() + 4;
            if values > MOST_VALUES {
                return Err(self.too_long());
            }
            Ok(Enough::No)
        })?;
        tracks.retain(|track| !track.rows.is_empty());
        for Track { rows, next, .. } in &mut tracks {
            if let (Some(last), Some(next)) = (rows.last(), next) {
                let between = next.cycle.saturating_sub(last.cycle + 1);
                next.missed = between.saturating_sub(next.lost);
            }
        }
        let begins = tracks.iter().filter_map(|track| track.rows.first());
        let begin_ns = contents.begin_ns.or(begins.map(|head| head.release_ns).min());
        let ends = tracks.iter().filter_map(|track| {
            let last = track.rows.last()?;
            Some(last.release_ns.saturating_add(track.period_ns.unwrap_or(1)))
        });
        let end_ns = end_ns.or(ends.max()).unwrap_or_default();
        if contents.begin_ns.is_none() {
            tracks.iter_mut().for_each(|track| lacks_nothing(track, end_ns));
        }
        if tracks.is_empty() {
            let path = self.path.display();
            return Err(Failure::found(format!("{path} has no rows of these signals")));
        }
        let (node, trigger) = (contents.node.clone(), contents.trigger.clone());
        Ok(Shot { node, tracks, trigger, begin_ns: begin_ns.unwrap_or_default(), end_ns })
    }

    fn too_long(&self) -> Failure {
        Failure::usage(format!(
            "{} has more cycles than can be shown at once; name fewer signals, or the instant to show with \
             --trigger",
            self.path.display()
        ))
    }

    /// The rows around the first instant at which a trigger fires.
    fn around(
        &self,
        trigger: &Trigger,
        file: &dyn Readable,
        contents: &Contents,
        places: &Places,
    ) -> Result<Shot, Failure> {
        let of_trigger = contents.tracks.iter().enumerate().find_map(|(track, of)| {
            let place = of.signals.iter().position(|signal| signal.name == trigger.signal)?;
            Some((track, place, of.signals.get(place)?))
        });
        let Some((track_of_trigger, place, signal)) = of_trigger else {
            return Err(self.unknown(&trigger.signal, contents));
        };
        let trigger = &if level::is_missing(trigger, &signal.value_type) {
            level::between(trigger, seen(file, track_of_trigger, place)?)?
        } else {
            trigger.clone()
        };
        let edge = edge(trigger, &signal.value_type, &signal.unit)?;
        let text = trigger.to_string();
        let at = (track_of_trigger, places.get(track_of_trigger).map_or(0, Vec::len));
        let tracks = observed(contents, places);
        let names = (trigger.signal.as_str(), text.as_str());
        let mut capture = Capture::armed(&contents.node, tracks, self.window, at, names, edge);
        let (mut chosen, mut shot) = (Vec::new(), None);
        file.rows(&mut |track, head, row| {
            let Some(places) = places.get(track) else { return Ok(Enough::No) };
            choose(row, places, &mut chosen);
            // Behind what is shown stands what the trigger looks at.
            chosen.extend(row.get(place).filter(|_| track == track_of_trigger));
            if capture.push(track, head, &chosen) {
                shot = capture.take();
                return Ok(Enough::Yes);
            }
            Ok(Enough::No)
        })?;
        shot.or_else(|| capture.take()).ok_or_else(|| {
            let path = self.path.display();
            let why = super::probes::not_fired(trigger, &capture);
            Failure::inconclusive(format!("{path}: the trigger did not come: {why}"))
        })
    }
}

/// The least and the greatest value of a signal.
fn seen(file: &dyn Readable, track: usize, place: usize) -> Result<Option<Extremes>, Failure> {
    let mut seen = None;
    file.rows(&mut |of, _, row| {
        let value = row.get(place).filter(|value| of == track && value.is_finite());
        seen = value.map_or(seen, |value| Some(Extremes::with(seen, *value)));
        Ok(Enough::No)
    })?;
    Ok(seen)
}

/// The tracks with the signals that are wanted.
fn observed(contents: &Contents, places: &Places) -> Vec<ObservedTask> {
    let signals = |of: &ObservedTask, places: &Vec<usize>| -> Vec<TrackSignal> {
        places.iter().filter_map(|place| of.signals.get(*place).cloned()).collect()
    };
    let each = contents.tracks.iter().zip(places);
    each.map(|(of, places)| ObservedTask { signals: signals(of, places), ..of.clone() }).collect()
}

/// In a file that is not a shot, nothing is missing from a track, wherever other tracks begin and end.
fn lacks_nothing(track: &mut Track, end_ns: u64) {
    track.has_history = true;
    if let (Some(last), None) = (track.rows.last(), track.next) {
        let (cycle, release_ns) = (last.cycle.saturating_add(1), end_ns);
        track.next = Some(Head { cycle, release_ns, ..Head::default() });
    }
}

fn choose(row: &[f64], places: &[usize], chosen: &mut Vec<f64>) {
    chosen.clear();
    chosen.extend(places.iter().map(|place| row.get(*place).copied().unwrap_or(f64::NAN)));
}

#[cfg(test)]
mod tests;

//! What a node finds of its state before it starts.

use std::fs::File;
use std::path::{Path, PathBuf};

use isochrone_engine::Plan;
use isochrone_engine::config::{OnDamaged, Retain};
use isochrone_timing::units::duration;

use super::error::{DamagedState, StateError};
use super::file::{StateFile, StoredState};
use super::node_state::NodeState;
use crate::node::alarms::Alarm;
use crate::task::clocks::unix_ns;

/// The state of a node that is to start: its file, which is the node's from now on, and what is there.
#[derive(Debug)]
pub struct Retention {
    file: StateFile,
    /// Keeps other processes from writing there.
    claim: Option<File>,
    settings: Retain,
    pub(crate) found: Option<Found>,
    /// What becomes of the files that are there, once the node is sure to start.
    aside: Option<Aside>,
    /// Warnings about what was found.
    pub(crate) alarms: Vec<Alarm>,
}

/// Files of a state that are put aside.
#[derive(Debug)]
enum Aside {
    /// The damaged newest one.
    Damaged,
    /// All of it, under this name.
    Cold(PathBuf),
}

/// A state that was found for a node.
#[derive(Debug)]
pub(crate) struct Found {
    pub(super) path: PathBuf,
    pub(crate) state: NodeState,
    /// When it was found, in ns since 1970.
    pub(super) now_unix_ns: u64,
    /// How old the state of a task may be, in ns.
    pub(super) for_ns: u64,
    /// The damage of a newer one.
    damage: Option<DamagedState>,
}

impl Found {
    /// The state of a node that was read from a file.
    ///
    /// # Errors
    /// It is of another node.
    pub(super) fn of(
        file: &StateFile,
        stored: StoredState,
        node: &str,
        settings: Retain,
    ) -> Result<Self, StateError> {
        let StoredState { state, damage } = stored;
        let path = file.path().to_owned();
        if state.node != node {
            let (node, other) = (node.to_owned(), state.node);
            return Err(StateError::OtherNode { path, node, other });
        }
        let (now_unix_ns, for_ns) = (unix_ns(), settings.for_ns);
        Ok(Self { path, state, now_unix_ns, for_ns, damage })
    }
}

impl Retention {
    /// That of a node in its [usual file](StateFile::of); `None`: its configuration does not retain its state.
    ///
    /// # Errors
    /// As [`open`](Self::open), or there is no usual file.
    pub fn of(plan: &Plan) -> Result<Option<Self>, StateError> {
        if plan.retain.is_none() {
            return Ok(None);
        }
        Self::open(plan, StateFile::of(&plan.node)?)
    }

    /// Finds the state of a node in a file, which need not exist; `None`: the configuration does not retain it.
    ///
    /// # Errors
    /// It cannot be read or written, is in use, is of another node, or is damaged and there is no whole one before it, unless
    /// the configuration says `on_damaged = "cold"`.
    pub fn open(plan: &Plan, file: StateFile) -> Result<Option<Self>, StateError> {
        let Some(settings) = plan.retain else { return Ok(None) };
        Self::claim(file, settings)?.found(plan).map(Some)
    }

    /// As [`open`](Self::open), for one of two processes of a node, of which the other may write the file when it has
    /// taken over. Only one that `holds` the node goes on from what is there.
    ///
    /// # Errors
    /// As `open`.
    pub fn open_beside_twin(
        plan: &Plan,
        file: StateFile,
        holds: bool,
    ) -> Result<Option<Self>, StateError> {
        let Some(settings) = plan.retain else { return Ok(None) };
        // A process that is stopped would hold a lock on it for as long.
        file.claim().map(drop).or_else(|error| match error {
            StateError::InUse { .. } => Ok(()),
            error => Err(error),
        })?;
        let retention = Self::new(file, None, settings);
        if holds { retention.found(plan).map(Some) } else { Ok(Some(retention)) }
    }

    /// With what is there.
    fn found(mut self, plan: &Plan) -> Result<Self, StateError> {
        let settings = self.settings;
        let path = self.file.path().display().to_string();
        self.found = match self.file.read() {
            Err(StateError::Damaged { damage, .. }) if settings.on_damaged == OnDamaged::Cold => {
                let cold = self.file.cold_path();
                let reason = format!(
                    "the state {path} is damaged ({damage}), and there is no intact one before it; everything starts \
                     cold, and it is kept as {}",
                    cold.display()
                );
                self.aside = Some(Aside::Cold(cold));
                self.alarms.push(Alarm::ColdStart { reason });
                None
            }
            stored => {
                let of = |stored| Found::of(&self.file, stored, &plan.node, settings);
                stored?.map(of).transpose()?
            }
        };
        if let Some(damage) = self.found.as_ref().and_then(|found| found.damage.clone()) {
            self.aside = Some(Aside::Damaged);
            let reason = format!(
                "the state {path} is damaged ({damage}) and kept as {path}.damaged; the one before it is restored"
            );
            self.alarms.push(Alarm::DamagedState { reason });
        }
        Ok(self)
    }

    /// Puts the state in a file aside, as `FILE.cold`, once the node is sure to start, which it does without; `None`: the
    /// configuration does not retain it.
    ///
    /// # Errors
    /// It cannot be written, or is in use.
    pub fn cold(plan: &Plan, file: StateFile) -> Result<Option<Self>, StateError> {
        let Some(settings) = plan.retain else { return Ok(None) };
        let retention = Self::claim(file, settings)?;
        let aside = retention.file.path().exists().then(|| retention.file.cold_path());
        Ok(Some(Self { aside: aside.map(Aside::Cold), ..retention }))
    }

    /// Where the state goes that is not restored; `None`: it is restored, or there is none.
    pub fn put_aside(&self) -> Option<&Path> {
        match &self.aside {
            Some(Aside::Cold(path)) => Some(path),
            Some(Aside::Damaged) | None => None,
        }
    }

    /// Puts aside what is not to be restored. Returns the file, what keeps others from writing it, and how it is
    /// written.
    pub(super) fn settle(self) -> Result<(StateFile, Option<File>, Retain), StateError> {
        let Self { file, claim, settings, aside, .. } = self;
        match aside {
            Some(Aside::Damaged) => file.put_aside_damaged()?,
            Some(Aside::Cold(path)) => file.put_aside(&path)?,
            None => {}
        }
        Ok((file, claim, settings))
    }

    fn claim(file: StateFile, settings: Retain) -> Result<Self, StateError> {
        let claim = file.claim()?;
        Ok(Self::new(file, Some(claim), settings))
    }

    /// With nothing that was found.
    fn new(file: StateFile, claim: Option<File>, settings: Retain) -> Self {
        Self { file, claim, settings, found: None, aside: None, alarms: Vec::new() }
    }
}

/// How far in the future a state may be: clocks are set back by so much at times.
const CLOCK_TOLERANCE_NS: u64 = 5_000_000_000;

impl Found {
    /// How old something in it is, in ns; `None`: it is of the future, so nobody knows.
    pub(super) fn age_ns(&self, unix_ns: u64) -> Option<u64> {
        let is_known = unix_ns <= self.now_unix_ns.saturating_add(CLOCK_TOLERANCE_NS);
        is_known.then(|| self.now_unix_ns.saturating_sub(unix_ns))
    }

    /// Checks that the state that a task had at a time is not too old to be taken.
    ///
    /// # Errors
    /// It is, or nobody knows; the reason.
    pub(super) fn check_age(&self, unix_ns: u64) -> Result<(), String> {
        match self.age_ns(unix_ns) {
            None => Err("its time is in the future, so its age is not known".to_owned()),
            Some(age_ns) if age_ns > self.for_ns => Err(format!(
                "it is {} old, and retain_for is {}",
                duration(age_ns as f64),
                duration(self.for_ns as f64)
            )),
            Some(_) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_is_taken_up_to_its_age_and_never_with_an_unknown_one() {
        let now_unix_ns = 1_700_000_000_000_000_000;
        let state = NodeState::default();
        let found = Found { path: PathBuf::new(), state, now_unix_ns, for_ns: 10, damage: None };
        for (unix_ns, is_taken) in [
            (now_unix_ns, true),
            (now_unix_ns - 10, true),
            (now_unix_ns - 11, false),
            (now_unix_ns + CLOCK_TOLERANCE_NS, true),
            (now_unix_ns + CLOCK_TOLERANCE_NS + 1, false),
        ] {
            assert_eq!(found.check_age(unix_ns).is_ok(), is_taken, "{unix_ns}");
        }
    }
}

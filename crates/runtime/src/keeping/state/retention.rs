//! What a node finds of its state before it starts.

use std::fs::File;
use std::path::PathBuf;

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
    pub(super) file: StateFile,
    pub(super) claim: File,
    pub(super) settings: Retain,
    pub(crate) found: Option<Found>,
    /// Warnings about what was found.
    pub(crate) alarms: Vec<Alarm>,
}

/// A state that was found for a node.
#[derive(Debug)]
pub(crate) struct Found {
    pub(super) path: PathBuf,
    pub(super) state: NodeState,
    /// How old it is, in ns; `None`: it is of the future, so nobody knows.
    pub(super) age_ns: Option<u64>,
    /// Why blocks and inputs begin anew.
    pub(super) cold: Option<String>,
    /// The damage of a newer one.
    damage: Option<DamagedState>,
}

impl Found {
    /// Looks for the state of a node in a file; `None`: there is none.
    ///
    /// # Errors
    /// It cannot be read, is of another node, or is damaged and there is no whole one before it.
    pub(super) fn look(
        file: &StateFile,
        node: &str,
        settings: Retain,
    ) -> Result<Option<Self>, StateError> {
        let Some(StoredState { state, damage }) = file.read()? else { return Ok(None) };
        let path = file.path().to_owned();
        if state.node != node {
            let (node, other) = (node.to_owned(), state.node);
            return Err(StateError::OtherNode { path, node, other });
        }
        let age_ns = unix_ns().checked_sub(state.unix_ns);
        let cold = too_old(age_ns, settings);
        Ok(Some(Self { path, state, age_ns, cold, damage }))
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
        let mut retention = Self::claim(file, settings)?;
        let path = retention.file.path().display().to_string();
        retention.found = match Found::look(&retention.file, &plan.node, settings) {
            Err(StateError::Damaged { damage, .. }) if settings.on_damaged == OnDamaged::Cold => {
                retention.file.put_aside()?;
                let reason = format!(
                    "the state {path} is damaged ({damage}), and there is no whole one before it; everything begins \
                     anew, and it is kept as {path}.cold"
                );
                retention.alarms.push(Alarm::ColdStart { reason });
                None
            }
            found => found?,
        };
        if let Some(damage) = retention.found.as_ref().and_then(|found| found.damage.clone()) {
            retention.file.put_aside_damaged()?;
            let reason = format!(
                "the state {path} is damaged ({damage}) and kept as {path}.damaged; the one before it is restored"
            );
            retention.alarms.push(Alarm::DamagedState { reason });
        }
        Ok(Some(retention))
    }

    /// Puts the state in a file aside, as `FILE.cold`, so that the node starts without; `None`: the configuration does
    /// not retain it.
    ///
    /// # Errors
    /// It cannot be written, or is in use.
    pub fn cold(plan: &Plan, file: StateFile) -> Result<Option<Self>, StateError> {
        let Some(settings) = plan.retain else { return Ok(None) };
        let retention = Self::claim(file, settings)?;
        retention.file.put_aside()?;
        Ok(Some(retention))
    }

    fn claim(file: StateFile, settings: Retain) -> Result<Self, StateError> {
        let claim = file.claim()?;
        Ok(Self { file, claim, settings, found: None, alarms: Vec::new() })
    }
}

/// Why the state of blocks and inputs is not taken, if so.
fn too_old(age_ns: Option<u64>, settings: Retain) -> Option<String> {
    match age_ns {
        None => Some("its time is in the future, so its age is not known".to_owned()),
        Some(age_ns) if age_ns > settings.for_ns => Some(format!(
            "it is {} old, and retain_for is {}",
            duration(age_ns as f64),
            duration(settings.for_ns as f64)
        )),
        Some(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_is_taken_up_to_its_age_and_never_with_an_unknown_one() {
        let settings = Retain { for_ns: 10, ..Retain::default() };
        for (age_ns, is_taken) in
            [(Some(0), true), (Some(10), true), (Some(11), false), (None, false)]
        {
            assert_eq!(too_old(age_ns, settings).is_none(), is_taken, "{age_ns:?}");
        }
    }
}

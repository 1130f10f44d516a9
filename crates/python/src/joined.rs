//! This process in a domain.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use isochrone::ipc::{Domain, Participant};
use pyo3::prelude::*;

use crate::Ports;
use crate::errors::failed;
use crate::interruption::opened;

/// What a process is in a domain.
#[derive(Clone, FromPyObject)]
pub(crate) struct Member {
    /// Its name, as `isochrone list` shows it.
    name: String,
    /// The configuration file of the domain; `None`: as `ICEORYX2_CONFIG` says.
    domain: Option<PathBuf>,
    /// Whether it takes services over from writers that are not of isochrone.
    take_over: bool,
}

/// A participant as long as a port has it. All ports of a process with one name share it: each would need descriptors
/// and a place in each service.
struct Known {
    process: u32,
    name: String,
    domain: String,
    participant: Weak<Participant<Ports>>,
}

static KNOWN: Mutex<Vec<Known>> = Mutex::new(Vec::new());

impl Member {
    /// Joins the domain, and opens a port in it; without Python's lock, which must not be needed for that.
    pub(crate) fn open<R: Send>(
        &self,
        py: Python<'_>,
        open: impl FnOnce(Arc<Participant<Ports>>) -> PyResult<R> + Send,
    ) -> PyResult<R> {
        opened(py, || open(self.join()?))
    }

    fn join(&self) -> PyResult<Arc<Participant<Ports>>> {
        let found = self.domain.as_deref().map_or_else(Domain::find, Domain::from_file);
        let domain = found.map_err(failed)?;
        let join = || Participant::join_variant(&self.name, &domain).map_err(failed);
        if self.take_over {
            return Ok(Arc::new(join()?.taking_over(true)));
        }
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let (process, place) = (std::process::id(), domain.to_string());
        known.retain(|one| one.process != process || one.participant.strong_count() > 0);
        let is_it =
            |one: &&Known| one.process == process && one.name == self.name && one.domain == place;
        if let Some(participant) = known.iter().find(is_it).and_then(|it| it.participant.upgrade())
        {
            return Ok(participant);
        }
        let participant = Arc::new(join()?);
        let (name, weak) = (self.name.clone(), Arc::downgrade(&participant));
        known.push(Known { process, name, domain: place, participant: weak });
        Ok(participant)
    }
}

//! Handing ports over to a real-time thread.

use std::ops::{Deref, DerefMut};

use crate::file_override::{FileOverrideGivenUp, give_up_file_override};

/// Ports of a [`RealTime`](crate::RealTime) participant, or what was built from them, on their way to their thread.
///
/// They cannot be used before the thread [enters](Self::enter), which in a node `RealTimeThread::prepare` does.
/// Combine several with [`and`](Self::and) or `collect`:
///
/// ```
/// use isochrone_ipc::{Depth, ForRealTime, FrameSubscriber, IsolatedDomain, Participant, ipc};
///
/// struct Inputs(Vec<FrameSubscriber<ipc::Service>>);
///
/// let domain = IsolatedDomain::new("forrt")?;
/// let participant = Participant::join("level", &domain)?.for_real_time()?;
/// let open = |service| participant.subscriber(service, 1, Depth::Newest);
/// let inputs: ForRealTime<Vec<_>> = ["plant/a", "plant/b"].map(open).into_iter().collect::<Result<_, _>>()?;
/// let mut inputs = inputs.map(Inputs).enter();
/// assert!(inputs.0.iter_mut().all(|input| input.newest(0).is_none()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// A port that no thread has entered with cannot be used:
///
/// ```compile_fail,E0599
/// # use isochrone_ipc::{Depth, IsolatedDomain, Participant};
/// # let domain = IsolatedDomain::new("forrt").unwrap();
/// # let participant = Participant::join("level", &domain).unwrap().for_real_time().unwrap();
/// let mut input = participant.subscriber("plant/a", 1, Depth::Newest).unwrap();
/// input.newest(0);
/// ```
#[must_use = "ports are used by a thread that enters with them"]
#[derive(Debug)]
pub struct ForRealTime<P>(P);

impl ForRealTime<()> {
    /// No ports: for a thread that has none, or to combine with others.
    pub fn nothing() -> Self {
        Self(())
    }
}

impl<P> ForRealTime<P> {
    pub(crate) fn new(port: P) -> Self {
        Self(port)
    }

    /// Builds what the thread will own from its ports.
    pub fn map<Q>(self, build: impl FnOnce(P) -> Q) -> ForRealTime<Q> {
        ForRealTime(build(self.0))
    }

    /// As [`map`](Self::map), if building can fail.
    ///
    /// # Errors
    /// Those of `build`.
    pub fn try_map<Q, E>(self, build: impl FnOnce(P) -> Result<Q, E>) -> Result<ForRealTime<Q>, E> {
        build(self.0).map(ForRealTime)
    }

    /// These ports and others, for one thread.
    pub fn and<Q>(self, other: ForRealTime<Q>) -> ForRealTime<(P, Q)> {
        ForRealTime((self.0, other.0))
    }

    /// Makes the ports usable in the calling thread.
    ///
    /// Until they end, the thread lacks root's right to open files regardless of their permissions: with it, a peer
    /// that was killed during its start would hold up the thread for ever.
    pub fn enter(self) -> InRealTime<P> {
        InRealTime { _given_up: give_up_file_override(), ports: self.0 }
    }
}

impl<P, C: FromIterator<P>> FromIterator<ForRealTime<P>> for ForRealTime<C> {
    fn from_iter<I: IntoIterator<Item = ForRealTime<P>>>(ports: I) -> Self {
        Self(ports.into_iter().map(|port| port.0).collect())
    }
}

/// Ports in the thread that uses them; it stays in its thread.
///
/// ```compile_fail,E0277
/// # use isochrone_ipc::ForRealTime;
/// let ports = ForRealTime::nothing().enter();
/// std::thread::spawn(move || drop(ports));
/// ```
#[must_use = "dropping it ends the ports"]
#[derive(Debug)]
pub struct InRealTime<P> {
    // Restored before the ports end, as they remove files in directories that another user may have created.
    _given_up: FileOverrideGivenUp,
    ports: P,
}

impl<P> Deref for InRealTime<P> {
    type Target = P;

    fn deref(&self) -> &P {
        &self.ports
    }
}

impl<P> DerefMut for InRealTime<P> {
    fn deref_mut(&mut self) -> &mut P {
        &mut self.ports
    }
}

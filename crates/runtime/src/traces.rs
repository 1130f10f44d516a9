//! Traces: selected signals of every cycle, copied in the slack for a client.

use isochrone_control::desk::Signals;
use isochrone_ipc::SignalSpec;

use crate::records::Cycle;
use crate::rows::RowSender;

/// The most traces of a task at a time.
pub(crate) const MAX_TRACES: usize = 4;
/// The most signals of a trace.
pub(crate) const MAX_TRACED: usize = 64;

/// A trace, the cycle's end.
pub(crate) struct Tracer {
    pub(crate) number: u64,
    slots: Box<[usize]>,
    rows: RowSender,
}

impl Tracer {
    pub(crate) fn new(number: u64, slots: Box<[usize]>, rows: RowSender) -> Self {
        Self { number, slots, rows }
    }
}

/// The traces of a task, in the cycle. Nothing here allocates or frees.
#[derive(Default)]
pub(crate) struct Traces {
    armed: [Option<Box<Tracer>>; MAX_TRACES],
    count: usize,
}

impl Traces {
    /// Begins a trace; gives it back if there is no room.
    pub(crate) fn arm(&mut self, tracer: Box<Tracer>) -> Option<Box<Tracer>> {
        let Some(free) = self.armed.iter_mut().find(|place| place.is_none()) else {
            return Some(tracer);
        };
        *free = Some(tracer);
        self.count += 1;
        None
    }

    /// Ends a trace.
    pub(crate) fn disarm(&mut self, number: u64) -> Option<Box<Tracer>> {
        let is_its = |tracer: &mut Box<Tracer>| tracer.number == number;
        let found = self.armed.iter_mut().find_map(|place| place.take_if(is_its))?;
        self.count -= 1;
        Some(found)
    }

    /// Copies the signals of every trace; costs one look if there is none. For the slack.
    #[inline]
    pub(crate) fn take(&mut self, image: &[f64], cycle: &Cycle) {
        if self.count == 0 {
            return;
        }
        for Tracer { slots, rows, .. } in
            self.armed.iter_mut().flatten().map(|tracer| &mut **tracer)
        {
            rows.push(
                cycle,
                slots.iter().map(|slot| image.get(*slot).copied().unwrap_or_default()),
            );
        }
    }

    /// Changes to another configuration, in which traces may have other slots; `ended` receives those that cannot go
    /// on.
    pub(crate) fn change(&mut self, new: &mut NewSlots, mut ended: impl FnMut(Box<Tracer>)) {
        for place in &mut self.armed {
            let Some(tracer) = place else { continue };
            let slots = new.0.iter_mut().find(|(number, _)| *number == tracer.number);
            match slots.and_then(|(_, slots)| slots.as_mut()) {
                Some(slots) => std::mem::swap(&mut tracer.slots, slots),
                None => {
                    self.count -= 1;
                    place.take().into_iter().for_each(&mut ended);
                }
            }
        }
    }
}

/// For each trace of a task, by its number, its slots in another configuration, or its end.
#[derive(Default)]
pub(crate) struct NewSlots(Vec<(u64, Option<Box<[usize]>>)>);

impl NewSlots {
    /// For another configuration: traces go on if it has all of their signals.
    pub(crate) fn of(traces: &[Traced], task: usize, signals: &Signals) -> Self {
        let slot = |spec: &SignalSpec| {
            let found = signals.find(&spec.name).ok()?;
            let is_same = found.task == task && found.value_type.as_str() == spec.value_type;
            is_same.then_some(found.slot)
        };
        let slots = |traced: &Traced| {
            (traced.number, traced.signals.iter().map(slot).collect::<Option<_>>())
        };
        Self(traces.iter().map(slots).collect())
    }
}

/// A trace, the ordinary threads' end: from before it is sent to its task until it has come back.
pub(crate) struct Traced {
    pub(crate) number: u64,
    pub(crate) signals: Vec<SignalSpec>,
    /// The client, if iceoryx2 says which it is.
    pub(crate) process: Option<u32>,
}

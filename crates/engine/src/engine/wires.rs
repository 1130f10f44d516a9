//! Wires between tasks that are moved by a third party: a replay passes each value on when the run did.

use triple_buffer::{Input as Sender, Output as Receiver, TripleBuffer};

use super::TaskEngine;
use super::parcel::Parcel;

/// The ends of a task's wires from and to other tasks, once they are [loose](TaskEngine::loosen).
pub struct Wires {
    taken: Vec<(usize, Sender<Parcel>)>,
    given: Vec<(usize, Receiver<Parcel>)>,
}

impl TaskEngine {
    /// Cuts the wires between this task and others, and returns the ends: the task reads values that are
    /// [handed](Wires::hand) to it, and its own values can be [taken](Wires::given), at first those of its last
    /// cycle. Allocates; not for the real-time path.
    pub fn loosen(&mut self) -> Wires {
        let join = |parcel: &Parcel| TripleBuffer::new(parcel).split();
        let mut wires = Wires { taken: Vec::new(), given: Vec::new() };
        for import in &mut self.imports {
            let (sender, receiver) = join(import.receiver.output_buffer());
            import.receiver = receiver;
            wires.taken.push((import.from, sender));
        }
        for export in &mut self.exports {
            let (sender, receiver) = join(export.sender.input_buffer());
            export.sender = sender;
            wires.given.push((export.to, receiver));
        }
        self.publish();
        wires
    }
}

impl Wires {
    /// The tasks whose values it reads, by their index in the plan.
    pub fn sources(&self) -> impl Iterator<Item = usize> {
        self.taken.iter().map(|(from, _)| *from)
    }

    /// Hands it values of a task, which its next cycle reads. They must be of its own configuration, as values have
    /// only their positions.
    pub fn hand(&mut self, from: usize, parcel: &Parcel) {
        let found = self.taken.iter_mut().find(|(task, _)| *task == from);
        let Some((_, sender)) = found else { return };
        let to = sender.input_buffer_mut();
        to.stamp = parcel.stamp;
        to.values.iter_mut().zip(&parcel.values).for_each(|(to, from)| *to = *from);
        to.sources.iter_mut().zip(&parcel.sources).for_each(|(to, from)| *to = *from);
        sender.publish();
    }

    /// The values of the last cycle for other tasks, by their index in the plan.
    pub fn given(&mut self) -> impl Iterator<Item = (usize, &Parcel)> {
        self.given.iter_mut().map(|(to, receiver)| (*to, receiver.read()))
    }
}

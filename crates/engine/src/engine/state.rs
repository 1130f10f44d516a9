//! A task's state: everything that its next cycle depends on, as it is retained over a restart.

use super::TaskEngine;
use super::parcel::NO_CYCLE;

/// A copy of a task's image and of its blocks' private state, after a cycle.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TaskState {
    /// The cycle that was stepped last; `None`: none was.
    pub cycle: Option<u64>,
    /// The process image. A forced slot holds the value that was written beneath the force.
    pub image: Box<[f64]>,
    /// The blocks' private state.
    pub state: Box<[u64]>,
}

impl TaskState {
    /// The state of a task with these parts.
    pub fn new(cycle: Option<u64>, image: Box<[f64]>, state: Box<[u64]>) -> Self {
        Self { cycle, image, state }
    }
}

impl TaskEngine {
    /// The state of the task as it is, in memory of its own. Allocates.
    pub fn state_now(&self) -> TaskState {
        let mut state = TaskState {
            cycle: None,
            image: vec![0.0; self.image.len()].into(),
            state: vec![0; self.state.len()].into(),
        };
        self.copy_state(&mut state);
        state
    }

    /// Copies the state into memory that [`state_now`](Self::state_now) of the same engine has made. For the slack:
    /// no allocation.
    pub fn copy_state(&self, to: &mut TaskState) {
        to.cycle = (self.cycle != NO_CYCLE).then_some(self.cycle);
        let TaskState { image, state, .. } = to;
        image.iter_mut().zip(&self.image).for_each(|(to, from)| *to = *from);
        state.iter_mut().zip(&self.state).for_each(|(to, from)| *to = *from);
        self.forces.uncover(image);
    }

    /// How many engines the task had before this one.
    pub fn changes(&self) -> u64 {
        self.changes
    }
}

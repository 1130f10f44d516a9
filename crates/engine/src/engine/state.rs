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
        to.cycle = self.last_cycle();
        self.copy_image(&mut to.image);
        to.state.iter_mut().zip(&self.state).for_each(|(to, from)| *to = *from);
    }

    /// Copies the state as words of 64 bits, the image before the private state, into room for
    /// [so many](Self::state_words), as frames carry it. For the slack.
    pub fn copy_words(&self, to: &mut [f64]) {
        let (image, state) = to.split_at_mut_checked(self.image.len()).unwrap_or_default();
        self.copy_image(image);
        state.iter_mut().zip(&self.state).for_each(|(to, from)| *to = f64::from_bits(*from));
    }

    /// Goes on from the words of an engine of the same configuration after this cycle; forces hold on. For the real-time
    /// path, between two steps. Banks step instance by instance until [`check_sharing`](Self::check_sharing), or
    /// [`maintain`](Self::maintain) has come to them.
    pub fn load_words(&mut self, cycle: u64, from: &[f64]) {
        let (image, state) = from.split_at_checked(self.image.len()).unwrap_or_default();
        self.image.iter_mut().zip(image).for_each(|(to, from)| *to = *from);
        self.state.iter_mut().zip(state).for_each(|(to, from)| *to = from.to_bits());
        self.forces.cover(&mut self.image);
        self.forget_sharing();
        self.cycle = cycle;
        // Tasks that read this one find these values with their next cycle.
        self.publish();
    }

    /// How many words its state has.
    pub fn state_words(&self) -> usize {
        self.image.len() + self.state.len()
    }

    /// The cycle that was stepped last; `None`: none was.
    pub fn last_cycle(&self) -> Option<u64> {
        (self.cycle != NO_CYCLE).then_some(self.cycle)
    }

    fn copy_image(&self, to: &mut [f64]) {
        to.iter_mut().zip(&self.image).for_each(|(to, from)| *to = *from);
        self.forces.uncover(to);
    }

    /// How many engines the task had before this one.
    pub fn changes(&self) -> u64 {
        self.changes
    }
}

//! Orders that came to a cycle and are not due yet.

use super::order::{Order, OrderState, Work};
use crate::TaskEngine;

/// Orders in the cycle of a task, in the order in which they came. Nothing here allocates but
/// [`new`](Self::new), and nothing frees.
#[derive(Debug)]
#[expect(
    clippy::vec_box,
    reason = "orders come and go as boxes, so that the cycle moves a pointer"
)]
pub struct Inbox {
    waiting: Vec<Box<Order>>,
    readings: Vec<Box<Order>>,
    /// The cycle that has begun last.
    begun: Option<u64>,
}

impl Inbox {
    /// Room for so many orders.
    pub fn new(room: usize) -> Self {
        let (waiting, readings) = (Vec::with_capacity(room), Vec::with_capacity(room));
        Self { waiting, readings, begun: None }
    }

    /// Takes an order, for the cycle that it names or the next. It comes back if there is no room.
    ///
    /// # Errors
    /// There is no room.
    pub fn take(&mut self, order: Box<Order>) -> Result<(), Box<Order>> {
        let list = if order.is_reading() { &mut self.readings } else { &mut self.waiting };
        if list.len() == list.capacity() {
            return Err(order);
        }
        list.push(order);
        Ok(())
    }

    /// Whether an order that is due in `cycle` gives one of these inputs a value.
    pub fn gives(&self, cycle: u64, inputs: &[usize]) -> bool {
        let is_due = |order: &Order| {
            order.at.is_none_or(|at| at <= cycle && self.begun.is_none_or(|begun| begun < at))
        };
        let mut due = self.waiting.iter().filter(|order| is_due(order));
        due.any(|order| match &order.work {
            Work::Set { feeds, .. } => {
                feeds.iter().any(|(input, _)| inputs.contains(&(*input as usize)))
            }
            Work::Force { .. } | Work::Release { .. } | Work::Read { .. } => false,
        })
    }

    /// Applies what is due, before a cycle reads its inputs at `now_ns`. `done` gets the orders back.
    #[inline]
    pub fn apply(
        &mut self,
        engine: &mut TaskEngine,
        cycle: u64,
        now_ns: u64,
        mut done: impl FnMut(Box<Order>),
    ) {
        let begun = self.begun.replace(cycle);
        let mut next = 0;
        while let Some(order) = self.waiting.get_mut(next) {
            match order.at {
                Some(at) if at > cycle => {
                    next += 1;
                    continue;
                }
                Some(at) if begun.is_some_and(|begun| at <= begun) => {
                    order.state = OrderState::TooLate;
                }
                _ => engine.apply(order, cycle, now_ns),
            }
            let mut order = self.waiting.remove(next);
            if !matches!(order.work, Work::Release { .. }) {
                done(order);
                continue;
            }
            // What waits before it was asked for before it.
            let earlier = self.waiting.get_mut(..next).unwrap_or_default();
            earlier.iter_mut().for_each(|earlier| engine.cancel(earlier, &mut order));
            done(order);
            let waiting = self.waiting.len();
            let is_released = |order: &mut Box<Order>| order.state == OrderState::Released;
            self.waiting.extract_if(..next, is_released).for_each(&mut done);
            next -= waiting - self.waiting.len();
        }
    }

    /// Takes the readings, after a cycle's blocks have stepped. `done` gets the orders back.
    #[inline]
    pub fn read(&mut self, engine: &TaskEngine, cycle: u64, mut done: impl FnMut(Box<Order>)) {
        for mut order in self.readings.drain(..) {
            engine.read(&mut order, cycle);
            done(order);
        }
    }
}

//! Operating a running node: its names, and what may be done to its values.
//!
//! [`Operator`] belongs to an ordinary thread. It checks each request whole and makes one [`Order`] for
//! each task of it. An order goes to the task's cycle, whose [`Inbox`] has the
//! [`TaskEngine`](crate::TaskEngine) apply it before the cycle that it names, without allocating or
//! freeing; then it goes back, and [`Operator::done`] says in which cycle what was changed.
//!
//! ```
//! use isochrone_engine::{Plan, Rules, Source, TaskEngine, operate::*};
//!
//! let text = r#"
//!     [node]
//!     name = "level"
//!     [[task]]
//!     name = "fast"
//!     period = "100ms"
//!     [[block]]
//!     name = "ramp"
//!     type = "LimRateOfChangeCI"
//!     in = { value = 25.0, setChangeRate = 10.0 }
//! "#;
//! let plan = Plan::new(Source::new("level.toml", text), &Rules::default())?;
//! let mut engine = TaskEngine::build(&plan)?.remove(0);
//! let mut operator = Operator::new(&plan, Feeds::Services);
//!
//! let prepared = operator.set([("ramp.setChangeRate", 5.0)], Request::default(), &[0])?;
//! let (_, orders) = operator.send(prepared);
//! let mut inbox = Inbox::new(8);
//! for (_task, order) in orders {
//!     inbox.take(order).expect("there is room");
//! }
//! let mut back = Vec::new();
//! inbox.apply(&mut engine, 7, 0, |order| back.push(order));
//! engine.step(7);
//!
//! let Done::Applied(entry) = operator.done(0, back.remove(0), 0) else { unreachable!() };
//! assert_eq!((entry.cycle, entry.changes[0].before), (7, 10.0.into()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod fixed;
mod forces;
mod inbox;
mod journal;
mod operator;
mod order;
mod pattern;
mod permissions;
mod quality;
mod refusal;
mod replay;
mod save;
mod signals;
mod store;
mod taint;
mod warnings;

pub use crate::engine::Replacement;
pub use forces::{Ended, MAX_FORCES};
pub(crate) use forces::{Force, Forces};
pub use inbox::Inbox;
pub use operator::{
    Basis, Done, Draft, Feeds, Operator, Prepared, PreparedChange, Reading, Request, Selection,
};
pub(crate) use order::{Look, Work};
pub use order::{Order, OrderState};
pub use pattern::Pattern;
pub(crate) use pattern::part_matches;
pub use permissions::Unwritten;
pub use replay::{Difference, Replay};
pub use save::{Changes, SaveError};
pub use signals::{Matches, Signal, Signals};
pub(crate) use store::Store;
pub use warnings::Warning;

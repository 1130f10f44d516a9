//! The rules for operating a running node: its names, the changes that are allowed, and the changes that were made.
//!
//! An [`Operator`] belongs to an ordinary thread and has no clock. It checks each request as a whole and makes one
//! [`Order`](isochrone_engine::orders::Order) for each task concerned. The task's cycle applies the order and returns
//! it, and [`Operator::done`] says what was changed in which cycle. A [`Replay`] repeats the changes that a journal
//! records.
//!
//! ```
//! use isochrone_control::desk::{Feeds, Operator, OrderOutcome, RequestTerms};
//! use isochrone_engine::{Plan, Rules, Source, TaskEngine, orders::Inbox};
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
//! let prepared = operator.set([("ramp.setChangeRate", 5.0)], RequestTerms::default(), &[0])?;
//! let (_, orders) = operator.send(prepared);
//! let mut inbox = Inbox::new(8);
//! for (_task, order) in orders {
//!     inbox.take(order).expect("there is room");
//! }
//! let mut back = Vec::new();
//! inbox.apply(&mut engine, 7, 0, |order| back.push(order));
//! engine.step(7);
//!
//! let OrderOutcome::Applied(entry) = operator.done(0, back.remove(0), 0) else { unreachable!() };
//! assert_eq!((entry.cycle, entry.changes[0].before), (7, 10.0.into()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod alarms;
mod announced;
mod fixed;
mod journal;
mod operator;
mod permissions;
mod quality;
mod refusal;
mod replay;
mod save;
mod signals;
mod taint;
mod warnings;

pub use alarms::{Acknowledgement, AlarmRecord, TaskAlarms, unknown_alarm};
pub use operator::{
    Basis, DeskCopy, Draft, Feeds, Operator, OrderOutcome, PreparedChange, PreparedRequest,
    Reading, RequestTerms, RestoredValues, RetainedValue, Selection, Unexpected,
};
pub use permissions::Unwritten;
pub use replay::{Difference, Replay};
pub use save::{Changes, SaveError};
pub use signals::{Matches, Signal, Signals};
pub use warnings::ValueWarning;

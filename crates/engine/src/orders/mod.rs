//! A task's work besides stepping its blocks: orders, forces, and another engine in its place.
//!
//! An ordinary thread makes each [`Order`] and each [`Replacement`], and frees it when it comes back. Nothing is
//! checked here: whoever makes an order knows which slots there are and what they may hold, as the desk of
//! `isochrone-control` does. The cycle's [`Inbox`] has the [`TaskEngine`](crate::TaskEngine) apply an order before
//! the cycle that it names, without allocating or freeing; what was there before is then in the order.
//!
//! ```
//! use isochrone_engine::orders::{Inbox, Order, OrderState, Store, Work};
//! use isochrone_engine::{Plan, Rules, Source, TaskEngine};
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
//!
//! // The first block's first pin, `ramp.value`, is the image's first slot.
//! let work = Work::Set { feeds: [].into(), stores: [Store::new(0, 30.0)].into() };
//! let mut inbox = Inbox::new(8);
//! inbox.take(Order::new(None, work)).expect("there is room");
//! let mut back = Vec::new();
//! inbox.apply(&mut engine, 7, 0, |order| back.push(order));
//! engine.step(7);
//!
//! assert_eq!(back[0].state(), OrderState::Applied { cycle: 7 });
//! let Work::Set { stores, .. } = &back[0].work else { unreachable!() };
//! assert_eq!((stores[0].before, engine.image()[0]), (25.0, 30.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod evidence;
mod forces;
mod inbox;
mod order;
mod store;

pub use crate::engine::{
    CarriedForce, CarriedInstance, CarriedValue, Carry, CopySpan, Replacement,
};
pub use evidence::{ErrorPin, Evidence};
pub(crate) use forces::Forces;
pub use forces::{AtEnd, EndedForce, MAX_FORCES, SlotForce};
pub use inbox::Inbox;
pub use order::{Order, OrderState, ReadSlot, Work};
pub use store::Store;

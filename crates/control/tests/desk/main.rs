//! What an operator may do to a running node, and what comes of it, without a clock.

mod alarms;
mod change;
mod force;
mod get;
mod hand;
mod journal;
mod level;
mod quality;
mod random;
mod request;
mod save;
mod set;
mod signals;
mod undo;
mod units;
mod unset;
mod variables;

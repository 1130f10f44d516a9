//! What an operator may do to a running node, and what comes of it.

mod change;
mod force;
mod get;
mod hand;
mod journal;
mod level;
mod quality;
mod request;
mod save;
mod set;
mod signals;
mod undo;
mod unset;

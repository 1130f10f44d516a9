//! Operating a running node: the verbs that ask one, a file each.

pub(crate) mod ack;
pub(crate) mod alarms;
pub(crate) mod apply;
mod assignment;
pub(crate) mod force;
pub(crate) mod forces;
pub(crate) mod get;
pub(crate) mod journal;
mod node;
mod process_alarms;
mod reading;
pub(crate) mod release;
pub(crate) mod save;
pub(crate) mod set;
pub(crate) mod show;
pub(crate) mod start;
pub(crate) mod switch;
mod transaction;
mod types;
pub(crate) mod undo;
pub(crate) mod watch;

pub(crate) use journal::{time, word};
pub(crate) use node::{Args as NodeArgs, Purpose, failure, refusal, silence};
pub(crate) use process_alarms::{moment, state};
pub(crate) use show::{age_of, limits, ok_of, role};
pub(crate) use transaction::client;

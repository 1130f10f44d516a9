//! Operating a running node: the verbs that ask one, a file each.

pub(crate) mod alarms;
pub(crate) mod apply;
mod assignment;
mod at;
pub(crate) mod force;
pub(crate) mod forces;
pub(crate) mod get;
pub(crate) mod journal;
mod known;
mod node;
mod reading;
pub(crate) mod release;
pub(crate) mod save;
pub(crate) mod set;
pub(crate) mod show;
mod transaction;
pub(crate) mod undo;
pub(crate) mod watch;

pub(crate) use assignment::Written;
pub(crate) use journal::{time, word};
pub(crate) use known::{CALLING_TASK, number, shown};
pub(crate) use node::{Args as NodeArgs, Asked, failure, refusal, silence};
pub(crate) use show::{age_of, limits, ok_of, role};
pub(crate) use transaction::client;

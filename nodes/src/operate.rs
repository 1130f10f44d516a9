//! Operating a running node: the verbs that ask one, a file each.

pub(crate) mod alarms;
pub(crate) mod apply;
mod assignment;
pub(crate) mod force;
pub(crate) mod forces;
pub(crate) mod get;
pub(crate) mod journal;
mod node;
pub(crate) mod release;
mod replacement;
pub(crate) mod save;
pub(crate) mod set;
pub(crate) mod show;
mod transaction;
pub(crate) mod undo;
pub(crate) mod watch;

pub(crate) use assignment::{parse, shown};
pub(crate) use node::{Args as NodeArgs, described, failure, refusal};
pub(crate) use show::{ok_of, role};
pub(crate) use transaction::client;

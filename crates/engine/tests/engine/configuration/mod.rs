//! Configurations with mistakes: what is wrong, where, and what would be right.

mod alarms;
mod constants;
mod expressions;
mod files;
mod inputs;
mod keys;
mod loops;
mod many;
mod names;
mod operate;
mod random;
mod timing;
mod units;
mod values;
mod variables;
mod warnings;
mod wires;

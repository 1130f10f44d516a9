//! The standard function blocks of IEC 61131-3: edges, bistables, timers and counters.

pub mod r_trig;

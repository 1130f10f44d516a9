//! The standard function blocks of IEC 61131-3: edges, bistables, timers and counters.

mod timer;

pub mod ctd;
pub mod ctu;
pub mod ctud;
pub mod f_trig;
pub mod r_trig;
pub mod rs;
pub mod sr;
pub mod tof;
pub mod ton;
pub mod tp;

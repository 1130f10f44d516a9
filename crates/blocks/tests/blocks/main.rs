//! The blocks, pin by pin, and what holds for all of them.

mod any_value;
mod arbitrary;
mod catalogue;
mod declare;
mod expr;
mod lgf;
mod lgf_pages;
mod lim_rate_of_change;
mod lim_rate_of_change_advanced;
mod lim_rate_of_change_advanced_errors;
mod limits;
mod oracles;
mod pid;
mod pid_properties;
mod plants;
mod properties;
mod references;
mod saw_tooth;
mod scale_linear;
mod step_responses;
mod testing;

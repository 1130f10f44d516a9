//! Reports as people and programs read them.

mod made_up;
mod page;
mod reference;
mod report_json;
mod report_table;
mod screens;

//! The examples do what they say, each as a user runs it.

mod configurations;
mod plain_reader;
mod programs;
mod reader;

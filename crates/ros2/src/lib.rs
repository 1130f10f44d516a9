//! `isochrone-ros2`: a bridge between isochrone control nodes and ROS 2, as a process beside the node. It speaks DDS
//! itself, so it needs no ROS installation, and nothing of it touches a cycle.
//!
//! | module | is |
//! |---|---|
//! | `args`, `config` | what is to be done, from the command line and a file |
//! | `bundled`, `mapping` | the types of messages, and what becomes of values in them |
//! | `dds` | topics of bytes, and the graph of ROS |
//! | `bridge` | frames to messages and back |
//! | `operate` | parameters and diagnostics of nodes |
#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]

mod args;
mod bridge;
mod bundled;
mod config;
mod dds;
mod failure;
mod logging;
mod mapping;
mod names;
mod operate;
mod session;
mod shown;
mod terminal;

use std::process::ExitCode;
use std::time::Duration;

use clap::{CommandFactory, Parser};
use isochrone_processes::{Stop, end_with_parent};

use crate::args::Args;
use crate::failure::Failure;

/// The command line, for everything derived from it.
pub fn command() -> clap::Command {
    Args::command()
}

/// Does what the command line says, and returns how it ended.
pub fn main() -> ExitCode {
    end_with_parent();
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.tell(),
    }
}

fn run(args: &Args) -> Result<(), Failure> {
    let mut bases = args.bases()?;
    if let Some(name) = &args.show {
        terminal::print(&match name {
            Some(name) => shown::message(&*args::message_type(&bases, name)?),
            None => shown::types(&bases.definitions),
        });
        return Ok(());
    }
    let config = args.config(&mut bases)?;
    if args.is_check() {
        terminal::print(&shown::config(&config));
        return Ok(());
    }
    logging::set_up(args.verbose);
    let stop = Stop::on_signal(|| {
        terminal::note("ended at once by another signal: readers do not learn that it stops");
    })
    .map_err(Failure::found)?;
    let stop = match args.seconds.map(Duration::try_from_secs_f64).transpose() {
        Ok(Some(seconds)) => stop.after(seconds),
        Ok(None) => stop,
        Err(cause) => return Err(Failure::usage(format!("--seconds: {cause}"))),
    };
    stop.keep_time().map_err(Failure::found)?;
    let domain = args.iceoryx2_domain()?;
    session::run(&config, &bases.definitions, &domain, args.take_over, &stop)
}

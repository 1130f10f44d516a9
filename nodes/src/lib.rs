//! The command line of `isochrone`, one file per verb: the processes of a control node, and what looks
//! after them.
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

mod base;
mod bench;
mod blocks;
mod chain;
mod check;
mod compare;
mod completions;
mod demo;
mod doctor;
mod document;
mod export;
mod link;
mod list;
mod operate;
mod program;
mod publish;
mod record;
mod reference;
mod replay;
mod run;
mod scope;
mod service;
mod simulate;
mod state;
mod subscribe;
mod top;
mod view;

use std::process::ExitCode;

pub use clap;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use isochrone_blocks::BlockType;
use isochrone_processes::{end_with_parent, outlive_file_limit, with_usual_stack};

use crate::base::failure::Failure;
pub use crate::program::Program;

/// Run function blocks at a deterministic period and exchange values through shared memory
///
/// Without a verb, runs `demo`: three processes on one machine, live values, and a summary of
/// latency and jitter at the end.
#[derive(Parser)]
#[command(name = "isochrone", version, propagate_version = true)]
#[command(after_help = "Exit status: 0 done, 1 completed and found something wrong, 2 usage or \
    configuration error, 3 no peer found, 4 too little data to judge.\n\
    SIGINT (Ctrl-C), SIGTERM and SIGHUP end a verb cleanly, with its usual exit status. A second \
    signal, at least half a second later, ends it at once with exit status 1. SIGINT and SIGHUP stay \
    ignored if they were when the program started, as under nohup. `check`, `document`, `blocks`, `compare`, `doctor` \
    and `completions` leave nothing to end in order: the first signal ends them at once.\n\
    Results go to stdout, progress, logs and errors to stderr. Errors are sentences with --json too, and \
    stdout is then empty.\n\
    Times: a number without a unit is in seconds (--seconds, --turn) or milliseconds (--period, \
    --phase); units are us, ms, s, min and h.")]
struct Cli {
    #[command(subcommand)]
    verb: Option<Verb>,
    /// Log more to stderr: -v what is set up (domain, services, and where a service differs from what
    /// was asked for), -vv also each service that is created and each peer that a port connects to, -vvv
    /// also iceoryx2's own messages; RUST_LOG takes precedence
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    verbose: u8,
}

/// Declares the verbs: a variant of `Verb` for each, and the module whose `Args` it takes and whose `run`
/// it calls, with the catalogue if it plans or shows blocks.
macro_rules! verbs {
    ($catalogue:ident; $($verb:ident: $($module:ident)::+ ($($with:ident)?),)*) => {
        #[derive(Subcommand)]
        enum Verb {
            $($verb($($module)::+::Args),)*
        }

        impl Verb {
            fn run(&self, $catalogue: &[BlockType]) -> Result<(), Failure> {
                match self {
                    $(Self::$verb(args) => $($module)::+::run(args $(, $with)?),)*
                }
            }
        }
    };
}

verbs! { catalogue;
    Demo: demo(),
    Check: check(catalogue),
    Document: document(catalogue),
    Run: run(catalogue),
    Simulate: simulate(catalogue),
    Publish: publish(),
    Subscribe: subscribe(),
    Record: record(),
    Export: export(),
    Replay: replay(catalogue),
    Scope: scope(),
    Chain: chain(),
    Link: link(),
    List: list(),
    Top: top(),
    View: view(),
    Show: operate::show(),
    Get: operate::get(),
    Watch: operate::watch(),
    Set: operate::set(),
    Undo: operate::undo(),
    Force: operate::force(),
    Release: operate::release(),
    Forces: operate::forces(),
    Ack: operate::ack(),
    Alarms: operate::alarms(),
    Journal: operate::journal(),
    Save: operate::save(catalogue),
    Apply: operate::apply(),
    State: state(catalogue),
    Start: operate::start(),
    Switch: operate::switch(),
    Blocks: blocks(catalogue),
    Bench: bench(catalogue),
    Compare: compare(),
    Doctor: doctor(),
    Completions: completions(),
    Reference: reference(),
}

/// The command line as a clap command, for everything derived from it.
pub fn command() -> clap::Command {
    Cli::command()
}

/// Parses the command line, runs its verb with `blocks` in addition to the library's, and returns
/// how it ended.
///
/// A `main` that only makes this call has every verb of `isochrone`, under the name of the program's
/// file; [`Program`] gives it a version and verbs of its own. Reports contain a cycle's
/// allocations if the program uses [`CountingAllocator`](isochrone_cyclic::CountingAllocator) as
/// its `#[global_allocator]`, and `null` otherwise.
pub fn main(blocks: &[BlockType]) -> ExitCode {
    Program::default().blocks(blocks).main()
}

impl Program {
    /// Parses the command line, runs its verb, and returns how it ended: with exit status 2, too, if two block
    /// types or two verbs have the same name. A process calls it once.
    pub fn main(self) -> ExitCode {
        let program = program::begin(self);
        end_with_parent();
        outlive_file_limit();
        let done = with_usual_stack(|| {
            base::terminal::set_up_reports();
            dispatch(program)
        });
        match done.unwrap_or_else(|cause| Err(Failure::thread(cause))) {
            Ok(()) => ExitCode::SUCCESS,
            Err(failure) => {
                base::terminal::note_failure(&failure);
                failure.status()
            }
        }
    }
}

/// Parses the command line and runs its verb.
fn dispatch(program: &Program) -> Result<(), Failure> {
    program.check_verbs(command())?;
    let matches = program.command(command()).get_matches();
    if let Some(done) = program.run_own(&matches) {
        return done;
    }
    let cli = Cli::from_arg_matches(&matches)
        .unwrap_or_else(|error| error.format(&mut program.command(command())).exit());
    base::logging::set_up(cli.verbose);
    match cli.verb {
        None => demo::run(&demo::Args::default()),
        Some(verb) => verb.run(&program.catalogue()?),
    }
}

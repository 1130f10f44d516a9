//! `scope`: an oscilloscope for the signals of a running node, or of a recording.

mod args;
mod captured;
mod chart;
mod chosen;
mod display;
mod file;
mod level;
mod live;
mod output;
mod probes;
mod text;
mod wanted;

use std::path::Path;

pub(crate) use self::args::Args;
pub(crate) use self::output::BEGIN;

use self::args::{Mode, ns};
use self::display::Display;
use self::output::Output;
use crate::configuration;
use crate::failure::Failure;
use crate::operate::NodeArgs;

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let open = || args.output.as_deref().map(|path| Output::open(path, args.repeat)).transpose();
    if is_file(&args.node) {
        let path = Path::new(&args.node);
        if let Some(output) = &args.output {
            configuration::keep(path, output)?;
        }
        if args.mode() != Mode::Single || args.timeout.is_some() {
            return Err(Failure::usage(
                "--repeat, --auto and --timeout are for a running node; of a file, the first trigger is shown",
            ));
        }
        let output = open()?;
        let (window, length_ns) = (args.window(), args.post.map(ns));
        let look = file::Look { path, names: &args.names, window, length_ns };
        let (captured, judged) = look.capture(args.trigger.as_ref())?;
        let tracks = captured.shot.tracks.iter();
        output::check_tasks(output.as_ref(), tracks.map(|track| track.task.as_str()))?;
        return Display::new(output, None).show(&captured).and(judged);
    }
    let node = NodeArgs { node: args.node.clone(), domain: args.domain.clone() };
    live::capture(args, &node, open()?)
}

/// Whether that is a file and no node.
fn is_file(name: &str) -> bool {
    let has = |ending: &str| name.len() > ending.len() && name.to_lowercase().ends_with(ending);
    [".mcap", ".csv", ".svg"].into_iter().any(has) || name.contains('/')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_and_nodes_are_told_apart_by_their_names() {
        for file in ["shot.mcap", "a/b", "SHOT.CSV", "shot.svg", "./level"] {
            assert!(is_file(file), "{file}");
        }
        for node in ["level", "mcap", ".csv", "level-2"] {
            assert!(!is_file(node), "{node}");
        }
    }
}

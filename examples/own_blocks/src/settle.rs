//! A verb of the program's own: how long the PID block takes to fill a tank, without a clock or a node.

use std::error::Error;

use isochrone::blocks::{Block, Cycle};
use isochrone_cli::clap::{Arg, ArgMatches, Command, value_parser};

use crate::pid::{Inputs, Pid, State};

const PERIOD_NS: u64 = 10_000_000;

/// What the command line takes.
pub(crate) fn command() -> Command {
    let gain = Arg::new("gain").long("gain").value_name("GAIN").help("Gain of the controller");
    Command::new("settle")
        .about("Show how long the controller takes to fill a tank")
        .arg(gain.value_parser(value_parser!(f64)).default_value("40"))
}

/// Fills a tank that loses half of what it holds in a second, to 1 m.
pub(crate) fn run(matches: &ArgMatches) -> Result<(), Box<dyn Error>> {
    let gain = matches.get_one("gain").copied().unwrap_or_default();
    let mut inputs =
        Inputs { setpoint: 1.0, gain, integral_time: 2.0, y_max: 100.0, ..Inputs::default() };
    let (mut state, mut settled) = (State::default(), None);
    for index in 0..10_000 {
        let outputs = Pid::step(&mut state, &inputs, &Cycle::new(index, PERIOD_NS, &[]));
        inputs.x += (outputs.y / 100.0 - 0.5 * inputs.x) * 0.01;
        let is_there = (inputs.x - 1.0).abs() < 0.01;
        settled = settled.filter(|_| is_there).or(is_there.then_some(index));
    }
    let cycles = settled.ok_or("the level does not come to its set-point; try another gain")?;
    println!("{:.2} s", cycles as f64 * 0.01);
    Ok(())
}

//! A block of your own, in one file and without touching a crate: a low-pass filter.
//!
//! `block!` declares the pins once. From that come the structs `Inputs`, `Outputs` and `State`, the
//! check of a configuration, and the catalogue. What remains to write is `step`.
//!
//! ```text
//! cargo run --release -p isochrone-examples --bin custom_block
//! ```
#![allow(clippy::print_stdout, reason = "showing values is what this program is for")]

use std::error::Error;

use isochrone_blocks::{BlockType, CATALOGUE};
use isochrone_engine::{Plan, Rules, Source, TaskEngine};

/// `block!` uses fixed names (`Inputs`, `Outputs`, `State`), so each block has its module.
mod low_pass {
    use isochrone_blocks::{Block, Cycle, status};

    isochrone_blocks::block! {
        /// First-order low-pass: `y` follows `x` with a time constant.
        pub(crate) LowPass {
            inputs {
                /// Signal to smooth. Without a default, so it must be connected.
                "x" => x: f64,
                /// After this time a step of `x` has come through by 63 %.
                "timeConstant" => time_constant: f64 ["s"] = 1.0,
            }
            outputs {
                /// Smoothed signal.
                "y" => y: f64,
                /// An error is reported in `status`.
                "error" => error: bool,
                /// Status word.
                "status" => status: u16,
            }
            state { y: f64 }
            status {
                status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
                status::RANGE => "ERR_TIME_CONSTANT": "timeConstant is negative or NaN; y holds",
                status::NOT_FINITE => "ERR_NOT_FINITE": "x is NaN or infinite; y holds",
            }
        }
    }

    impl Block for LowPass {
        fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
            let status = match (inputs.time_constant >= 0.0, inputs.x.is_finite()) {
                (false, _) => status::RANGE,
                (_, false) => status::NOT_FINITE,
                _ => status::OK,
            };
            if status == status::OK {
                // The configured period, never a measured one: the same inputs always give the
                // same outputs.
                let period_s = cycle.period_ns() as f64 / 1e9;
                state.y += (inputs.x - state.y) * (period_s / (period_s + inputs.time_constant));
            }
            Outputs { y: state.y, error: status::is_error(status), status }
        }
    }
}

/// The block beside one of the library: a sawtooth, smoothed.
const CONFIGURATION: &str = r#"
    [node]
    name = "smooth"
    [[task]]
    name = "slow"
    period = "100ms"
    [[block]]
    name = "saw"
    type = "SawTooth"
    in = { startValue = 100, incrementRange = 100, timeRange = 400, numberSteps = 1 }
    [[block]]
    name = "smooth"
    type = "LowPass"
    in = { x = "saw.value", timeConstant = 0.3 }
    [[output]]
    service = "plant/smooth"
    signals = ["saw.value", "smooth.y"]
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let mut catalogue = CATALOGUE.to_vec();
    catalogue.push(BlockType::of::<low_pass::LowPass>());
    let rules = Rules { catalogue: &catalogue, ..Rules::default() };
    let source = Source { name: "custom_block.rs".into(), text: CONFIGURATION.into() };
    let plan = Plan::new(source, &rules)?;
    let mut engine = TaskEngine::build(&plan)?.pop().ok_or("there is no task")?;

    println!("cycle  saw  smooth");
    for cycle in 0..6 {
        engine.step(cycle);
        let mut frame = [0.0; 2];
        engine.read_output(0, &mut frame);
        let [saw, smooth] = frame;
        println!("{cycle:<5}  {saw}  {smooth}");
    }
    println!("{} block errors", engine.block_errors());
    Ok(())
}

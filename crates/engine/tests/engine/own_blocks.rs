//! Blocks of a user's own in a configuration: known by their declaration, and not run before the node.

use std::sync::atomic::{AtomicU64, Ordering};

use isochrone_blocks::{BlockType, CATALOGUE};
use isochrone_engine::{Plan, Problem, Rules, Source, TaskEngine};

/// A block that counts its steps and cannot take every value of its pins.
mod divider {
    use super::{AtomicU64, Ordering};
    use isochrone_blocks::{Block, Cycle};

    pub(crate) static STEPS: AtomicU64 = AtomicU64::new(0);

    isochrone_blocks::block! {
        /// 1000 divided by a number.
        pub(crate) Divider {
            inputs {
                /// What to divide by.
                "n" => n: i16 = 1,
            }
            outputs {
                /// The quotient.
                "y" => y: i16,
                /// Status word.
                "status" => status: u16,
            }
            status {
                0x8200 => "ERR_NEGATIVE": "n is negative",
            }
        }
    }

    impl Block for Divider {
        fn step(_: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
            STEPS.fetch_add(1, Ordering::Relaxed);
            Outputs { y: 1000 / inputs.n, status: if inputs.n < 0 { 0x8200 } else { 0 } }
        }
    }
}

const NODE: &str = r#"
[node]
name = "n"
[[task]]
name = "t"
period = "1ms"
[[input]]
name = "i"
type = "INT"
default = 5
[[output]]
service = "o"
signals = ["i"]
[[block]]
name = "wired"
type = "Divider"
in = { n = "i" }
[[block]]
name = "negative"
type = "Divider"
in = { n = -4 }
[[block]]
name = "zero"
type = "Divider"
in = { n = 0 }
"#;

fn plan(text: &str) -> Plan {
    let catalogue = [CATALOGUE, &[BlockType::of::<divider::Divider>()]].concat();
    let rules = Rules { catalogue: &catalogue, ..Rules::default() };
    Plan::new(Source::new("own.toml", text), &rules).unwrap()
}

#[test]
fn a_plan_runs_only_blocks_of_the_library_before_the_node_does() {
    let text = format!(
        "{NODE}[[block]]\nname = \"ramp\"\ntype = \"LimRateOfChangeCI\"\nin.setChangeRate = -1.0\n"
    );
    let plan = plan(&text);
    let warnings: Vec<_> =
        plan.warnings.iter().map(|found| (found.problem, &found.message)).collect();
    let [(Problem::ConstantError, message)] = warnings[..] else { panic!("{warnings:?}") };
    assert!(message.starts_with("block \"ramp\" reports 16#8200"), "{message}");
    let engine = TaskEngine::build(&plan).unwrap();
    assert_eq!((engine.len(), divider::STEPS.load(Ordering::Relaxed)), (1, 0));
}

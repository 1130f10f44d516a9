//! Retained states: what stands in a file behind its magic, length and checksum, and how a node goes on from it.

use isochrone_control::desk::{Feeds, Operator};
use isochrone_engine::{Plan, Rules, Source, TaskEngine};
use isochrone_runtime::state::NodeState;

use crate::{Target, assert_sentence};

pub(crate) const TARGET: Target = Target { name: "states", max_bytes: 8192, max_mib: 64, read };

/// Magic and version.
const FIRST_BYTES: usize = 12;

fn read(bytes: &[u8]) {
    if let Err(damage) = NodeState::of_bytes(bytes) {
        assert_sentence(&damage.to_string());
    }
    let state = match NodeState::of_bytes(&whole(bytes)) {
        Ok(state) => state,
        Err(damage) => return assert_sentence(&damage.to_string()),
    };
    let written = state.to_bytes();
    let again = NodeState::of_bytes(&written).expect("what was written is read");
    assert_eq!(again.to_bytes(), written, "it reads back as another state");
    if state.configuration.contains("count") {
        return;
    }
    let source = Source::new("fuzz.toml", state.configuration.clone());
    match Plan::new(source, &Rules::default()) {
        Ok(plan) => go_on(&state, &plan),
        Err(refused) => assert_sentence(&refused.to_string()),
    }
}

/// A file with this behind its checksum, which nobody guesses.
fn whole(rest: &[u8]) -> Vec<u8> {
    let mut bytes = NodeState::default().to_bytes();
    bytes.truncate(FIRST_BYTES);
    bytes.extend(crc32fast::hash(rest).to_le_bytes());
    bytes.extend((rest.len() as u64).to_le_bytes());
    bytes.extend(rest);
    bytes
}

fn go_on(state: &NodeState, plan: &Plan) {
    let mut engines = TaskEngine::build(plan).expect("what is accepted can be stepped");
    let warm = state.warm_start(plan, &mut engines, |_| Ok(())).expect("it is accepted");
    let mut operator = Operator::new(plan, Feeds::Program);
    let mut first = warm.first_cycles();
    for unexpected in operator.restore(&state.tuned, &first).unexpected {
        assert_sentence(&isochrone_engine::escaped(&unexpected.to_string()));
    }
    warm.cold.iter().for_each(|(_, why)| assert_sentence(why));
    state.publish_set(plan, &mut engines);
    state.values(plan);
    for _ in 0..3 {
        for (engine, cycle) in engines.iter_mut().zip(&mut first) {
            engine.step(*cycle);
            *cycle = cycle.saturating_add(1);
        }
    }
}

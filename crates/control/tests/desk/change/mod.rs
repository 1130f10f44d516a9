//! Another configuration for a node that runs.

mod blocks;
mod constants;
mod refusal;
mod underway;
mod values;

use isochrone_control::desk::RequestTerms;

use crate::hand::{Hand, draft};

/// What is wrong with another configuration.
fn refused(hand: &Hand, text: &str) -> Vec<String> {
    let refusals = hand.operator.change(draft(text), RequestTerms::default()).unwrap_err();
    refusals.findings.iter().map(|finding| finding.message.clone()).collect()
}

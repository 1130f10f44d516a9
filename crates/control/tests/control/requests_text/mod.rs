//! What is a request and what is answered to everything else.

mod answers;
mod calls;
mod random;
mod refusals;

use isochrone_control::{Parsed, Unparsed, parse};
use serde_json::{Value as Json, json};

fn parsed(text: &str) -> Parsed {
    parse(text.as_bytes()).unwrap_or_else(|unparsed| panic!("{text}: {unparsed:?}"))
}

fn refused(text: &str) -> Unparsed {
    parse(text.as_bytes()).expect_err(text)
}

/// A request for a method, with the id "7".
fn asking(method: &str, params: Json) -> String {
    json!({"jsonrpc": "2.0", "id": "7", "method": method, "params": params}).to_string()
}

fn findings(unparsed: &Unparsed) -> Vec<(&str, &str)> {
    unparsed.failure.findings.iter().map(|one| (&*one.name, &*one.message)).collect()
}

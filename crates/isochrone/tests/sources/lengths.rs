//! How long files are.

use std::fs;

use crate::{sources, workspace};

/// What fits in the head, and then some.
const MOST_LINES: usize = 400;

#[test]
fn no_file_is_longer_than_fits_in_the_head() {
    let files = sources(workspace());
    assert!(files.len() > 500, "{files:?}");
    let lines = |path: &_| fs::read_to_string(path).unwrap().lines().count();
    let lengths = files.iter().map(|path| (lines(path), path));
    let longer: Vec<_> = lengths.filter(|(lines, _)| *lines > MOST_LINES).collect();
    assert!(longer.is_empty(), "divide by meaning, or simplify: {longer:#?}");
}

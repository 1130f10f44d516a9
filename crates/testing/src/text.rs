//! Reading the output of programs.

/// All of this stands in a text.
#[track_caller]
pub fn assert_says<S: AsRef<str>>(text: &str, parts: &[S]) {
    for part in parts.iter().map(AsRef::as_ref) {
        assert!(text.contains(part), "{part:?} is not in:\n{text}");
    }
}

/// Cells of a CSV text, row by row, the header first.
pub fn cells(csv: &str) -> Vec<Vec<&str>> {
    csv.lines().map(|line| line.split(',').collect()).collect()
}

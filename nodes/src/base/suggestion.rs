//! Names on a command line or in a file that are nearly those of something.

use isochrone_engine::nearest_name;

/// The question at the end of a sentence, if a known name is near to what was written.
pub(crate) fn question<'a>(written: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    match nearest_name(written, known) {
        Some(name) => format!("; did you mean \"{name}\"?"),
        None => String::new(),
    }
}

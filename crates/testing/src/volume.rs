//! How often tests repeat what a single run may not show.

/// Whether `ISOCHRONE_TEST_VOLUME=full` asks for all repetitions.
///
/// # Panics
/// The variable has another value.
pub fn is_full_volume() -> bool {
    match std::env::var("ISOCHRONE_TEST_VOLUME").as_deref() {
        Err(_) | Ok("") => false,
        Ok("full") => true,
        Ok(other) => {
            panic!("ISOCHRONE_TEST_VOLUME={other} means nothing; it is \"full\" or not set")
        }
    }
}

/// How often to repeat something: `full` times if all repetitions are asked for, otherwise a tenth of that,
/// rounded up.
pub fn volume(full: usize) -> usize {
    if is_full_volume() { full } else { full.div_ceil(10) }
}

//! Errors that a `main` prints.

/// Implements `Debug` as `Display` for errors whose sentence says what is wrong and what to do about it: that is
/// what `fn main() -> Result<(), Box<dyn Error>>` prints of them, and what `unwrap` does.
///
/// ```
/// struct Missing;
///
/// impl std::fmt::Display for Missing {
///     fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
///         f.write_str("level.toml is missing; name a file that exists")
///     }
/// }
///
/// isochrone_model::debug_as_display!(Missing);
///
/// assert_eq!(format!("{Missing:?}"), "level.toml is missing; name a file that exists");
/// ```
#[macro_export]
macro_rules! debug_as_display {
    ($($error:ty),+ $(,)?) => {$(
        impl ::core::fmt::Debug for $error {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                ::core::fmt::Display::fmt(self, f)
            }
        }
    )+};
}

//! The benches are in `benches/`: `cargo bench -p isochrone-benches`.

//! One target, named by ISOCHRONE_FUZZ, with what libFuzzer invents.
#![no_main]

use std::sync::LazyLock;

use isochrone_fuzz::{TARGETS, Target};
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

static TARGET: LazyLock<&Target> = LazyLock::new(|| {
    let name = std::env::var("ISOCHRONE_FUZZ").unwrap_or_default();
    TARGETS.iter().find(|target| target.name == name).unwrap_or_else(|| {
        let names: Vec<_> = TARGETS.iter().map(|target| target.name).collect();
        panic!("ISOCHRONE_FUZZ={name:?} is no target; there is: {}", names.join(", "))
    })
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let target = &**TARGET;
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    (target.read)(bytes);
    // What is never touched counts as well.
    let mib = MEMORY.peak_usage().saturating_sub(before) >> 20;
    assert!(
        mib <= target.max_mib,
        "{mib} MiB for {} bytes; at most {}",
        bytes.len(),
        target.max_mib
    );
});

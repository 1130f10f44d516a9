//! The process set-up on the real kernel.

use isochrone_cyclic::{give_back_large_blocks, prepare_process};
use isochrone_testing::in_own_process;

#[test]
fn memory_is_locked_exactly_if_the_grant_says_so_and_allocation_still_works() {
    // It cannot be undone.
    in_own_process(|| {
        let grant = prepare_process();
        let status = std::fs::read_to_string("/proc/self/status").unwrap();
        let locked = status.lines().find_map(|line| line.strip_prefix("VmLck:")).unwrap();
        assert_eq!(grant.memory_locked, locked.trim() != "0 kB", "{grant:?} {locked}");
        assert_eq!(grant.memory_locked, grant.refusals.is_empty());
        assert_eq!(vec![1u8; 32 << 20].len(), 32 << 20);
    });
}

/// Memory of this process in bytes.
fn resident() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<usize>().unwrap() << 10
}

/// What is freed first raises the size from which on glibc would map blocks by itself.
fn large_blocks_go_back() {
    const LARGE: usize = 64 << 20;
    drop(vec![1u8; LARGE / 4]);
    let before = resident();
    let (block, behind) = (vec![1u8; LARGE], Box::new(1u8));
    assert!(resident() > before + LARGE / 2);
    drop(block);
    assert!(resident() < before + LARGE / 2, "{before} before, {} after", resident());
    drop(behind);
}

#[test]
#[cfg(target_env = "gnu")]
fn a_large_block_goes_back_to_the_system_when_it_is_freed() {
    in_own_process(|| {
        give_back_large_blocks();
        large_blocks_go_back();
    });
}

#[test]
#[cfg(target_env = "gnu")]
fn a_large_block_goes_back_to_the_system_though_small_ones_are_kept_and_memory_is_locked() {
    in_own_process(|| {
        prepare_process();
        large_blocks_go_back();
    });
}

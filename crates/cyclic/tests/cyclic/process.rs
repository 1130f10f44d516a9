//! The process set-up on the real kernel.

use isochrone_cyclic::prepare_process;
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

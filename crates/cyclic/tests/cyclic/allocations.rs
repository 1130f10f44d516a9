//! The hot path under the counting allocator.

use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use isochrone_cyclic::{
    Clock, CountingAllocator, Cyclic, Margin, Monotonic, Schedule, Wake, thread_allocations,
};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn allocations_and_reallocations_of_this_thread_are_counted() {
    let before = thread_allocations();
    let mut values = black_box(Vec::<u64>::with_capacity(4));
    values.reserve_exact(400);
    black_box(&values);
    assert_eq!(thread_allocations(), before + 2);
}

#[test]
fn allocations_of_another_thread_are_not_counted() {
    let (ready, go) = std::sync::mpsc::channel::<()>();
    let other = std::thread::spawn(move || {
        go.recv().ok();
        drop(black_box(Box::new(7)));
    });
    let before = thread_allocations();
    drop(ready);
    other.join().unwrap();
    assert_eq!(thread_allocations(), before);
}

#[test]
fn a_cycle_allocates_nothing() {
    for wake in [Wake::Sleep, Wake::Hybrid(Margin::default()), Wake::Spin] {
        let schedule = Schedule::every(100_000, wake);
        let stop = Arc::new(AtomicBool::new(false));
        let mut cyclic = Cyclic::new(Monotonic, schedule, Monotonic.now_ns(), stop);
        let before = thread_allocations();
        for _ in 0..20 {
            cyclic.wait();
            cyclic.finished(Monotonic.now_ns());
        }
        assert_eq!(thread_allocations(), before, "{}", wake.as_str());
    }
}

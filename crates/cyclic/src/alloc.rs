//! An allocator that counts, so that "no allocation in the cycle" is measured and not believed.
#![allow(unsafe_code)] // GlobalAlloc is an unsafe trait; every call is passed on to `System`.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    // Const and without a destructor: reaching it allocates nothing, from the first call to the last.
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The system allocator, counting per thread how often memory was asked for.
///
/// ```
/// #[global_allocator]
/// static ALLOCATOR: isochrone_cyclic::CountingAllocator = isochrone_cyclic::CountingAllocator;
///
/// let before = isochrone_cyclic::thread_allocations();
/// drop(Box::new(1));
/// assert_eq!(isochrone_cyclic::thread_allocations(), before + 1);
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct CountingAllocator;

/// How often this thread has allocated or reallocated since it began; 0 forever unless
/// [`CountingAllocator`] is the program's `#[global_allocator]`. Counts Rust allocations only, not
/// those of C libraries.
pub fn thread_allocations() -> u64 {
    ALLOCATIONS.try_with(Cell::get).unwrap_or(0)
}

/// Whether [`CountingAllocator`] is the program's `#[global_allocator]`. Allocates once to find out.
pub fn counts_allocations() -> bool {
    let before = thread_allocations();
    drop(std::hint::black_box(Box::new(0u8)));
    thread_allocations() != before
}

fn count() {
    // `try_with`: an allocation during the thread's teardown goes uncounted instead of aborting.
    let _ = ALLOCATIONS.try_with(|count| count.set(count.get().wrapping_add(1)));
}

// SAFETY: every method passes its arguments unchanged to `System`, which upholds the contract of
// `GlobalAlloc`; `count` neither allocates nor unwinds.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's obligations are those of `System::alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's obligations are those of `System::alloc_zeroed`.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, ptr: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        count();
        // SAFETY: `ptr` came from `System` through this allocator; the rest is the caller's duty.
        unsafe { System.realloc(ptr, layout, new_size) }
    }

    unsafe fn dealloc(&self, ptr: *mut u8, layout: Layout) {
        // SAFETY: `ptr` came from `System` through this allocator with this layout.
        unsafe { System.dealloc(ptr, layout) }
    }
}

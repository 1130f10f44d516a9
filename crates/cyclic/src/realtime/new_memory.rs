//! Memory that a process maps after its set-up: locked as it is touched, and touched by an ordinary thread.
//!
//! A peer that joins brings a segment of up to megabytes, and the thread of a cycle maps it. Locked whole, it would
//! wait there until every page was in memory; locked as it is touched, later cycles would fault, page by page. So
//! an ordinary thread touches the pages right after, in steps so short that a thread that maps something meanwhile
//! hardly waits for it.
#![allow(unsafe_code)] // madvise takes an address of the process's own map, not one of Rust's.

use std::collections::HashSet;
use std::fs;
use std::ops::Range;
use std::ptr::without_provenance_mut;
use std::sync::{Mutex, PoisonError};

use rustix::mm::{Advice, MlockAllFlags, madvise, mlockall};

use super::process::is_memory_locked;

/// What is touched at a time; the kernel lets nobody map memory meanwhile.
const STEP_BYTES: usize = 256 << 10;

/// None until new memory is locked as it is touched.
static TOUCHED: Mutex<Option<Touched>> = Mutex::new(None);

/// Locks memory that is mapped from now on page by page as it is touched, not whole at once. What is there stays
/// locked, and is touched.
///
/// Call it when the memory of the cycles is there, and [`touch_new_memory`] whenever something may have been mapped
/// for them. Does nothing where [`prepare_process`](super::prepare_process) has not locked memory.
pub fn lock_new_memory_as_touched() {
    if !is_memory_locked() {
        return;
    }
    let mut touched = TOUCHED.lock().unwrap_or_else(PoisonError::into_inner);
    // Kernels before 4.4 refuse it: all is as it was, and peers that join cost the cycle more.
    if mlockall(MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT).is_ok() {
        touched.get_or_insert_default().touch_new();
    }
}

/// Touches the memory that was mapped since the last call, so that no cycle is the first to do it. For an ordinary
/// thread: it reads the process's map, and takes longer the more has been mapped.
///
/// Does nothing before [`lock_new_memory_as_touched`].
pub fn touch_new_memory() {
    if let Some(touched) = &mut *TOUCHED.lock().unwrap_or_else(PoisonError::into_inner) {
        touched.touch_new();
    }
}

/// The part of the process's memory that has been touched.
#[derive(Default)]
struct Touched(HashSet<Mapping>);

impl Touched {
    fn touch_new(&mut self) {
        // Without /proc the cycles touch it themselves.
        let maps = fs::read_to_string("/proc/self/maps").unwrap_or_default();
        let mapped: HashSet<Mapping> = maps.lines().filter_map(Mapping::parse).collect();
        mapped.difference(&self.0).for_each(Mapping::touch);
        self.0 = mapped;
    }
}

/// A line of `/proc/self/maps`, of memory that is shared or the process's own.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct Mapping {
    addresses: Range<usize>,
    is_writable: bool,
    /// Another file may be mapped where one was before.
    inode: u64,
}

impl Mapping {
    /// None of a program's code and data, which are there from its start, and of what may not be read.
    fn parse(line: &str) -> Option<Self> {
        let mut columns = line.split_ascii_whitespace();
        let (start, end) = columns.next()?.split_once('-')?;
        let access = columns.next()?;
        let inode = columns.nth(2)?.parse().ok()?;
        let address = |digits| usize::from_str_radix(digits, 16).ok();
        let (is_writable, is_shared) = (access.starts_with("rw"), access.ends_with('s'));
        let is_data = if is_shared { access.starts_with('r') } else { is_writable && inode == 0 };
        let addresses = address(start)?..address(end)?;
        is_data.then_some(Self { addresses, is_writable, inode })
    }

    fn touch(&self) {
        let how =
            if self.is_writable { Advice::LinuxPopulateWrite } else { Advice::LinuxPopulateRead };
        for start in self.addresses.clone().step_by(STEP_BYTES) {
            let len = STEP_BYTES.min(self.addresses.end - start);
            // SAFETY: to populate pages changes neither their content nor who may use them, so it does not matter to
            // whom they belong. The kernel checks the range: what was unmapped meanwhile is an error, and what was
            // mapped in its place is populated instead.
            if unsafe { madvise(without_provenance_mut(start), len, how) }.is_err() {
                // It is gone, or memory is short, or the kernel is older than 5.14.
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rustix::mm::{MapFlags, ProtFlags, mmap_anonymous, munmap};

    use super::*;
    use crate::usage::thread_usage;

    #[test]
    fn memory_that_was_touched_costs_no_page_fault() {
        const PAGE: usize = 4096;
        const PAGES: usize = 1024;
        let access = ProtFlags::READ | ProtFlags::WRITE;
        let mut touched = Touched::default();
        touched.touch_new();
        // SAFETY: the kernel chooses a free place.
        let memory =
            unsafe { mmap_anonymous(std::ptr::null_mut(), PAGES * PAGE, access, MapFlags::SHARED) };
        let memory = memory.unwrap();
        touched.touch_new();
        let before = thread_usage();
        for page in 0..PAGES {
            // SAFETY: within the mapping, which nobody else knows.
            unsafe { memory.cast::<u8>().add(page * PAGE).write_volatile(1) };
        }
        let faults = thread_usage().since(before).minor_faults;
        // SAFETY: mapped above, and not used any more.
        unsafe { munmap(memory, PAGES * PAGE) }.unwrap();
        assert!(faults < PAGES as u64 / 16, "{faults} faults");
    }

    #[test]
    fn shared_memory_and_the_heap_are_touched_and_programs_and_guard_pages_are_not() {
        let parse = |line| Mapping::parse(line).map(|it| (it.addresses, it.is_writable, it.inode));
        let segment = "7f0000000000-7f0000002000 rw-s 00000000 00:1a 77   /dev/shm/segment";
        assert_eq!(parse(segment), Some((0x7f00_0000_0000..0x7f00_0000_2000, true, 77)));
        let foreign = "7f0000000000-7f0000002000 r--s 00000000 00:1a 78   /dev/shm/segment";
        assert_eq!(parse(foreign), Some((0x7f00_0000_0000..0x7f00_0000_2000, false, 78)));
        let heap = "5500000-5600000 rw-p 00000000 00:00 0       [heap]";
        assert_eq!(parse(heap), Some((0x550_0000..0x560_0000, true, 0)));
        for other in [
            "5500000-5600000 r-xp 00000000 fe:00 12      /usr/bin/isochrone",
            "5500000-5600000 rw-p 00000000 fe:00 12      /usr/bin/isochrone",
            "5500000-5600000 ---p 00000000 00:00 0",
            "5500000-5600000 ---s 00000000 00:1a 79",
            "",
        ] {
            assert_eq!(parse(other), None, "{other}");
        }
    }
}

//! Bare shared memory.
#![allow(unsafe_code)] // Mapping a file has no safe wrapper.

use std::fmt::Debug;
use std::fs::File;
use std::io;
use std::ops::Deref;
use std::ptr::{self, NonNull};
use std::slice;
use std::sync::atomic::AtomicU64;

use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

/// Words of a file that all who map the file share.
pub(super) struct SharedWords {
    address: NonNull<AtomicU64>,
    words: usize,
}

impl SharedWords {
    /// Maps the first `words` words of a file that is open for reading and writing. Nobody may make
    /// the file shorter while it is mapped: to touch what is gone kills the process.
    ///
    /// # Errors
    /// The file is shorter than that, or the kernel refuses the mapping.
    pub(super) fn map(file: &File, words: usize) -> io::Result<Self> {
        let bytes = words.saturating_mul(size_of::<AtomicU64>());
        if bytes == 0 || file.metadata()?.len() < bytes as u64 {
            return Err(io::Error::new(
                io::ErrorKind::UnexpectedEof,
                format!("the file has not {words} words to map"),
            ));
        }
        let access = ProtFlags::READ | ProtFlags::WRITE;
        // SAFETY: the address is the kernel's choice, so no memory that is in use is replaced.
        let address = unsafe { mmap(ptr::null_mut(), bytes, access, MapFlags::SHARED, file, 0)? };
        match NonNull::new(address.cast()) {
            Some(address) => Ok(Self { address, words }),
            None => Err(io::ErrorKind::OutOfMemory.into()),
        }
    }
}

impl Deref for SharedWords {
    type Target = [AtomicU64];

    fn deref(&self) -> &[AtomicU64] {
        // SAFETY: the mapping begins at a page, so words are aligned, is `words` words long and
        // lives as long as `self`. Any bits are a valid u64. Whoever else maps the file may write at
        // any time, which is why the words are atomic.
        unsafe { slice::from_raw_parts(self.address.as_ptr(), self.words) }
    }
}

impl Drop for SharedWords {
    fn drop(&mut self) {
        let bytes = self.words * size_of::<AtomicU64>();
        // SAFETY: this is the mapping that `map` made, and every reference into it has ended.
        let unmapped = unsafe { munmap(self.address.as_ptr().cast(), bytes) };
        debug_assert!(unmapped.is_ok());
    }
}

impl Debug for SharedWords {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SharedWords").field("words", &self.words).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering;

    use super::*;

    #[test]
    fn what_one_mapping_writes_another_reads() {
        let file = tempfile::tempfile().unwrap();
        file.set_len(64).unwrap();
        let (one, other) =
            (SharedWords::map(&file, 8).unwrap(), SharedWords::map(&file, 8).unwrap());
        one[7].store(1_505, Ordering::Release);
        assert_eq!(other[7].load(Ordering::Acquire), 1_505);
        assert_eq!((one.len(), other[0].load(Ordering::Acquire)), (8, 0));
    }

    #[test]
    fn a_file_that_is_too_short_is_refused() {
        let file = tempfile::tempfile().unwrap();
        file.set_len(63).unwrap();
        for words in [8, 0] {
            let error = SharedWords::map(&file, words).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::UnexpectedEof);
        }
    }
}

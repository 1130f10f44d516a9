//! Handles: what C holds instead of pointers to our memory.
//!
//! The value of a handle says which thread opened it, where in that thread's table it stands, and which number it has.
//! So a handle that was closed, is none, or is of another thread is an error and never touches memory, and finding its
//! port takes no lock. What a thread leaves open ends with it.

use std::any::Any;
use std::cell::RefCell;
use std::mem::take;
use std::ptr::without_provenance_mut;
use std::sync::atomic::{AtomicU32, Ordering};

use isochrone_ipc::{ForRealTime, InRealTime};

use crate::process::of_this_process;
use crate::status::{Failure, ISOCHRONE_ERROR_CLOSED, ISOCHRONE_ERROR_THREAD};

/// Bits of a handle from the lowest: its number, its place, its thread.
const NUMBER_BITS: u32 = 32;
const PLACE_BITS: u32 = 12;
const THREAD_BITS: u32 = usize::BITS - NUMBER_BITS - PLACE_BITS;

/// What a handle that stays in its thread stands for.
pub(crate) trait Port: Sized + 'static {
    /// The type that C knows.
    type Handle;
    /// What sentences call it.
    const NOUN: &str;
}

thread_local! {
    static TABLE: RefCell<Table> = RefCell::new(Table::new());
}

/// The ports of a thread.
struct Table {
    /// While there are ports, the thread lacks root's right to open any file, for which each port would otherwise make
    /// four system calls a call. Restored before they end.
    rights: Option<InRealTime<()>>,
    thread: usize,
    process: u32,
    /// Each holds the [`InRealTime`] of a [`Port`].
    places: Vec<Option<(usize, Box<dyn Any>)>>,
}

/// At the end of the thread.
impl Drop for Table {
    fn drop(&mut self) {
        of_this_process(self.process, (self.rights.take(), take(&mut self.places)));
    }
}

impl Table {
    fn new() -> Self {
        static THREADS: AtomicU32 = AtomicU32::new(0);
        let thread = THREADS.fetch_add(1, Ordering::Relaxed) as usize % ((1 << THREAD_BITS) - 1);
        Self { rights: None, thread: thread + 1, process: std::process::id(), places: Vec::new() }
    }

    fn open<P: Port>(&mut self, port: ForRealTime<P>) -> Result<usize, Failure> {
        static NUMBERS: AtomicU32 = AtomicU32::new(1);
        let free = self.places.iter().position(Option::is_none);
        let place = free.unwrap_or(self.places.len());
        if place >> PLACE_BITS != 0 {
            let most = 1 << PLACE_BITS;
            return Err(Failure::argument(format!("a thread can have {most} handles; close some")));
        }
        self.places.resize_with(self.places.len().max(place + 1), || None);
        let number = NUMBERS.fetch_add(1, Ordering::Relaxed).max(1) as usize;
        let handle = (self.thread << PLACE_BITS | place) << NUMBER_BITS | number;
        self.rights.get_or_insert_with(|| ForRealTime::nothing().enter());
        self.places[place] = Some((handle, Box::new(port.enter())));
        Ok(handle)
    }

    fn find<P: Port>(&mut self, handle: usize) -> Result<&mut P, Failure> {
        let (thread, place) = (self.thread, place_of(handle));
        let found = match self.places.get_mut(place) {
            Some(Some((known, port))) if *known == handle => port.downcast_mut::<InRealTime<P>>(),
            _ => None,
        };
        found.map(|port| &mut **port).ok_or_else(|| misused::<P>(handle, thread))
    }

    fn close<P: Port>(&mut self, handle: usize) -> Result<(), Failure> {
        self.find::<P>(handle)?;
        let place = place_of(handle);
        self.rights = None;
        self.places[place] = None;
        if self.places.iter().any(Option::is_some) {
            self.rights = Some(ForRealTime::nothing().enter());
        }
        Ok(())
    }
}

fn place_of(handle: usize) -> usize {
    handle >> NUMBER_BITS & ((1 << PLACE_BITS) - 1)
}

/// Why a handle has no port here.
fn misused<P: Port>(handle: usize, thread: usize) -> Failure {
    let noun = P::NOUN;
    let other = handle >> (NUMBER_BITS + PLACE_BITS);
    if handle == 0 {
        Failure::argument(format!("the {noun} is NULL"))
    } else if other != thread && other != 0 {
        Failure::new(
            ISOCHRONE_ERROR_THREAD,
            format!("the {noun} belongs to another thread; a thread uses what it opened itself"),
        )
    } else {
        Failure::new(
            ISOCHRONE_ERROR_CLOSED,
            format!("the {noun} was closed already, or is none at all"),
        )
    }
}

/// Puts a port into the calling thread's table.
pub(crate) fn open<P: Port>(port: ForRealTime<P>) -> Result<*mut P::Handle, Failure> {
    in_table::<P, _>(|table| table.open(port)).map(without_provenance_mut)
}

/// Uses a port of the calling thread.
pub(crate) fn with<P: Port, R>(
    handle: *mut P::Handle,
    using: impl FnOnce(&mut P) -> Result<R, Failure>,
) -> Result<R, Failure> {
    in_table::<P, _>(|table| table.find(handle.addr()).and_then(using))
}

/// Ends a port of the calling thread; NULL is none.
pub(crate) fn close<P: Port>(handle: *mut P::Handle) -> Result<(), Failure> {
    if handle.is_null() {
        return Ok(());
    }
    in_table::<P, _>(|table| table.close::<P>(handle.addr()))
}

fn in_table<P: Port, R>(
    using: impl FnOnce(&mut Table) -> Result<R, Failure>,
) -> Result<R, Failure> {
    let used = TABLE.try_with(|table| using(&mut table.borrow_mut()));
    // Where a thread ends, its ports have ended.
    used.unwrap_or_else(|_| {
        let noun = P::NOUN;
        let ended = format!("the thread ends, and its {noun} has ended");
        Err(Failure::new(ISOCHRONE_ERROR_CLOSED, ended))
    })
}

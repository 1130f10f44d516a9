//! What the calls of a cycle may not do.
#![allow(unsafe_code, reason = "it calls as C does")]

use std::ffi::CString;
use std::ptr::{null, null_mut};

use isochrone_cyclic::{CountingAllocator, thread_allocations};
use isochrone_testing::Domain;

use crate::participant::{isochrone_participant_join, isochrone_participant_leave};
use crate::publisher::{
    isochrone_publisher_close, isochrone_publisher_loan, isochrone_publisher_open,
    isochrone_publisher_send, isochrone_signal, isochrone_stamp,
};
use crate::status::{ISOCHRONE_NOTHING, ISOCHRONE_OK};
use crate::subscriber::{
    isochrone_frame, isochrone_subscriber_close, isochrone_subscriber_maintain,
    isochrone_subscriber_newest, isochrone_subscriber_open, isochrone_subscriber_wait,
};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn sending_and_reading_the_newest_frame_allocate_nothing() {
    let domain = Domain::new();
    let file = CString::new(domain.config_file().to_str().unwrap()).unwrap();
    let signals = [c"a", c"b"].map(|name| isochrone_signal {
        name: name.as_ptr(),
        r#type: null(),
        unit: null(),
    });
    let (mut participant, mut publisher, mut subscriber) = (null_mut(), null_mut(), null_mut());
    let mut values = null_mut();
    let stamp = isochrone_stamp { cycle: 1, release_ns: 2, source_ns: 0, missed: 0, flags: 0 };
    let mut frame = std::mem::MaybeUninit::<isochrone_frame>::uninit();
    let mut allocated = 0;
    // SAFETY: all pointers are of what stands above, which outlives the calls; a frame is read where a call gave one.
    unsafe {
        let name = c"b".as_ptr();
        assert_eq!(
            isochrone_participant_join(c"c".as_ptr(), file.as_ptr(), &raw mut participant),
            ISOCHRONE_OK
        );
        let opened = isochrone_subscriber_open(
            participant,
            c"x".as_ptr(),
            &raw const name,
            1,
            &raw mut subscriber,
        );
        assert_eq!(opened, ISOCHRONE_OK);
        let opened = isochrone_publisher_open(
            participant,
            c"x".as_ptr(),
            signals.as_ptr(),
            2,
            0,
            &raw mut publisher,
        );
        assert_eq!(opened, ISOCHRONE_OK);
        for n in 0..1000 {
            assert_eq!(isochrone_publisher_loan(publisher, &raw mut values), ISOCHRONE_OK);
            *values.add(1) = f64::from(n);
            let before = thread_allocations();
            let sent = isochrone_publisher_send(publisher, &raw const stamp);
            let read = match n {
                // Until the names are heard.
                0 => isochrone_subscriber_wait(subscriber, 60_000_000_000, frame.as_mut_ptr()),
                _ => isochrone_subscriber_newest(subscriber, frame.as_mut_ptr()),
            };
            let value = *frame.assume_init_ref().values;
            let none = isochrone_subscriber_newest(subscriber, frame.as_mut_ptr());
            if n > 0 {
                allocated += thread_allocations() - before;
            }
            assert_eq!((sent, read, none), (ISOCHRONE_OK, ISOCHRONE_OK, ISOCHRONE_NOTHING));
            assert_eq!(value, f64::from(n));
            assert_eq!(isochrone_subscriber_maintain(subscriber), ISOCHRONE_OK);
        }
    }
    assert_eq!(allocated, 0);
    let _ = (isochrone_publisher_close(publisher), isochrone_subscriber_close(subscriber));
    assert_eq!(isochrone_participant_leave(participant), ISOCHRONE_OK);
    domain.expect_no_leftovers();
}

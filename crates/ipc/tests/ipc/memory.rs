//! What ports take of shared memory.

use std::os::unix::fs::MetadataExt;

use crate::variants::layout;
use isochrone_ipc::{FramePublisher, ipc};
use isochrone_testing::Domain;

#[test]
fn every_page_of_the_frames_is_claimed_when_their_publisher_is_opened() {
    let domain = Domain::new();
    let node = domain.join_variant::<ipc::Service>("tester");
    let _writer = FramePublisher::open(&node, "x", &layout(&["a:LREAL"])).unwrap();
    let files = domain.files();
    let frames: Vec<_> =
        files.iter().filter(|file| file.to_string_lossy().ends_with(".data")).collect();
    let [frames] = frames[..] else { panic!("{files:?}") };
    let segment = std::fs::metadata(frames).unwrap();
    // What a page that nobody claimed needs is found out at its first touch, by SIGBUS.
    assert!(segment.len() > 100_000, "{} bytes", segment.len());
    assert!(
        segment.blocks() * 512 >= segment.len(),
        "{} of {}",
        segment.blocks() * 512,
        segment.len()
    );
}

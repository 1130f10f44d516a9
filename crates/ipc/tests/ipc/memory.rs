//! What ports take of shared memory.

use std::os::unix::fs::MetadataExt;

use crate::variants::layout;
use isochrone_ipc::{FramePublisher, ipc};
use isochrone_testing::Domain;

#[test]
fn every_page_of_the_frames_is_claimed_when_their_publisher_is_opened() {
    let domain = Domain::new();
    let node = domain.join_variant::<ipc::Service>("tester");
    let signals: Vec<String> = (0..1_000).map(|n| format!("a{n}:LREAL")).collect();
    let signals: Vec<&str> = signals.iter().map(String::as_str).collect();
    let _writer = FramePublisher::open(&node, "x", &layout(&signals)).unwrap();
    let files = domain.files();
    let frames: Vec<_> =
        files.iter().filter(|file| file.to_string_lossy().ends_with(".data")).collect();
    let [frames] = frames[..] else { panic!("{files:?}") };
    let segment = std::fs::metadata(frames).unwrap();
    // What a page that nobody claimed needs is found out at its first touch, by SIGBUS.
    // As many as one buffer holds, not as many for each reader.
    assert!((1_000_000..4_000_000).contains(&segment.len()), "{} bytes", segment.len());
    assert!(
        segment.blocks() * 512 >= segment.len(),
        "{} of {}",
        segment.blocks() * 512,
        segment.len()
    );
}

//! What a reader of frames receives: the announcement of a layout in JSON, a zero, and headers of frames.

use isochrone_ipc::{
    Announcement, Depth, FrameHeader, FrameSubscriber, IsolatedDomain, Participant, Receipt,
    SenderClock, Stamps, raw_publisher,
};

use crate::{Target, assert_sentence};

pub(crate) const TARGET: Target = Target { name: "frames", max_bytes: 2048, max_mib: 64, read };

/// A header has nine, and one more says when the frame is received and who sent it.
const WORDS: usize = 10;
/// Frames that wait in a buffer are not lost.
const MOST_FRAMES: usize = 16;

fn read(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    announcement(parts.next().unwrap_or_default());
    let (words, _) = parts.next().unwrap_or_default().as_chunks::<8>();
    let words: Vec<u64> = words.iter().map(|word| u64::from_le_bytes(*word)).collect();
    let (frames, _) = words.as_chunks::<WORDS>();
    if !frames.is_empty() {
        receive(frames);
    }
}

fn announcement(json: &[u8]) {
    let read = match Announcement::from_json(json) {
        Ok(read) => read,
        Err(refused) => return assert_sentence(&isochrone_engine::escaped(&refused.to_string())),
    };
    assert_eq!(Announcement::from_json(&read.to_json()).as_ref(), Ok(&read), "it reads back");
    let Announcement { publisher, host, layout, .. } = &read;
    let words = layout.signals.iter().flat_map(|it| [&it.name, &it.value_type, &it.unit]);
    let mut words = words.chain([publisher, host]);
    assert!(words.all(|word| !word.contains(char::is_control)), "{read:?}");
    assert_ne!(layout.number(), 0);
    layout.check().err().iter().for_each(|refused| assert_sentence(&refused.to_string()));
    for (channel, signal) in layout.signals.iter().enumerate() {
        assert!(layout.find(&signal.name).is_ok_and(|found| found <= channel));
        if let Err(conflict) = layout.check_channel(channel, "INT") {
            assert_sentence(&conflict.to_string());
        }
    }
}

/// Frames of one writer or two, whatever they say of themselves.
fn receive(frames: &[[u64; WORDS]]) {
    let domain = IsolatedDomain::new("isofuzz").expect("a domain");
    let node = Participant::join_local("fuzz", &domain).expect("a participant");
    let writers = [(); 2].map(|()| raw_publisher(&node, "x", 1).expect("a publisher"));
    let mut reader = FrameSubscriber::open(&node, "x", 1, Depth::All).expect("a subscriber");
    let (mut now_ns, mut received) = (1, 0);
    for words in frames.iter().take(MOST_FRAMES) {
        let header = header(words);
        let [.., when] = *words;
        now_ns = now_ns.max(when);
        for clock in [SenderClock::Shared, SenderClock::Foreign] {
            check_times(&header, clock, now_ns);
        }
        let mut frame = writers[(when % 2) as usize].loan_slice(1).expect("room for a frame");
        *frame.user_header_mut() = header;
        frame.send().expect("it is sent");
        while let Some(frame) = reader.next(now_ns) {
            assert_eq!((frame.header(), frame.values().len()), (&header, 1));
            received += 1;
        }
        assert!(
            reader.next_look_ns(now_ns) > now_ns || now_ns == u64::MAX,
            "no look after {now_ns}"
        );
        reader.maintain();
    }
    assert_eq!(reader.counters().received, received, "{:?}", reader.counters());
}

fn header(words: &[u64; WORDS]) -> FrameHeader {
    let [sequence, cycle, release_ns, publish_ns, source_ns, missed, flags, term, layout, _] =
        *words;
    FrameHeader { sequence, cycle, release_ns, publish_ns, source_ns, missed, flags, term, layout }
}

/// No time that is believed lies in the reader's future, and a source is no younger than its frame.
fn check_times(header: &FrameHeader, clock: SenderClock, now_ns: u64) {
    let credible = header.credible(clock, now_ns);
    assert!((1..=now_ns).contains(&credible.source_ns), "{credible:?} at {now_ns}");
    assert!(credible.sampled_ns <= now_ns, "{credible:?} at {now_ns}");
    let receipt = Receipt {
        header: *header,
        received_ns: now_ns,
        stamps: credible.stamps,
        ..Receipt::default()
    };
    assert!(receipt.due_ns() <= now_ns, "{receipt:?}");
    assert_eq!(receipt.age_ns().is_some(), credible.stamps == Stamps::Believed);
    assert!(!format!("{:?}", header.flags()).is_empty());
}

//! Recordings: files in MCAP, of this program and of ROS 2, whole or damaged.

use std::io::{Cursor, Read};

use isochrone_recording::{FileCondition, Item, Reader, RecordingReadError, repair};

use crate::{Target, assert_sentence};

/// A chunk may claim 64 MiB, and is then compressed to little.
pub(crate) const TARGET: Target =
    Target { name: "recordings", max_bytes: 8192, max_mib: 512, read };

fn read(bytes: &[u8]) {
    if let Err(refused) = Reader::open(bytes).and_then(items) {
        assert_sentence(&refused.to_string());
    }
    let known = Reader::open_with_index(Cursor::new(bytes)).and_then(items);
    let repaired = repair(Cursor::new(bytes), Vec::new());
    let (known, (of_repair, repaired)) = match (known, repaired) {
        (Ok(known), Ok(repaired)) => (known, repaired),
        (known, repaired) => {
            known.err().iter().for_each(|refused| assert_sentence(&refused.to_string()));
            repaired.err().iter().for_each(|refused| assert_sentence(&refused.to_string()));
            return;
        }
    };
    let is_damaged = of_repair.condition.damaged > 0;
    match Reader::open(&repaired[..]).and_then(items) {
        Ok((again, condition)) => {
            assert!(condition.is_closed, "repaired, and {condition:?}");
            assert!(is_damaged || again == known.0, "repaired: {again:?}\nwas: {:?}", known.0);
        }
        // Of two channels that contradict each other, one may be of another program's version.
        Err(refused) => assert!(is_damaged, "repaired, and {refused}"),
    }
}

/// All items as text, and what the file's condition is at its end.
fn items<R: Read>(
    mut reader: Reader<R>,
) -> Result<(Vec<String>, FileCondition), RecordingReadError> {
    let mut items = Vec::new();
    while let Some(item) = reader.next_item()? {
        match &item {
            Item::Frame(frame) => assert_eq!(frame.values.len(), frame.carried.signals.len()),
            Item::Row(row) => {
                let outputs = row.layout.outputs.iter().map(|output| output.signals.len());
                assert!(row.values.len() >= outputs.sum(), "{row:?}");
            }
            Item::Mark(_) | Item::Entry(_) | Item::Configuration(_) | Item::State(_) => {}
        }
        items.push(format!("{item:?}"));
    }
    reader.uncarried().for_each(|it| assert_sentence(&format!("{it:?}")));
    Ok((items, reader.condition().clone()))
}

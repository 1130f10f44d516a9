//! Rows of values, one for each cycle, from the cycle to an ordinary thread.

use rtrb::{Consumer, Producer, RingBuffer};

use crate::records::{Cycle, cycles_within};

/// The cycle's end.
///
/// The values of a row enter their ring before its cycle enters the other, and leave it first: if there is room for a
/// cycle, there is room for its values.
pub(crate) struct RowSender {
    cycles: Producer<Cycle>,
    values: Producer<f64>,
    width: usize,
}

/// The ordinary thread's end.
pub(crate) struct RowReceiver {
    cycles: Consumer<Cycle>,
    values: Consumer<f64>,
    width: usize,
}

/// Makes both ends, for `rows` rows of `values` values. The memory is touched, so that no cycle causes a page fault
/// there.
pub(crate) fn ends(width: usize, rows: usize) -> (RowSender, RowReceiver) {
    let (cycle_sender, cycle_receiver) = RingBuffer::new(rows);
    let (value_sender, value_receiver) = RingBuffer::new(rows.saturating_mul(width));
    let mut sender = RowSender { cycles: cycle_sender, values: value_sender, width };
    let mut receiver = RowReceiver { cycles: cycle_receiver, values: value_receiver, width };
    (0..rows).for_each(|_| sender.push(&Cycle::default(), std::iter::empty()));
    let mut row = vec![0.0; width];
    while receiver.pop(&mut row).is_some() {}
    (sender, receiver)
}

/// How many rows of this width cover this time, or fill the memory that a ring may have, if that is less.
pub(crate) fn rows_within(ns: u64, period_ns: u64, width: usize, most_bytes: usize) -> usize {
    let row_bytes = size_of::<Cycle>() + width * size_of::<f64>();
    cycles_within(ns, period_ns, row_bytes, most_bytes)
}

impl RowSender {
    /// Sends the row of a cycle; values that are missing are 0. A full ring drops it, and the reader sees the
    /// gap. Neither waits nor allocates.
    #[inline]
    pub(crate) fn push(&mut self, cycle: &Cycle, values: impl Iterator<Item = f64>) {
        if self.cycles.is_full() {
            return;
        }
        let Ok(room) = self.values.write_chunk_uninit(self.width) else { return };
        room.fill_from_iter(values.chain(std::iter::repeat(0.0)));
        let _ = self.cycles.push(*cycle);
    }

    /// Whether the other end is gone.
    #[inline]
    pub(crate) fn is_abandoned(&self) -> bool {
        self.cycles.is_abandoned()
    }
}

impl RowReceiver {
    /// Takes the next row; `values` gets as many of its values as it has room for.
    pub(crate) fn pop(&mut self, values: &mut [f64]) -> Option<Cycle> {
        debug_assert_eq!(values.len(), self.width);
        let cycle = *self.cycles.peek().ok()?;
        self.values.pop_entire_slice(values).ok()?;
        let _ = self.cycles.pop();
        Some(cycle)
    }

    /// Whether the ring is empty and the other end gone.
    pub(crate) fn is_over(&self) -> bool {
        self.cycles.is_abandoned() && self.cycles.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use isochrone_timing::CycleRecord;

    use super::*;

    fn cycle(cycle: u64) -> Cycle {
        Cycle { record: CycleRecord { cycle, ..CycleRecord::default() }, follow: None }
    }

    #[test]
    fn rows_come_whole_and_in_order_and_those_without_room_leave_a_gap() {
        let (mut sender, mut receiver) = ends(3, 16);
        let mut row = [0.0; 3];
        for turn in 0..10_u64 {
            for n in turn * 20..turn * 20 + 20 {
                sender.push(&cycle(n), [n as f64, f64::NAN, -(n as f64)].into_iter());
            }
            for n in turn * 20..turn * 20 + 16 {
                assert_eq!(receiver.pop(&mut row).unwrap().record.cycle, n);
                let expected = [n as f64, f64::NAN, -(n as f64)];
                assert_eq!(row.map(f64::to_bits), expected.map(f64::to_bits));
            }
            assert!(receiver.pop(&mut row).is_none() && !receiver.is_over());
        }
        sender.push(&cycle(7), std::iter::empty());
        drop(sender);
        assert!(!receiver.is_over(), "the last row is still to be taken");
        assert_eq!(receiver.pop(&mut row).unwrap().record.cycle, 7);
        assert!(receiver.is_over());
    }

    #[test]
    fn rows_without_values_are_rows_too() {
        let (mut sender, mut receiver) = ends(0, 16);
        sender.push(&cycle(3), std::iter::empty());
        assert_eq!(receiver.pop(&mut []).unwrap().record.cycle, 3);
        assert!(receiver.pop(&mut []).is_none());
    }

    #[test]
    fn a_ring_is_bounded_in_time_and_in_memory() {
        assert_eq!(rows_within(1_000_000_000, 1_000_000, 1, 4 << 20), 1000);
        assert_eq!(rows_within(1_000_000_000, 2_000_000_000, 1, 4 << 20), 16);
        let bounded = rows_within(1_000_000_000, 10_000, 64, 4 << 20);
        assert!(bounded * 64 * 8 <= 4 << 20 && bounded > 4000, "{bounded}");
    }
}

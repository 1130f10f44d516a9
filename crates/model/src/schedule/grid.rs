//! The grid that the nodes of a machine share, and where it lies between the ticks of the kernel.

/// The kernel's ticks come at multiples of this on the clock, in ns.
pub const KERNEL_TICK_NS: u64 = 1_000_000;

/// Where the common grid of a node's tasks begins, in ns behind a whole millisecond of the clock:
/// between two of the kernel's ticks.
pub const EPOCH_OFFSET_NS: u64 = 500_000;

/// A grid begins [`EPOCH_OFFSET_NS`] behind a multiple of this, in ns: ticks of 100, 250 and 1000 Hz fall on it.
pub const EPOCH_GRID_NS: u64 = 20_000_000;

/// The first instant from `earliest_ns` on at which a grid may begin, both in ns of `CLOCK_MONOTONIC`. The
/// kernel's ticks come at whole milliseconds of the clock; a release that meets one is late by what the
/// tick does. So the grid begins between them. A loop that begins at such an instant with a period
/// that divides 20 ms shares the grid of all nodes.
pub fn epoch_after_ns(earliest_ns: u64) -> u64 {
    earliest_ns.next_multiple_of(EPOCH_GRID_NS) + EPOCH_OFFSET_NS
}

/// The phase that puts the releases of a task of this period between the kernel's ticks, as far from
/// them as the period allows; both in ns. The period is not 0.
///
/// Behind a tick the releases stand at all multiples of the greatest common divisor of period and
/// tick, and a tick falls in the middle between two of those.
pub const fn phase_between_ticks_ns(period_ns: u64) -> u64 {
    let grid_ns = greatest_common_divisor(KERNEL_TICK_NS, period_ns);
    (grid_ns + grid_ns / 2 - EPOCH_OFFSET_NS % grid_ns) % grid_ns
}

/// The greatest number that divides both.
pub const fn greatest_common_divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn releases_stand_as_far_from_the_ticks_as_their_period_allows() {
        for (period_ns, nearest_ns) in
            [(1_000_000, 500_000), (100_000, 50_000), (2_500_000, 250_000), (1_001_000, 500)]
        {
            let phase_ns = phase_between_ticks_ns(period_ns);
            let distances = (0..1_000u64).map(|cycle| {
                let behind_tick_ns =
                    (EPOCH_OFFSET_NS + phase_ns + cycle * period_ns) % KERNEL_TICK_NS;
                behind_tick_ns.min(KERNEL_TICK_NS - behind_tick_ns)
            });
            assert_eq!(distances.min(), Some(nearest_ns), "{period_ns}");
            assert!(phase_ns < period_ns);
        }
    }
}

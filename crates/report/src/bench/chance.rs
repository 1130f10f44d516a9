//! Numbers drawn by chance, the same ones in every run.

/// Vigna's SplitMix64, from a fixed seed: the same turns give the same interval.
pub(super) struct Chance(pub(super) u64);

impl Chance {
    pub(super) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// How often each of `turns` turns comes when as many are drawn, with replacement.
    pub(super) fn draw(&mut self, turns: usize) -> Vec<u64> {
        let mut weights = vec![0; turns];
        for _ in 0..turns {
            let drawn = (self.next() % turns as u64) as usize;
            if let Some(weight) = weights.get_mut(drawn) {
                *weight += 1;
            }
        }
        weights
    }
}

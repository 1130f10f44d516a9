//! The order in which arms take turns.

/// Rounds in which each of `arms` arms has a turn, in alternating order (A B C, C B A, ...), so
/// that disturbances and drift of the machine affect all of them. The items are round and arm, from
/// 0.
pub fn turn_order(rounds: usize, arms: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..rounds).flat_map(move |round| {
        (0..arms).map(move |place| match round % 2 {
            0 => (round, place),
            _ => (round, arms - 1 - place),
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arms_take_turns_forth_and_back() {
        let order: Vec<usize> = turn_order(3, 2).map(|(_, arm)| arm).collect();
        assert_eq!(order, [0, 1, 1, 0, 0, 1]);
    }

    #[test]
    fn every_arm_has_as_many_turns_as_there_are_rounds() {
        for arm in 0..3 {
            assert_eq!(turn_order(5, 3).filter(|(_, turn)| *turn == arm).count(), 5);
        }
        assert_eq!(turn_order(4, 0).count(), 0);
    }
}

//! A signal as lines of pixels.

use isochrone_scope::{Column, Extremes};

/// Lines through what each column of a picture has, from the pixel `left` on; a column without values ends
/// a line. `y` says at which pixel a value is.
pub(super) fn lines(columns: &[Column], left: i32, y: impl Fn(f64) -> i32) -> Vec<Vec<(i32, i32)>> {
    let mut lines = Vec::new();
    let mut line: Vec<(i32, i32)> = Vec::new();
    for (column, x) in columns.iter().zip(left..) {
        let Some(Extremes { low, high }) = column.values else {
            lines.push(std::mem::take(&mut line));
            continue;
        };
        let (low, high) = (y(low), y(high));
        // From where the line stands to the nearer end first.
        let is_nearer_low = line.last().is_none_or(|(_, at)| (at - low).abs() <= (at - high).abs());
        let (first, second) = if is_nearer_low { (low, high) } else { (high, low) };
        extend(&mut line, (x, first));
        extend(&mut line, (x, second));
        // To the end of the column, as a value holds.
        extend(&mut line, (x + 1, second));
    }
    lines.push(line);
    lines.retain(|line| !line.is_empty());
    lines
}

/// Adds a point. What lies on the way from the one before the last needs no point of its own.
fn extend(line: &mut Vec<(i32, i32)>, (x, y): (i32, i32)) {
    match line.as_mut_slice() {
        [.., last] if *last == (x, y) => {}
        [.., (_, y0), (x1, y1)] if *y0 == *y1 && *y1 == y => *x1 = x,
        [.., (x0, y0), (x1, y1)]
            if *x0 == *x1 && *x1 == x && (*y1 - *y0).signum() == (y - *y1).signum() =>
        {
            *y1 = y;
        }
        _ => line.push((x, y)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(low: f64, high: f64) -> Column {
        Column { values: Some(Extremes { low, high }), ..Column::default() }
    }

    fn of(columns: &[Column]) -> Vec<Vec<(i32, i32)>> {
        lines(columns, 10, |value| value as i32)
    }

    #[test]
    fn a_value_that_stays_is_two_points_and_a_step_two_more() {
        let columns = [column(5.0, 5.0), column(5.0, 5.0), column(5.0, 9.0), column(9.0, 9.0)];
        assert_eq!(of(&columns), [[(10, 5), (12, 5), (12, 9), (14, 9)]]);
    }

    #[test]
    fn a_spike_within_a_column_is_drawn_whole() {
        let columns = [column(5.0, 5.0), column(5.0, 90.0), column(5.0, 5.0)];
        let line = of(&columns).remove(0);
        assert!(line.contains(&(11, 90)), "{line:?}");
        assert_eq!(line.last(), Some(&(13, 5)));
    }

    #[test]
    fn a_column_without_values_divides_the_line() {
        let columns = [column(5.0, 5.0), Column::default(), column(6.0, 6.0)];
        assert_eq!(of(&columns), [[(10, 5), (11, 5)], [(12, 6), (13, 6)]]);
        assert_eq!(of(&[Column::default()]), Vec::<Vec<_>>::new());
    }
}

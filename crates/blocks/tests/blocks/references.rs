//! The blocks against references that were written from the specification alone, bit for bit.
//!
//! A reference works on slots, knows no other block, and favours the words of the specification
//! over speed.

use crate::arbitrary;
use crate::arbitrary::OBS;
use isochrone_blocks::{
    Block, Cycle, Ob, Slots, lim_rate_of_change, lim_rate_of_change_advanced, saw_tooth,
    scale_linear,
};
use proptest::prelude::*;

/// Sample time in seconds, or status and subfunction status.
fn sample_time(ob: Ob, period_ns: u64) -> Result<f64, (u16, u16)> {
    let number = match ob {
        Ob::Caller => return Ok(period_ns as f64 / 1e9),
        Ob::Task { period_ns } => return Ok(period_ns as f64 / 1e9),
        Ob::Number(number) => number,
    };
    for (configured, period_ns) in OBS {
        if *configured == number {
            return Ok(*period_ns as f64 / 1e9);
        }
    }
    if (30..=38).contains(&number) || (123..=32_767).contains(&number) {
        Err((0x8601, 0))
    } else {
        Err((0x8600, 0x8090))
    }
}

fn truth(condition: bool) -> f64 {
    if condition { 1.0 } else { 0.0 }
}

/// LimRateOfChangeCI; `y` is the last output.
fn ramp(y: &mut f64, i: &lim_rate_of_change::Inputs, period_ns: u64) -> Vec<f64> {
    let t = sample_time(i.call_ob, period_ns);
    let used = if i.en_default_out_value { i.default_out_value } else { i.value };
    let (mut status, mut subfunction) = (0, 0);
    if i.set_change_rate.is_nan() || used.is_nan() || used.is_infinite() {
        status = 0x8F00;
    }
    if i.set_change_rate < 0.0 {
        status = 0x8200;
    }
    if let Err(error) = t {
        (status, subfunction) = error;
    }
    if i.en_default_out_value {
        if used.is_finite() {
            *y = used;
        }
    } else if status == 0 {
        let step = i.set_change_rate * t.unwrap();
        if i.value > *y {
            *y = if *y + step < i.value { *y + step } else { i.value };
        } else {
            *y = if *y - step > i.value { *y - step } else { i.value };
        }
    }
    vec![*y, truth(status >= 0x8000), f64::from(status), f64::from(subfunction)]
}

#[derive(Default)]
struct Advanced {
    y: f64,
    disarmed: bool,
}

/// LimRateOfChangeAdvancedCI.
fn advanced(s: &mut Advanced, i: &lim_rate_of_change_advanced::Inputs, period_ns: u64) -> Vec<f64> {
    let (pos_up, pos_down) = (i.set_pos_up_rate_lim, i.set_pos_down_rate_lim);
    let (neg_up, neg_down) = (i.set_neg_up_rate_lim, i.set_neg_down_rate_lim);
    let rates = [pos_up, pos_down, neg_up, neg_down];
    let (high, low) = (i.set_high_lim, i.set_low_lim);
    let t = sample_time(i.call_ob, period_ns);
    let mode = match () {
        () if i.reset => "restart",
        () if i.man_op => "manual",
        () if i.en_default_out_value => "preset",
        () if i.track => "tracking",
        () if rates.iter().all(|rate| *rate == 0.0) => "disabled",
        () => "automatic",
    };
    let used = match mode {
        "restart" if i.en_default_out_value => i.default_out_value,
        "manual" => i.manual_value,
        "preset" => i.default_out_value,
        "tracking" | "automatic" => i.auto_value,
        _ => 0.0,
    };
    // The only legal infinities of limits are high +inf and low -inf.
    let limits_nan =
        high.is_nan() || low.is_nan() || high == f64::NEG_INFINITY || low == f64::INFINITY;
    let limits_valid = !limits_nan && high >= low;
    let rates_valid = rates.iter().all(|rate| *rate >= 0.0);
    let (mut status, mut subfunction) = (0, 0);
    if limits_nan || rates.iter().any(|rate| rate.is_nan()) || !used.is_finite() {
        status = 0x8F00;
    }
    if rates.iter().any(|rate| *rate < 0.0) {
        status = 0x8202;
    }
    if high < low {
        status = 0x8200;
    }
    if let Err(error) = t {
        (status, subfunction) = error;
    }
    let valid = match mode {
        "restart" | "manual" => true,
        "preset" | "tracking" => limits_valid,
        _ => limits_valid && rates_valid && t.is_ok(),
    };
    // posUp, posDown, negUp, negDown, high, low
    let mut flags = [false; 6];
    if valid && used.is_finite() {
        let mut candidate = used;
        if mode == "automatic" {
            let t = t.unwrap();
            let (y, target) = (s.y, i.auto_value);
            if target > y {
                if y >= 0.0 {
                    candidate = y + pos_up * t;
                    flags[0] = candidate < target;
                } else {
                    candidate = y + neg_down * t;
                    flags[3] = candidate < target;
                    if candidate >= 0.0 && target > 0.0 {
                        let rest = t - y.abs() / neg_down;
                        candidate = if rest > 0.0 { 0.0 + pos_up * rest } else { 0.0 };
                        flags[0] = rest > 0.0 && candidate < target;
                        flags[3] = rest <= 0.0;
                    }
                }
                if candidate >= target {
                    candidate = target;
                }
            } else if target < y {
                if y <= 0.0 {
                    candidate = y - neg_up * t;
                    flags[2] = candidate > target;
                } else {
                    candidate = y - pos_down * t;
                    flags[1] = candidate > target;
                    if candidate <= 0.0 && target < 0.0 {
                        let rest = t - y.abs() / pos_down;
                        candidate = if rest > 0.0 { 0.0 - neg_up * rest } else { 0.0 };
                        flags[2] = rest > 0.0 && candidate > target;
                        flags[1] = rest <= 0.0;
                    }
                }
                if candidate <= target {
                    candidate = target;
                }
            }
        }
        let within = |value: f64| low <= value && value <= high;
        match mode {
            "restart" => {
                s.disarmed = false;
                if i.en_default_out_value && limits_valid && !within(candidate) {
                    candidate = if candidate > high { high } else { low };
                }
            }
            "manual" => s.disarmed = true,
            "disabled" => {}
            _ => {
                // The range is reached by where the output was, by where it is to go, or in between.
                let across = (s.y < low && candidate > high) || (s.y > high && candidate < low);
                if within(s.y) || within(candidate) || across {
                    s.disarmed = false;
                }
                flags[4] = candidate >= high;
                flags[5] = candidate <= low;
                let target_beyond = (candidate == high && i.auto_value > high)
                    || (candidate == low && i.auto_value < low);
                let cut = !s.disarmed && !within(candidate);
                if cut || target_beyond {
                    flags[..4].fill(false);
                }
                if cut {
                    candidate = if candidate > high { high } else { low };
                }
            }
        }
        s.y = candidate;
    }
    let mut outputs = vec![s.y];
    outputs.extend(flags.map(truth));
    outputs.extend([truth(status >= 0x8000), f64::from(status), f64::from(subfunction)]);
    outputs
}

/// ScaleLinear; `held` is the last output.
fn scale(held: &mut f64, i: &scale_linear::Inputs) -> Vec<f64> {
    let mut status = 0;
    let mut overflows = false;
    let mut y = if i.x1 == i.x2 || i.x == i.x1 {
        i.y1
    } else if i.x == i.x2 {
        i.y2
    } else {
        let differences = [i.x2 - i.x1, i.y2 - i.y1, i.x - i.x1];
        overflows = differences.iter().any(|difference| !difference.is_finite());
        let m = (i.y2 - i.y1) / (i.x2 - i.x1);
        m * (i.x - i.x1) + i.y1
    };
    if y < i.y_min {
        (y, status) = (i.y_min, 0x6001);
    } else if y > i.y_max {
        (y, status) = (i.y_max, 0x6002);
    }
    let signals_finite = [i.x, i.x1, i.y1, i.x2, i.y2].iter().all(|signal| signal.is_finite());
    let limits_nan = i.y_min.is_nan() || i.y_max.is_nan();
    if !signals_finite || overflows || limits_nan || !y.is_finite() {
        status = 0x8F00;
    }
    if i.y_min > i.y_max {
        status = 0x8200;
    }
    if status < 0x8000 {
        *held = y;
    }
    vec![*held, truth(status >= 0x8000), f64::from(status)]
}

/// SawTooth; `taken` is what was taken over, and in which cycle.
fn saw(
    taken: &mut Option<(u64, saw_tooth::Inputs)>,
    i: &saw_tooth::Inputs,
    index: u64,
    period_ns: u64,
) -> Vec<f64> {
    if taken.is_none() || i.reset {
        *taken = Some((index, *i));
    }
    let (origin, i) = taken.unwrap();
    let cycles = i128::from(index) - i128::from(origin);
    let mut k = match i.time_range {
        ..=0 => cycles,
        ms => cycles * i128::from(period_ns) / (i128::from(ms) * 1_000_000),
    };
    if !i.endless_steps {
        k %= i128::from(i.number_steps.max(0)) + 1;
    }
    let value = i128::from(i.start_value) + k * i128::from(i.increment_range);
    let wrapped = (value + 32_768).rem_euclid(65_536) - 32_768;
    vec![wrapped as f64]
}

/// The outputs' slots.
fn slots<O: Slots>(outputs: O) -> Vec<f64> {
    let mut slots = vec![f64::NAN; O::LEN];
    outputs.write(&mut slots);
    slots
}

fn bits(slots: &[f64]) -> Vec<u64> {
    slots.iter().map(|slot| slot.to_bits()).collect()
}

macro_rules! same {
    ($actual:expr, $expected:expr, $inputs:expr) => {{
        let (actual, expected) = ($actual, $expected);
        prop_assert_eq!(
            bits(&actual),
            bits(&expected),
            "{:?} not {:?}: {:?}",
            actual,
            expected,
            $inputs
        )
    }};
}

proptest! {
    #[test]
    fn lim_rate_of_change_does_what_the_specification_says(
        sequence in arbitrary::sequence(arbitrary::ramp()),
        period_ns in arbitrary::period_ns(),
    ) {
        let (mut state, mut y) = (lim_rate_of_change::State::default(), 0.0);
        for (index, inputs) in sequence.iter().enumerate() {
            let cycle = Cycle::new(index as u64, period_ns, OBS);
            let outputs = lim_rate_of_change::LimRateOfChangeCI::step(&mut state, inputs, &cycle);
            same!(slots(outputs), ramp(&mut y, inputs, period_ns), inputs);
        }
    }

    #[test]
    fn lim_rate_of_change_advanced_does_what_the_specification_says(
        sequence in arbitrary::sequence(arbitrary::advanced()),
        period_ns in arbitrary::period_ns(),
    ) {
        let mut state = lim_rate_of_change_advanced::State::default();
        let mut reference = Advanced::default();
        for (index, inputs) in sequence.iter().enumerate() {
            let cycle = Cycle::new(index as u64, period_ns, OBS);
            let outputs =
                lim_rate_of_change_advanced::LimRateOfChangeAdvancedCI::step(&mut state, inputs, &cycle);
            same!(slots(outputs), advanced(&mut reference, inputs, period_ns), inputs);
        }
    }

    #[test]
    fn scale_linear_does_what_the_specification_says(
        sequence in prop::collection::vec(arbitrary::scale(), 1..100),
    ) {
        let (mut state, mut held) = (scale_linear::State::default(), 0.0);
        for inputs in &sequence {
            let cycle = Cycle::new(0, 1_000_000, &[]);
            let outputs = scale_linear::ScaleLinear::step(&mut state, inputs, &cycle);
            same!(slots(outputs), scale(&mut held, inputs), inputs);
        }
    }

    #[test]
    fn saw_tooth_does_what_the_specification_says_in_every_cycle_of_2_to_the_64(
        sequence in arbitrary::sequence(arbitrary::saw()),
        period_ns in arbitrary::period_ns(),
        first in prop_oneof![Just(0u64), 0u64..=1 << 40, any::<u64>()],
        skipped in prop::collection::vec(
            prop_oneof![5 => Just(0u64), 3 => 0u64..50, 1 => 0u64..1 << 42, 1 => any::<u64>()], 300),
    ) {
        let (mut state, mut taken) = (saw_tooth::State::default(), None);
        let mut index = first;
        for (inputs, skipped) in sequence.iter().zip(skipped) {
            let outputs =
                saw_tooth::SawTooth::step(&mut state, inputs, &Cycle::new(index, period_ns, OBS));
            same!(slots(outputs), saw(&mut taken, inputs, index, period_ns), (inputs, index));
            let Some(next) = index.checked_add(1 + (skipped >> 1)) else { break };
            index = next;
        }
    }
}

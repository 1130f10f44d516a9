//! ScaleLinear: the straight line through two points, within limits.

use crate::{Block, Cycle, Decision, status};

crate::block! {
    /// Scales a signal along the straight line through (`x1`, `y1`) and (`x2`, `y2`), within limits.
    pub ScaleLinear {
        follows { "LGF_ScaleLinear, Siemens Library of General Functions (LGF)" }
        inputs {
            /// Signal to scale.
            "x" => x: f64,
            /// First point, abscissa.
            "x1" => x1: f64,
            /// First point, ordinate.
            "y1" => y1: f64,
            /// Second point, abscissa.
            "x2" => x2: f64,
            /// Second point, ordinate.
            "y2" => y2: f64,
            /// Low limit of the output.
            "yMin" => y_min: f64,
            /// High limit of the output.
            "yMax" => y_max: f64,
        }
        outputs {
            /// Scaled signal; `y1` if `x1` equals `x2`.
            #[alias = "Ret_Val"]
            "y" => y: f64,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
        }
        state { y: f64 }
        computes {
            "`y = (y2 - y1) / (x2 - x1) * (x - x1) + y1`, or `y1` if `x1` equals `x2`.",
            "At the two points it is exact: `x1` gives `y1`, and `x2` gives `y2`.",
            "The result is limited to `yMin` and `yMax`.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::LIMITED_LOW => "WARN_Y_LIMITED_TO_YMIN": "y is limited to yMin",
            status::LIMITED_HIGH => "WARN_Y_LIMITED_TO_YMAX": "y is limited to yMax",
            status::RANGE => "ERR_LOW_LIM_OVER_UP_LIM": "yMin is greater than yMax; y holds",
            status::NOT_FINITE => "ERR_NOT_FINITE" (ours):
                "an input, a difference of inputs, or y itself, is NaN or infinite; y holds",
        }
        decisions {
            Decision {
                silent_on: "the order of the operations",
                chosen: "the slope first, multiplied by the distance, plus `y1`; each result is rounded to LREAL",
            },
            Decision {
                silent_on: "rounding at the two points",
                chosen: "none: `x` equal to `x1` gives `y1`, equal to `x2` `y2`, so full scale with \
                         `yMax` equal to `y2` is not reported as limited",
            },
            Decision {
                silent_on: "`x1` equal to `x2`",
                chosen: "`y1` is limited to `yMin` and `yMax` like any other value",
            },
            Decision {
                silent_on: "`y` during an error",
                chosen: "it holds its last valid value, initially 0.0",
            },
            Decision {
                silent_on: "NaN and infinity",
                chosen: "16#8F00 for an `x`, `x1`, `y1`, `x2` or `y2` that is not finite, a limit that \
                         is NaN and a `y` that no limit keeps finite; an infinite limit means no \
                         limit",
            },
            Decision {
                silent_on: "points or signals too far apart for LREAL",
                chosen: "16#8F00 if `x2 - x1`, `y2 - y1` or `x - x1` overflows; at the two points \
                         themselves, and with `x1` equal to `x2`, no difference is needed",
            },
            Decision {
                silent_on: "several errors at once",
                chosen: "`status` shows 16#8200 before 16#8F00",
            },
        }
    }
}

impl Block for ScaleLinear {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        let status = match scale(inputs) {
            Ok((y, status)) => {
                state.y = y;
                status
            }
            Err(status) => status,
        };
        Outputs { y: state.y, error: status::is_error(status), status }
    }

    /// A sample of an analogue input as a level in m.
    fn typical() -> Inputs {
        Inputs { x: 13_824.0, x1: 0.0, y1: 0.0, x2: 27_648.0, y2: 1.7, y_min: 0.0, y_max: 1.7 }
    }
}

#[inline]
fn scale(&Inputs { x, x1, y1, x2, y2, y_min, y_max }: &Inputs) -> Result<(f64, u16), u16> {
    if y_min > y_max {
        return Err(status::RANGE);
    }
    if y_min.is_nan() || y_max.is_nan() {
        return Err(status::NOT_FINITE);
    }
    let (is_finite, y) = if x1 == x2 || x == x1 || x == x2 {
        let y = if x1 == x2 || x == x1 { y1 } else { y2 };
        (all_finite([x, x1, y1, x2, y2]), y)
    } else {
        let (dx, dy, distance) = (x2 - x1, y2 - y1, x - x1);
        // A difference is finite only between finite numbers.
        (all_finite([dx, dy, distance]), dy / dx * distance + y1)
    };
    if !is_finite {
        return Err(status::NOT_FINITE);
    }
    let (y, status) = if y < y_min {
        (y_min, status::LIMITED_LOW)
    } else if y > y_max {
        (y_max, status::LIMITED_HIGH)
    } else {
        (y, status::OK)
    };
    if y.is_finite() { Ok((y, status)) } else { Err(status::NOT_FINITE) }
}

#[inline]
fn all_finite<const N: usize>(values: [f64; N]) -> bool {
    // The sum of finite numbers may overflow, but a NaN or an infinity times zero is NaN.
    values.into_iter().map(|value| value * 0.0).sum::<f64>() == 0.0
}

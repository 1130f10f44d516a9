//! NonLinearInterpolation: a characteristic curve.

use crate::{Block, Cycle, Decision, status};

/// Most points of a curve.
const POINTS: usize = 12;

crate::block! {
    /// Puts a signal through a characteristic curve of 2 to 12 points, with straight lines between them.
    pub NonLinearInterpolation {
        follows { "LGF_NonLinearInterpolation, Siemens Library of General Functions (LGF)" }
        inputs {
            /// Signal to put through the curve.
            "value" => value: f64 = 0.0,
            /// Value to preset the output with.
            "defaultOutValue" => default_out_value: f64 = 0.0,
            /// Preset the output with `defaultOutValue`.
            "enDefaultOutValue" => en_default_out_value: bool = false,
            /// Pass `value` on without the curve.
            "track" => track: bool = false,
            /// Set the output to 0.0.
            "reset" => reset: bool = false,
            /// Number of points of the curve, 2 to 12: the first ones of those below.
            "numberOfPoints" => number_of_points: i16 = 0,
            /// Point 1, abscissa.
            "x1" => x1: f64 = 0.0,
            /// Point 1, ordinate.
            "y1" => y1: f64 = 0.0,
            /// Point 2, abscissa.
            "x2" => x2: f64 = 0.0,
            /// Point 2, ordinate.
            "y2" => y2: f64 = 0.0,
            /// Point 3, abscissa.
            "x3" => x3: f64 = 0.0,
            /// Point 3, ordinate.
            "y3" => y3: f64 = 0.0,
            /// Point 4, abscissa.
            "x4" => x4: f64 = 0.0,
            /// Point 4, ordinate.
            "y4" => y4: f64 = 0.0,
            /// Point 5, abscissa.
            "x5" => x5: f64 = 0.0,
            /// Point 5, ordinate.
            "y5" => y5: f64 = 0.0,
            /// Point 6, abscissa.
            "x6" => x6: f64 = 0.0,
            /// Point 6, ordinate.
            "y6" => y6: f64 = 0.0,
            /// Point 7, abscissa.
            "x7" => x7: f64 = 0.0,
            /// Point 7, ordinate.
            "y7" => y7: f64 = 0.0,
            /// Point 8, abscissa.
            "x8" => x8: f64 = 0.0,
            /// Point 8, ordinate.
            "y8" => y8: f64 = 0.0,
            /// Point 9, abscissa.
            "x9" => x9: f64 = 0.0,
            /// Point 9, ordinate.
            "y9" => y9: f64 = 0.0,
            /// Point 10, abscissa.
            "x10" => x10: f64 = 0.0,
            /// Point 10, ordinate.
            "y10" => y10: f64 = 0.0,
            /// Point 11, abscissa.
            "x11" => x11: f64 = 0.0,
            /// Point 11, ordinate.
            "y11" => y11: f64 = 0.0,
            /// Point 12, abscissa.
            "x12" => x12: f64 = 0.0,
            /// Point 12, ordinate.
            "y12" => y12: f64 = 0.0,
        }
        outputs {
            /// Signal behind the curve.
            "outputValue" => output_value: f64,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
        }
        state { y: f64 }
        computes {
            "The first mode in this list whose condition holds is active:",
            "Reset (`reset`): 0.0.",
            "Preset (`enDefaultOutValue`): `defaultOutValue`.",
            "Tracking (`track`): `value`.",
            "Curve: between two neighbouring points, `(yb - ya) / (xb - xa) * (value - xa) + ya`; at a point, exactly its `y`; below the first and above the last point, the `y` of that point.",
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR" (ours): "no error",
            status::LIMITED_LOW => "WARN_VALUE_BELOW_CURVE" (ours): "value is below the first point, whose y is the output",
            status::LIMITED_HIGH => "WARN_VALUE_ABOVE_CURVE" (ours): "value is above the last point, whose y is the output",
            status::RANGE => "ERR_POINTS" (ours):
                "numberOfPoints is not from 2 to 12, or an x is not greater than that of the point before",
            status::NOT_FINITE => "ERR_NOT_FINITE" (ours):
                "a point of the curve, or the active mode's signal, is NaN or infinite, or points are too far apart for LREAL",
        }
        decisions {
            Decision {
                silent_on: "points without an array",
                chosen: "`numberOfPoints` and the inputs `x1`, `y1` to `x12`, `y12` (LGF: `setpoints`, an array of pairs \
                         `inputValue`, `outputValue`); those behind `numberOfPoints` are not looked at",
            },
            Decision {
                silent_on: "errors",
                chosen: "`error` and `status`, which LGF's block does not have",
            },
            Decision {
                silent_on: "a change of points while the block runs",
                chosen: "it acts at once; `reset` is not needed",
            },
            Decision {
                silent_on: "a `value` outside the curve",
                chosen: "the `y` of the nearest point, with a warning; nothing is extrapolated",
            },
            Decision {
                silent_on: "several modes at once",
                chosen: "`reset` before `enDefaultOutValue` before `track`",
            },
            Decision {
                silent_on: "the output during an error",
                chosen: "it holds in curve mode; the points are checked and reported in every mode, and the other modes \
                         do not need them",
            },
            Decision {
                silent_on: "NaN and infinity",
                chosen: "16#8F00 for a point of the curve in every mode, and for a signal in the mode that uses it",
            },
            Decision {
                silent_on: "several errors at once",
                chosen: "`status` shows 16#8200 before 16#8F00",
            },
        }
    }
}

impl Block for NonLinearInterpolation {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        let points = inputs.points();
        let curve = Curve::new(&points, inputs);
        let (y, status) = if inputs.reset {
            (0.0, curve.status)
        } else if inputs.en_default_out_value {
            (inputs.default_out_value, curve.status)
        } else if inputs.track {
            (inputs.value, curve.status)
        } else {
            curve.at(inputs.value)
        };
        let status = if y.is_finite() {
            state.y = y;
            status
        } else if status::is_error(status) {
            status
        } else {
            status::NOT_FINITE
        };
        Outputs { output_value: state.y, error: status::is_error(status), status }
    }

    /// The volume in m3 of a lying tank by its level in m.
    fn typical() -> Inputs {
        Inputs {
            value: 0.7,
            number_of_points: 5,
            x1: 0.0,
            y1: 0.0,
            x2: 0.5,
            y2: 0.98,
            x3: 1.0,
            y3: 2.5,
            x4: 1.5,
            y4: 4.02,
            x5: 2.0,
            y5: 5.0,
            ..Inputs::default()
        }
    }
}

type Points = [[f64; 2]; POINTS];

impl Inputs {
    #[inline]
    fn points(&self) -> Points {
        let i = self;
        [
            [i.x1, i.y1],
            [i.x2, i.y2],
            [i.x3, i.y3],
            [i.x4, i.y4],
            [i.x5, i.y5],
            [i.x6, i.y6],
            [i.x7, i.y7],
            [i.x8, i.y8],
            [i.x9, i.y9],
            [i.x10, i.y10],
            [i.x11, i.y11],
            [i.x12, i.y12],
        ]
    }
}

/// The points of a curve, and what is wrong with them.
struct Curve<'a> {
    points: &'a Points,
    count: usize,
    /// Points at or below the signal.
    below: usize,
    status: u16,
}

impl<'a> Curve<'a> {
    /// All in one pass, as it is what a call costs.
    #[inline]
    fn new(points: &'a Points, inputs: &Inputs) -> Self {
        let count = usize::from(inputs.number_of_points.max(0).unsigned_abs());
        let (mut before, mut is_falling, mut zero, mut below) = (f64::NAN, false, 0.0, 0);
        for [x, y] in points.iter().take(count) {
            is_falling |= before >= *x;
            // NaN, if one of them is not finite.
            zero += 0.0 * x + 0.0 * y;
            below += usize::from(*x <= inputs.value);
            before = *x;
        }
        let status = if !(2..=POINTS).contains(&count) || is_falling {
            status::RANGE
        } else if zero == 0.0 {
            status::OK
        } else {
            status::NOT_FINITE
        };
        Self { points, count, below, status }
    }

    /// The curve at the signal, and the status; NaN where the output holds.
    #[inline]
    fn at(&self, value: f64) -> (f64, u16) {
        if self.status != status::OK {
            return (f64::NAN, self.status);
        }
        if !value.is_finite() {
            return (f64::NAN, status::NOT_FINITE);
        }
        let point = |at: usize| self.points.get(at).copied().unwrap_or([f64::NAN; 2]);
        let Some(before) = self.below.checked_sub(1) else {
            return (point(0)[1], status::LIMITED_LOW);
        };
        let [x_before, y_before] = point(before);
        if value == x_before {
            return (y_before, status::OK);
        }
        if self.below == self.count {
            return (y_before, status::LIMITED_HIGH);
        }
        let [x, y] = point(self.below);
        let slope = (y - y_before) / (x - x_before);
        (slope * (value - x_before) + y_before, status::OK)
    }
}

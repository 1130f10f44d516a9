//! Decisions that several blocks share: none of their LGF documents specifies these points.

use crate::Decision;

pub(crate) const FIRST_CALL: Decision = Decision {
    silent_on: "the first call",
    chosen: "the output starts at 0.0, and the first call moves it by one step",
};

pub(crate) const SAMPLE_TIME: Decision = Decision {
    silent_on: "which period counts",
    chosen: "the configured period of the task at `callOB`, never a measured one; without `callOB`, \
             that of the task that runs the block",
};

pub(crate) const SKIPPED_CYCLES: Decision = Decision {
    silent_on: "cycles skipped after an overrun",
    chosen: "not counted: the output moves by one step per call",
};

pub(crate) const OB_NUMBERS: Decision = Decision {
    silent_on: "valid numbers for `callOB`",
    chosen: "30 to 38 and 123 to 32767; if no task has that number, `status` is 16#8601 and \
             `subfunctionStatus` 0. Any other number gives 16#8600 and `subfunctionStatus` 16#8090",
};

pub(crate) const HOLD: Decision = Decision {
    silent_on: "the output during an error",
    chosen: "rates, limits and `callOB` are checked in every call and reported in every mode, but \
             the output holds its last value only if the active mode needs the invalid value; \
             signal outputs are FALSE while it holds",
};

pub(crate) const NOT_FINITE: Decision = Decision {
    silent_on: "NaN and infinity",
    chosen: "`status` is 16#8F00 if a signal used by the active mode is not finite, or if a rate or \
             limit is NaN; `inf` as a rate or high limit and `-inf` as a low limit are valid and \
             mean no limit",
};

/// Of a block with a time.
pub(crate) const SEVERAL_ERRORS_WITH_TIME: Decision = Decision {
    silent_on: "several errors at once",
    chosen: "`status` shows the first of 16#8601 or 16#8600, 16#8203, 16#8F00",
};

pub(crate) const SEVERAL_ERRORS: Decision = Decision {
    silent_on: "several errors at once",
    chosen: "`status` shows the first of 16#8601 or 16#8600, 16#8200, 16#8202, 16#8F00",
};

//! Decisions that several blocks share: LGF's documents are silent alike.

use crate::Decision;

pub(crate) const FIRST_CALL: Decision = Decision {
    silent_on: "the first call",
    chosen: "the output starts at 0.0, and the first call moves it by one step",
};

pub(crate) const SAMPLE_TIME: Decision = Decision {
    silent_on: "which period counts",
    chosen: "the configured period of the task at `callOB`, never a measured one; `callOB` left out \
             stands for the task that runs the block",
};

pub(crate) const SKIPPED_CYCLES: Decision = Decision {
    silent_on: "cycles that an overrun skipped",
    chosen: "they do not count: the output moves by one step per call",
};

pub(crate) const OB_NUMBERS: Decision = Decision {
    silent_on: "which numbers `callOB` takes",
    chosen: "30 to 38 and 123 to 32767; without a task of that number `status` is 16#8601 and \
             `subfunctionStatus` 0. Any other number gives 16#8600 and `subfunctionStatus` 16#8090",
};

pub(crate) const HOLD: Decision = Decision {
    silent_on: "the output while there is an error",
    chosen: "rates, limits and `callOB` are checked in every call and reported in every mode, but \
             the output holds its last value only where the active mode needs what is invalid; \
             signal outputs are FALSE while it holds",
};

pub(crate) const NOT_FINITE: Decision = Decision {
    silent_on: "NaN and infinity",
    chosen: "a signal that the active mode uses must be finite and a rate or limit must not be NaN, \
             or `status` is 16#8F00; `inf` is a legal rate or high limit and `-inf` a legal low \
             limit: no limit",
};

pub(crate) const SEVERAL_ERRORS: Decision = Decision {
    silent_on: "several errors at once",
    chosen: "`status` shows the first of 16#8601 or 16#8600, 16#8200, 16#8202, 16#8F00",
};

//! A moving average, for the array in its state: it is kept, recorded and repeated like any other field.

use isochrone::blocks::{Block, Cycle, status};

/// Values of the window.
const WINDOW: usize = 16;

isochrone::blocks::block! {
    /// Mean of the last 16 values of a signal; in the first 15 cycles, of those that there are.
    pub(crate) MovingAverage {
        inputs {
            /// Signal to smooth. Without a default, so it must be connected.
            "x" => x: f64,
        }
        outputs {
            /// The mean.
            "y" => y: f64,
            /// An error is reported in `status`.
            "error" => error: bool,
            /// Status word.
            "status" => status: u16,
        }
        state {
            /// The values, the oldest at `oldest` once all are there.
            window: [f64; WINDOW],
            oldest: u16,
            count: u16,
            y: f64,
        }
        status {
            status::OK => "STATUS_FINISHED_NO_ERROR": "no error",
            status::NOT_FINITE => "ERR_NOT_FINITE": "x, which is left out then, or the mean is NaN or infinite; y holds",
        }
    }
}

impl Block for MovingAverage {
    fn step(state: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
        let status = if state.take_in(inputs.x) { status::OK } else { status::NOT_FINITE };
        Outputs { y: state.y, error: status::is_error(status), status }
    }

    fn typical() -> Inputs {
        Inputs { x: 20.0 }
    }
}

impl State {
    /// Takes in a value. Whether there is a mean; if not, `y` stays.
    fn take_in(&mut self, x: f64) -> bool {
        if !x.is_finite() {
            return false;
        }
        if let Some(oldest) = self.window.get_mut(usize::from(self.oldest)) {
            *oldest = x;
        }
        self.oldest = (self.oldest + 1) % WINDOW as u16;
        self.count = (self.count + 1).min(WINDOW as u16);
        // Summed anew in every cycle, so no rounding stays. Values that are not there yet are zero.
        let y = self.window.iter().sum::<f64>() / f64::from(self.count);
        if y.is_finite() {
            self.y = y;
        }
        y.is_finite()
    }
}

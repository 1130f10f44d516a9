//! How a scope of a running node ends.

use isochrone_control::ClientError;

use super::super::args::Mode;
use super::super::display::Display;
use super::super::probes::not_fired;
use super::waiting::{End, Scope};
use crate::failure::Failure;
use crate::operate::{Purpose, failure};

impl Scope<'_> {
    /// Shows what was captured in part, and says how it ended.
    pub(super) fn finish(mut self, end: End, node: &str) -> Result<(), Failure> {
        // Leaving the screen is not a failure.
        let is_left = self.is_on_screen() && matches!(end, End::Stopped);
        let is_partial = self.capture.is_triggered() && !is_left && !matches!(end, End::Done);
        if is_partial {
            self.take_shot()?;
        }
        let Self { args, capture, captured, probes, display, shown, .. } = self;
        let is_on_screen = matches!(display, Display::Live(_));
        // The terminal is restored before anything is printed.
        drop((display, probes));
        if is_on_screen && let Some(last) = shown.filter(|_| !matches!(end, End::Done)) {
            Display::Printed.show(&last)?;
        }
        match end {
            End::Done => Ok(()),
            End::Stopped if captured > 0 || args.mode() == Mode::Auto => Ok(()),
            End::Stopped => Err(Failure::inconclusive(match &args.trigger {
                Some(trigger) => {
                    format!("ended before the trigger came: {}", not_fired(trigger, &capture))
                }
                None => "ended before anything was captured".to_owned(),
            })),
            End::Timeout => {
                let seconds = args.timeout.unwrap_or_default();
                let trigger = args.trigger.as_ref();
                let why = trigger.map(|trigger| not_fired(trigger, &capture)).unwrap_or_default();
                Err(Failure::inconclusive(format!(
                    "the trigger did not come within {seconds} s: {why}"
                )))
            }
            End::Gone(cause) => {
                let why = match cause {
                    ClientError::Ended { .. } if captured == 0 && args.trigger.is_some() => {
                        Failure::nobody(format!("node \"{node}\" ended before the trigger came"))
                    }
                    ClientError::Ended { .. } if is_partial => {
                        Failure::found(format!("node \"{node}\" ended within the shot"))
                    }
                    cause => failure(cause, Purpose::Look),
                };
                Err(why)
            }
        }
    }
}

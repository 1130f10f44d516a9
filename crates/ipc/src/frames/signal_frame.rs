//! A frame whose values are read by their names.

use std::fmt;

use crate::frames::layout_source::LayoutSource;
use crate::{
    Announcement, Credible, Flags, FrameHeader, SenderClock, Service, SignalError, Stamps,
};

/// A frame that a [`SignalReader`](crate::SignalReader) received, until the reader is asked for the next one.
pub struct SignalFrame<'a, S: Service> {
    pub(crate) receipt: Receipt,
    pub(crate) channels: &'a [f64],
    pub(crate) origin: Origin<'a>,
    pub(crate) places: &'a Result<Vec<usize>, SignalError>,
    pub(crate) layouts: &'a LayoutSource<'a, S>,
}

/// What a frame's sender stamped, and how it came. All times are in nanoseconds of `CLOCK_MONOTONIC`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Receipt {
    /// What the sender stamped.
    pub header: FrameHeader,
    /// When the reader took the frame.
    pub received_ns: u64,
    /// How long the frame may have lain there: the time since the reader last looked and found none.
    pub waited_ns: u64,
    /// Frames that were lost between the one received before and this one.
    pub lost: u64,
    /// How often the publisher restarted or was replaced between the frame received before and this one.
    pub restarts: u64,
    /// Whether the stamps are used.
    pub stamps: Stamps,
}

/// What tells frames with different channels apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct LayoutKey {
    /// The [`FrameHeader::layout`].
    pub number: u64,
    /// Whether that layout is announced.
    pub is_announced: bool,
    /// Values of a frame.
    pub channels: usize,
}

impl<'a, S: Service> SignalFrame<'a, S> {
    /// The wanted signals and their values, in the order in which the reader was given the names; all signals
    /// of the frame if it was given none.
    ///
    /// # Errors
    /// The frame has no names, or one of the wanted signals is missing.
    pub fn values(&self) -> Result<impl Iterator<Item = (&'a str, f64)> + 'a, SignalError> {
        let places = self.places.as_ref().map_err(Clone::clone)?;
        let (announced, channels) = (self.announced(), self.channels);
        let signals = announced.map(|announced| &announced.layout.signals);
        Ok(places.iter().filter_map(move |place| {
            Some((signals?.get(*place)?.name.as_str(), *channels.get(*place)?))
        }))
    }

    /// The value of a signal of the frame, whether or not the reader was given its name. Searches all names of the
    /// frame.
    ///
    /// # Errors
    /// The frame has no names, or no such signal.
    pub fn value(&self, name: &str) -> Result<f64, SignalError> {
        let place = self.origin.place(name)?;
        self.origin.check(place).map(|()| self.channels[place])
    }

    /// All values of the frame, in their order.
    pub fn channels(&self) -> &'a [f64] {
        self.channels
    }

    /// What the values are worth.
    pub fn flags(&self) -> Flags {
        self.receipt.header.flags()
    }

    /// The number of the frame: 0, 1, 2, … of one publisher.
    pub fn sequence(&self) -> u64 {
        self.receipt.header.sequence
    }

    /// What the sender stamped.
    pub fn header(&self) -> &FrameHeader {
        &self.receipt.header
    }

    /// How old the frame was when it was received, in ns; `None` if it was stamped by another clock.
    pub fn age_ns(&self) -> Option<u64> {
        self.receipt.age_ns()
    }

    /// Frames that were lost between the one received before and this one.
    pub fn lost(&self) -> u64 {
        self.receipt.lost
    }

    /// How the frame came.
    pub fn receipt(&self) -> Receipt {
        self.receipt
    }

    /// What is announced of the frame: its signals, their types and units, the publisher. `None` if nobody announces
    /// it, or the announcement did not come in time.
    pub fn announced(&self) -> Option<&'a Announcement> {
        self.origin.announced
    }

    /// What tells the frame from those with other channels.
    pub fn layout(&self) -> LayoutKey {
        LayoutKey::new(&self.receipt.header, self.announced(), self.channels.len())
    }

    /// What keeps the reader from hearing what is announced of the frame, and the way out, if something does.
    pub fn obstacle(&self) -> Option<String> {
        let is_unheard = self.receipt.header.layout != 0 && self.announced().is_none();
        is_unheard.then(|| self.layouts.obstacle())?
    }
}

impl<S: Service> fmt::Debug for SignalFrame<'_, S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SignalFrame")
            .field("service", &self.origin.service)
            .field("receipt", &self.receipt)
            .field("channels", &self.channels)
            .field("announced", &self.origin.announced)
            .finish_non_exhaustive()
    }
}

impl Receipt {
    /// The frame's times, as far as they are used.
    pub fn credible(&self) -> Credible {
        let clock = match self.stamps {
            Stamps::Foreign => SenderClock::Foreign,
            Stamps::Believed | Stamps::Future => SenderClock::Shared,
        };
        self.header.credible(clock, self.received_ns)
    }

    /// How old the frame was when it was received, in ns; `None` if it was stamped by another clock.
    pub fn age_ns(&self) -> Option<u64> {
        match self.stamps {
            Stamps::Believed => Some(self.received_ns.saturating_sub(self.header.publish_ns)),
            Stamps::Future | Stamps::Foreign => None,
        }
    }

    /// When the frame's cycle was due on the reader's clock, or the nearest to it that is known: when the frame was sent
    /// or received.
    pub fn due_ns(&self) -> u64 {
        let FrameHeader { release_ns, publish_ns, .. } = self.header;
        match self.stamps {
            Stamps::Believed if (1..=publish_ns).contains(&release_ns) => release_ns,
            Stamps::Believed => publish_ns,
            Stamps::Future | Stamps::Foreign => self.received_ns,
        }
    }
}

impl LayoutKey {
    pub(crate) fn new(
        header: &FrameHeader,
        announced: Option<&Announcement>,
        channels: usize,
    ) -> Self {
        Self { number: header.layout, is_announced: announced.is_some(), channels }
    }
}

/// Whose a frame is, and what is announced of it.
#[derive(Clone, Copy)]
pub(crate) struct Origin<'a> {
    pub(crate) service: &'a str,
    pub(crate) announced: Option<&'a Announcement>,
    /// Values of the frame.
    pub(crate) channels: usize,
}

impl<'a> Origin<'a> {
    /// Where signals stand in the frame; all of them if no name is given.
    pub(crate) fn places(self, names: &[String]) -> Result<Vec<usize>, SignalError> {
        let announced = self.announced()?;
        let all = 0..announced.layout.signals.len();
        let places: Vec<usize> = if names.is_empty() {
            all.collect()
        } else {
            names.iter().map(|name| self.place(name)).collect::<Result<_, _>>()?
        };
        places.iter().max().map_or(Ok(()), |last| self.check(*last)).map(|()| places)
    }

    fn announced(self) -> Result<&'a Announcement, SignalError> {
        let service = || self.service.to_owned();
        let unnamed = || SignalError::Unnamed { service: service(), channels: self.channels };
        self.announced.ok_or_else(unnamed)
    }

    fn place(self, name: &str) -> Result<usize, SignalError> {
        let Announcement { publisher, layout, .. } = self.announced()?;
        let found = layout.signals.iter().position(|signal| signal.name == name);
        found.ok_or_else(|| SignalError::Missing {
            service: self.service.to_owned(),
            publisher: publisher.clone(),
            name: name.to_owned(),
            available: layout.first_names(),
        })
    }

    /// Whether the frame is long enough to have a value at a place.
    fn check(self, place: usize) -> Result<(), SignalError> {
        if place < self.channels {
            return Ok(());
        }
        Err(SignalError::TooShort {
            service: self.service.to_owned(),
            publisher: self.announced()?.publisher.clone(),
            channels: self.channels,
            needed: place + 1,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn receipt(release_ns: u64, publish_ns: u64, stamps: Stamps) -> Receipt {
        let header = FrameHeader { release_ns, publish_ns, ..FrameHeader::default() };
        Receipt { header, received_ns: 900, stamps, ..Receipt::default() }
    }

    #[test]
    fn the_time_of_a_frame_is_that_of_its_cycle_where_the_writer_says_and_is_believed() {
        assert_eq!(receipt(700, 800, Stamps::Believed).due_ns(), 700);
        assert_eq!(receipt(0, 800, Stamps::Believed).due_ns(), 800);
        assert_eq!(receipt(5000, 800, Stamps::Believed).due_ns(), 800);
        assert_eq!(receipt(700, 800, Stamps::Foreign).due_ns(), 900);
        assert_eq!(receipt(700, 99999, Stamps::Future).due_ns(), 900);
    }

    #[test]
    fn only_a_stamp_of_this_clock_says_how_old_a_frame_is() {
        assert_eq!(receipt(0, 800, Stamps::Believed).age_ns(), Some(100));
        assert_eq!(receipt(0, 800, Stamps::Foreign).age_ns(), None);
        assert_eq!(receipt(0, 99999, Stamps::Future).age_ns(), None);
    }
}

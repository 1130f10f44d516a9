//! Bodies of messages, as they are: their types are known to nobody but the bridge.

use std::convert::Infallible;

use isochrone_recording::ByteOrder;
use rustdds::RepresentationIdentifier;
use rustdds::bytes::Bytes;
use rustdds::no_key::{Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter};

/// The longest message that is taken, in bytes. Images and clouds of points are no signals.
const MOST_BYTES: usize = 1 << 20;

/// The body of a message.
pub(crate) struct Body {
    pub(crate) bytes: Vec<u8>,
    pub(crate) order: ByteOrder,
}

/// Hands bodies to DDS and takes them from it.
pub(super) struct AsTheyAre;

impl SerializerAdapter<Bytes> for AsTheyAre {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(body: &Bytes) -> Result<Bytes, Infallible> {
        Ok(body.clone())
    }
}

impl DeserializerAdapter<Body> for AsTheyAre {
    type Error = Infallible;
    type Decoded = Body;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE]
    }

    fn transform_decoded(body: Body) -> Body {
        body
    }
}

impl DefaultDecoder<Body> for AsTheyAre {
    type Decoder = Self;
    const DECODER: Self = Self;
}

impl Clone for AsTheyAre {
    fn clone(&self) -> Self {
        Self
    }
}

impl Decode<'_, Body> for AsTheyAre {
    type Error = Infallible;

    fn decode_bytes(
        self,
        bytes: &[u8],
        encoding: RepresentationIdentifier,
    ) -> Result<Body, Infallible> {
        let order = match encoding {
            RepresentationIdentifier::CDR_BE => ByteOrder::Big,
            _ => ByteOrder::Little,
        };
        // One that is too long is none of any type that is bridged.
        let bytes = bytes.get(..bytes.len().min(MOST_BYTES)).unwrap_or_default().to_vec();
        Ok(Body { bytes, order })
    }
}

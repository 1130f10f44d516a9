//! Messages of ROS 2 by their definitions, as `.msg` and `.srv` files have them.
//!
//! [`Definitions`] are the texts; a [`MessageType`] is one of them with all that stands in it. [`encode`] and [`decode`]
//! turn a [`RosValue`] into CDR and back, a [`FieldPath`] leads to one field of it, and [`MessageNumbers`] are what every
//! message of a type has as channels of a frame:
//!
//! ```
//! use isochrone_recording::ByteOrder;
//! use isochrone_recording::message::{Definitions, FieldPath, RosValue, decode, encode};
//!
//! let mut definitions = Definitions::default();
//! definitions.add("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z 0.5\n");
//! let vector = definitions.find("geometry_msgs/msg/Vector3")?;
//! let x = FieldPath::find(&vector, "x")?;
//! let mut value = RosValue::of(&vector);
//! x.set_number(&mut value, 2.0);
//! let body = encode(&vector, &value)?;
//! assert_eq!(decode(&vector, &body, ByteOrder::Little)?, value);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Whatever bytes are decoded: it never panics, and takes no more memory than some dozen times their length.

mod decode;
mod defaults;
mod definition;
mod definitions;
mod encode;
mod error;
mod numbers;
mod path;
mod primitive;
mod schema;
mod types;
mod value;

pub use decode::decode;
pub use definitions::Definitions;
pub use encode::encode;
pub use error::DefinitionError;
pub use numbers::{MessageNumbers, stamp_of, stamped_unix_ns, value_type};
pub use path::FieldPath;
pub use primitive::Primitive;
pub use types::{BaseType, Extent, FieldType, MessageField, MessageType};
pub use value::RosValue;

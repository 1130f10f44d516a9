//! CDR, the encoding of ROS 2: fields one after the other, each at a multiple of its size from where the body begins.

/// Before the body of a message: plain CDR, little-endian.
pub(crate) const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// The order of the bytes of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ByteOrder {
    /// The least significant byte first.
    Little,
    /// The most significant byte first.
    Big,
}

/// Why bytes are not the message that they should be, or values do not go into a message: the field and what is wrong
/// with it.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}{}", field_of(path), isochrone_model::escaped(problem))]
pub struct CdrError {
    path: String,
    problem: String,
}

fn field_of(path: &str) -> String {
    if path.is_empty() { String::new() } else { format!("{path}: ") }
}

isochrone_model::debug_as_display!(CdrError);

impl CdrError {
    pub(crate) fn new(problem: impl Into<String>) -> Self {
        Self { path: String::new(), problem: problem.into() }
    }

    /// The same error, of a field within this one.
    pub(crate) fn within(self, field: &str) -> Self {
        let dot = if self.path.is_empty() || self.path.starts_with('[') { "" } else { "." };
        Self { path: format!("{field}{dot}{}", self.path), ..self }
    }
}

/// Appends fields in little-endian order.
pub(crate) struct CdrWriter<'a> {
    bytes: &'a mut Vec<u8>,
    /// Where the body begins.
    begin: usize,
}

impl<'a> CdrWriter<'a> {
    /// Writes a body behind what the bytes have already.
    pub(crate) fn new(bytes: &'a mut Vec<u8>) -> Self {
        let begin = bytes.len();
        Self { bytes, begin }
    }

    /// Replaces the bytes by a message with its encapsulation.
    pub(crate) fn message(bytes: &'a mut Vec<u8>) -> Self {
        bytes.clear();
        bytes.extend_from_slice(&ENCAPSULATION);
        Self::new(bytes)
    }

    /// Writes a number of `N` bytes.
    pub(crate) fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        let length = (self.bytes.len() - self.begin).next_multiple_of(N);
        self.bytes.resize(self.begin + length, 0);
        self.bytes.extend_from_slice(&bytes);
    }

    pub(crate) fn u64(&mut self, number: u64) {
        self.number(number.to_le_bytes());
    }

    pub(crate) fn f64(&mut self, number: f64) {
        self.number(number.to_le_bytes());
    }

    /// Writes how many elements or bytes follow.
    pub(crate) fn count(&mut self, count: usize) {
        self.number(u32::try_from(count).unwrap_or(u32::MAX).to_le_bytes());
    }

    /// Writes a text and the zero behind it.
    pub(crate) fn text(&mut self, text: &str) {
        self.count(text.len() + 1);
        self.bytes.extend_from_slice(text.as_bytes());
        self.bytes.push(0);
    }
}

/// Reads fields.
pub(crate) struct CdrReader<'a> {
    body: &'a [u8],
    at: usize,
    order: ByteOrder,
}

impl<'a> CdrReader<'a> {
    /// Reads a body.
    pub(crate) fn new(body: &'a [u8], order: ByteOrder) -> Self {
        Self { body, at: 0, order }
    }

    /// Reads a message of ours; `None` if it does not begin as one.
    pub(crate) fn message(data: &'a [u8]) -> Option<Self> {
        Some(Self::new(data.strip_prefix(&ENCAPSULATION)?, ByteOrder::Little))
    }

    /// The body of a message in plain CDR, and the order of its bytes.
    pub(crate) fn plain(data: &'a [u8]) -> Result<(&'a [u8], ByteOrder), CdrError> {
        let wrong = || CdrError::new("it does not begin as plain CDR");
        let (encapsulation, body) = data.split_first_chunk::<4>().ok_or_else(wrong)?;
        match encapsulation {
            [0, 0, ..] => Ok((body, ByteOrder::Big)),
            [0, 1, ..] => Ok((body, ByteOrder::Little)),
            _ => Err(wrong()),
        }
    }

    /// What is left.
    pub(crate) fn rest(&self) -> &'a [u8] {
        self.body.get(self.at..).unwrap_or_default()
    }

    /// The next bytes, as they are.
    fn bytes(&mut self, count: usize) -> Result<&'a [u8], CdrError> {
        let left = self.rest();
        let Some(bytes) = left.get(..count) else {
            let left = left.len();
            return Err(CdrError::new(format!("it needs {count} bytes, and {left} are left")));
        };
        self.at += count;
        Ok(bytes)
    }

    /// A number of `N` bytes, in little-endian order.
    pub(crate) fn number<const N: usize>(&mut self) -> Result<[u8; N], CdrError> {
        self.at = self.at.next_multiple_of(N);
        let mut number = [0; N];
        number.copy_from_slice(self.bytes(N)?);
        if self.order == ByteOrder::Big {
            number.reverse();
        }
        Ok(number)
    }

    pub(crate) fn u64(&mut self) -> Result<u64, CdrError> {
        self.number().map(u64::from_le_bytes)
    }

    /// How many elements follow, each of which takes so many bytes at least: never more than there are bytes for.
    pub(crate) fn count(&mut self, least_bytes: usize) -> Result<usize, CdrError> {
        let count = u32::from_le_bytes(self.number()?) as usize;
        let left = self.rest().len();
        if count > left / least_bytes.max(1) {
            return Err(CdrError::new(format!(
                "{count} elements do not fit into the {left} bytes that are left"
            )));
        }
        Ok(count)
    }

    /// A text, which ends with a zero.
    pub(crate) fn text(&mut self) -> Result<&'a str, CdrError> {
        let length = self.count(1)?;
        let bytes = self.bytes(length)?;
        // Some write an empty text without its zero.
        let Some((zero, written)) = bytes.split_last() else { return Ok("") };
        if *zero != 0 {
            return Err(CdrError::new("the text does not end with a zero"));
        }
        std::str::from_utf8(written).map_err(|_| CdrError::new("the text is not UTF-8"))
    }
}

//! As much of HTTP/1.1 as the page needs, read with bounds: one request on a connection, no more than a head
//! and a short body, within a deadline.

use std::io::{self, ErrorKind, Read};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use super::response::Response;

/// The longest request line with all headers.
const MAX_HEAD: usize = 16 * 1024;
/// The longest body.
pub(super) const MAX_BODY: usize = 64 * 1024;
/// How much of a refused request is read and dropped, so that its sender reads the refusal.
const MAX_REST: usize = 1024 * 1024;
const REST_TIME: Duration = Duration::from_millis(500);

/// A request that was understood.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Request {
    pub(super) method: String,
    pub(super) path: String,
    headers: Vec<(String, String)>,
    pub(super) body: Vec<u8>,
}

impl Request {
    /// The value of a header, which a name in small letters chooses.
    pub(super) fn header(&self, name: &str) -> Option<&str> {
        let found = self.headers.iter().find(|(known, _)| known == name);
        found.map(|(_, value)| value.as_str())
    }
}

/// Reads a request; the whole of it has to come before the deadline. `None`: the other end said nothing.
pub(super) fn read(stream: &TcpStream, deadline: Instant) -> Result<Option<Request>, Response> {
    read_from(&mut Deadlined { stream, deadline })
}

/// Closes a connection so that what was answered arrives, though more was sent than was read.
pub(super) fn close(stream: &TcpStream) {
    let _ = stream.shutdown(Shutdown::Write);
    let mut rest = Deadlined { stream, deadline: Instant::now() + REST_TIME }.take(MAX_REST as u64);
    let _ = io::copy(&mut rest, &mut io::sink());
}

/// A stream whose reads fail after an instant, however slowly bytes come.
struct Deadlined<'a> {
    stream: &'a TcpStream,
    deadline: Instant,
}

impl Read for Deadlined<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let left = self.deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(ErrorKind::TimedOut.into());
        }
        self.stream.set_read_timeout(Some(left))?;
        self.stream.read(bytes)
    }
}

fn read_from(source: &mut impl Read) -> Result<Option<Request>, Response> {
    let mut bytes = Vec::new();
    let end = loop {
        match end_of_head(&bytes) {
            Some(end) if end <= MAX_HEAD => break end,
            None if bytes.len() < MAX_HEAD => {}
            _ => {
                return Err(Response::sentence(
                    431,
                    format!("a head has at most {MAX_HEAD} bytes"),
                ));
            }
        }
        match more(source, &mut bytes)? {
            0 if bytes.is_empty() => return Ok(None),
            0 => return Err(Response::sentence(400, "the request ends within its head")),
            _ => {}
        }
    };
    let mut body = bytes.split_off(end);
    let text = String::from_utf8(bytes).map_err(|_| bad("the head is no text"))?;
    let mut request = parse_head(&text)?;
    let length = body_length(&request)?;
    while body.len() < length {
        if more(source, &mut body)? == 0 {
            return Err(bad("the body is shorter than Content-Length says"));
        }
    }
    body.truncate(length);
    request.body = body;
    Ok(Some(request))
}

/// Reads what there is; how many bytes that was.
fn more(source: &mut impl Read, bytes: &mut Vec<u8>) -> Result<usize, Response> {
    let mut part = [0; 4096];
    loop {
        match source.read(&mut part) {
            Ok(count) => {
                bytes.extend_from_slice(part.get(..count).unwrap_or_default());
                return Ok(count);
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) if [ErrorKind::TimedOut, ErrorKind::WouldBlock].contains(&error.kind()) => {
                return Err(Response::sentence(408, "the request took too long to come"));
            }
            Err(error) => return Err(bad(&format!("the request could not be read: {error}"))),
        }
    }
}

fn end_of_head(bytes: &[u8]) -> Option<usize> {
    bytes.windows(4).position(|four| four == b"\r\n\r\n").map(|at| at + 4)
}

fn parse_head(text: &str) -> Result<Request, Response> {
    let mut lines = text.trim_end_matches("\r\n").split("\r\n");
    let line = lines.next().unwrap_or_default();
    let [method, target, version]: [&str; 3] = line
        .split(' ')
        .collect::<Vec<_>>()
        .try_into()
        .map_err(|_| bad("a request begins with METHOD PATH VERSION"))?;
    let is_word = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_graphic());
    if !method.bytes().all(|b| b.is_ascii_uppercase()) || !is_word(method) {
        return Err(bad("this is no method of HTTP"));
    }
    if !target.starts_with('/') || !is_word(target) {
        return Err(bad("a path begins with / and has no blanks"));
    }
    if !version.starts_with("HTTP/") {
        return Err(bad("a request begins with METHOD PATH VERSION"));
    }
    if !["HTTP/1.1", "HTTP/1.0"].contains(&version) {
        return Err(Response::sentence(505, "this server speaks HTTP/1.1"));
    }
    let headers = lines.map(header).collect::<Result<Vec<_>, _>>()?;
    for once in ["host", "content-length", "origin", "transfer-encoding"] {
        if headers.iter().filter(|(name, _)| name == once).count() > 1 {
            return Err(bad(&format!("the header {once} comes more than once")));
        }
    }
    let (method, path) = (method.to_owned(), target.to_owned());
    Ok(Request { method, path, headers, body: Vec::new() })
}

fn header(line: &str) -> Result<(String, String), Response> {
    let is_name = |c: u8| c.is_ascii_alphanumeric() || b"!#$%&'*+-.^_`|~".contains(&c);
    match line.split_once(':') {
        Some((name, value))
            if !name.is_empty()
                && name.bytes().all(is_name)
                && !value.contains(|c: char| c.is_control() && c != '\t') =>
        {
            Ok((name.to_ascii_lowercase(), value.trim().to_owned()))
        }
        _ => Err(bad("a header is NAME: VALUE")),
    }
}

/// How long the body is.
fn body_length(request: &Request) -> Result<usize, Response> {
    if request.header("transfer-encoding").is_some() {
        return Err(Response::sentence(501, "send the body whole, with Content-Length"));
    }
    let Some(text) = request.header("content-length") else { return Ok(0) };
    if text.is_empty() || !text.bytes().all(|b| b.is_ascii_digit()) {
        return Err(bad("Content-Length is no number"));
    }
    match text.parse() {
        Ok(length) if length <= MAX_BODY => Ok(length),
        _ => Err(Response::sentence(413, format!("a body has at most {MAX_BODY} bytes"))),
    }
}

fn bad(why: &str) -> Response {
    Response::sentence(400, why)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives a few bytes at a time, as a network does.
    struct Dripping<'a>(&'a [u8], usize);

    impl Read for Dripping<'_> {
        fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            let (now, later) = self.0.split_at(self.1.min(self.0.len()).min(bytes.len()));
            bytes[..now.len()].copy_from_slice(now);
            self.0 = later;
            Ok(now.len())
        }
    }

    fn of(text: &str) -> Result<Option<Request>, u16> {
        let by_steps = |step| read_from(&mut Dripping(text.as_bytes(), step));
        let whole = by_steps(usize::MAX);
        assert_eq!(whole, by_steps(1), "{text:?}");
        assert_eq!(whole, by_steps(7), "{text:?}");
        whole.map_err(|refusal| refusal.status)
    }

    #[test]
    fn a_request_is_read_however_it_comes_apart() {
        let text = "POST /set HTTP/1.1\r\nHost: localhost:1\r\nContent-Length: 3\r\n\r\nabcdef";
        let request = of(text).unwrap().unwrap();
        assert_eq!((&*request.method, &*request.path), ("POST", "/set"));
        assert_eq!(request.header("host"), Some("localhost:1"));
        assert_eq!(request.body, b"abc");
        assert_eq!(of(""), Ok(None));
    }

    #[test]
    fn what_is_no_request_is_refused_and_nothing_is_read_without_bounds() {
        let around = "GET / HTTP/1.1\r\nx: \r\n\r\n".len();
        let head =
            |bytes: usize| format!("GET / HTTP/1.1\r\nx: {}\r\n\r\n", "a".repeat(bytes - around));
        assert!(of(&head(MAX_HEAD)).is_ok_and(|request| request.is_some()));
        let endless = "a".repeat(2 * MAX_HEAD);
        let get = |headers: &str| format!("GET / HTTP/1.1\r\n{headers}\r\n\r\n");
        for (text, status) in [
            ("hello".to_owned(), 400),
            ("hello\r\n\r\n".to_owned(), 400),
            ("\u{16}\u{3}\u{1}\r\n\r\n".to_owned(), 400),
            ("GET  / HTTP/1.1\r\n\r\n".to_owned(), 400),
            ("GET http://evil/ HTTP/1.1\r\n\r\n".to_owned(), 400),
            ("get / HTTP/1.1\r\n\r\n".to_owned(), 400),
            ("GET / HTTP/2.0\r\n\r\n".to_owned(), 505),
            ("GET / FTP/1.1\r\n\r\n".to_owned(), 400),
            (get("nothing"), 400),
            (get(" folded: 1"), 400),
            (get("host : x"), 400),
            (get("host: a\r\nHost: b"), 400),
            (get("content-length: 1\r\ncontent-length: 1"), 400),
            (get("content-length: -1"), 400),
            (get("content-length: +1"), 400),
            (get("content-length: 5"), 400),
            (get("content-length: 99999999999999999999999"), 413),
            (get("content-length: 65537"), 413),
            (get("transfer-encoding: chunked"), 501),
            (head(MAX_HEAD + 1), 431),
            (endless, 431),
        ] {
            assert_eq!(of(&text), Err(status), "{:?}", text.get(..60.min(text.len())));
        }
    }
}

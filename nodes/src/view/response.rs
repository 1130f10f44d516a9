//! Answers of HTTP/1.1, with all that forbids what the page does not need.

use serde::Serialize;

/// On every answer. Scripts and styles come from this server alone and stand in files of their own; no other
/// page frames, reads or is told of this one.
const SECURITY: &str = "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; \
    img-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n\
    X-Content-Type-Options: nosniff\r\n\
    X-Frame-Options: DENY\r\n\
    Referrer-Policy: no-referrer\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\n\
    Cross-Origin-Opener-Policy: same-origin\r\n\
    Cache-Control: no-store\r\n";

/// An answer.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Response {
    pub(super) status: u16,
    kind: &'static str,
    body: Vec<u8>,
}

impl Response {
    pub(super) fn of(kind: &'static str, body: impl Into<Vec<u8>>) -> Self {
        Self { status: 200, kind, body: body.into() }
    }

    /// A response with a sentence.
    pub(super) fn sentence(status: u16, why: impl std::fmt::Display) -> Self {
        let kind = "text/plain; charset=utf-8";
        Self { status, kind, body: format!("{why}\n").into_bytes() }
    }

    /// As it goes out; without its body as the answer to `HEAD`.
    pub(super) fn bytes(&self, is_head: bool) -> Vec<u8> {
        let allow = if self.status == 405 { "Allow: GET, HEAD, POST\r\n" } else { "" };
        let length = self.body.len();
        let mut bytes = head(self.status, self.kind) + allow;
        bytes += &format!("Content-Length: {length}\r\n\r\n");
        let mut bytes = bytes.into_bytes();
        if !is_head {
            bytes.extend_from_slice(&self.body);
        }
        bytes
    }
}

/// Status line and headers, without the blank line that ends them.
pub(super) fn head(status: u16, kind: &str) -> String {
    let reason = match status {
        200 => "OK",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        409 => "Conflict",
        413 => "Content Too Large",
        415 => "Unsupported Media Type",
        431 => "Request Header Fields Too Large",
        501 => "Not Implemented",
        503 => "Service Unavailable",
        505 => "HTTP Version Not Supported",
        _ => "Error",
    };
    format!("HTTP/1.1 {status} {reason}\r\nContent-Type: {kind}\r\nConnection: close\r\n{SECURITY}")
}

/// A value that JSON has a form for.
pub(super) fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_answer_forbids_what_the_page_does_not_need() {
        let text = String::from_utf8(Response::of("text/html", "x").bytes(false)).unwrap();
        for header in ["default-src 'none'", "nosniff", "frame-ancestors 'none'", "no-store"] {
            assert!(text.contains(header), "{text}");
        }
        assert!(!text.contains("unsafe") && !text.contains("Access-Control"), "{text}");
        assert!(text.ends_with("Content-Length: 1\r\n\r\nx"), "{text}");
        let head = String::from_utf8(Response::of("text/html", "x").bytes(true)).unwrap();
        assert!(head.ends_with("Content-Length: 1\r\n\r\n"), "{head}");
    }
}

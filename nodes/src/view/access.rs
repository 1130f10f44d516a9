//! Who may ask for what: the page answers to this machine's own names alone, and takes changes only from
//! whoever holds the token.

use std::fs::File;
use std::hint::black_box;
use std::io::{self, Read};

/// Random bytes of a token: as many as nobody guesses.
const TOKEN_BYTES: usize = 24;
/// Where HTTP leaves the port out.
const HTTP_PORT: u16 = 80;

/// The rules that requests are checked against.
pub(super) struct Access {
    port: u16,
    /// The token that every change must have; `None`: the page is read-only.
    token: Option<String>,
}

impl Access {
    pub(super) fn new(port: u16, token: Option<String>) -> Self {
        Self { port, token }
    }

    /// Whether the page can change anything.
    pub(super) fn is_writable(&self) -> bool {
        self.token.is_some()
    }

    /// Whether a `Host` header names this server as this machine does. A name of the internet that was made to
    /// lead here has another.
    pub(super) fn is_host(&self, host: &str) -> bool {
        let (name, port) = match host.rsplit_once(':') {
            // The last colon of an IPv6 address without a port stands within its brackets.
            Some((name, port)) if !port.ends_with(']') => (name, Some(port)),
            _ => (host, None),
        };
        let is_port = match port {
            Some(port) => port == self.port.to_string(),
            None => self.port == HTTP_PORT,
        };
        let is_name = |own: &&str| name.eq_ignore_ascii_case(own);
        is_port && ["127.0.0.1", "localhost", "[::1]"].iter().any(is_name)
    }

    /// Whether an `Origin` header is that of a page of this server.
    pub(super) fn is_origin(&self, origin: &str) -> bool {
        origin.strip_prefix("http://").is_some_and(|host| self.is_host(host))
    }

    /// Whether this is the token, in a time that does not depend on where they differ.
    pub(super) fn is_token(&self, given: &str) -> bool {
        let Some(token) = &self.token else { return false };
        let pairs = token.bytes().zip(given.bytes());
        let difference = pairs.fold(0, |difference, (a, b)| black_box(difference | (a ^ b)));
        token.len() == given.len() && difference == 0
    }
}

/// A token of the system's randomness.
pub(super) fn token() -> io::Result<String> {
    let mut bytes = [0; TOKEN_BYTES];
    File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_names_of_this_machine_with_the_port_are_its_host() {
        let access = Access::new(8080, None);
        for host in ["127.0.0.1:8080", "localhost:8080", "LocalHost:8080", "[::1]:8080"] {
            assert!(access.is_host(host), "{host}");
            assert!(access.is_origin(&format!("http://{host}")), "{host}");
        }
        for host in [
            "",
            "evil.example:8080",
            "127.0.0.1",
            "127.0.0.1:80",
            "127.0.0.1:08080",
            "localhost.evil.example:8080",
            "127.0.0.1.evil.example:8080",
            "[::1]",
            "::1:8080",
            "localhost:8080:8080",
            "user@localhost:8080",
        ] {
            assert!(!access.is_host(host), "{host}");
            assert!(!access.is_origin(&format!("http://{host}")), "{host}");
        }
        for origin in ["null", "https://localhost:8080", "localhost:8080", "http://localhost:8080/"]
        {
            assert!(!access.is_origin(origin), "{origin}");
        }
        assert!(Access::new(80, None).is_host("localhost"), "browsers leave port 80 out");
        assert!(Access::new(80, None).is_host("[::1]"));
    }

    #[test]
    fn only_the_whole_token_is_the_token_and_without_one_nothing_is() {
        let token = token().unwrap();
        assert_eq!(token.len(), 2 * TOKEN_BYTES);
        assert_ne!(token, super::token().unwrap());
        let access = Access::new(1, Some(token.clone()));
        assert!(access.is_token(&token));
        for other in ["", &token[1..], &format!("{token}0"), &token.replace(&token[..1], "x")] {
            assert!(!access.is_token(other), "{other}");
        }
        assert!(!Access::new(1, None).is_token(""));
    }
}

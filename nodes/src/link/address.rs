//! Addresses that a link listens on and connects to.

use std::fmt;
use std::io;
use std::net::{IpAddr, Ipv6Addr, SocketAddr, ToSocketAddrs};
use std::str::FromStr;

/// zenoh's own.
const DEFAULT_PORT: u16 = 7447;

/// A host and a TCP port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct HostPort {
    host: Host,
    pub(super) port: u16,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Host {
    Address(IpAddr),
    Name(String),
}

/// An address of this machine, and a TCP port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Local(pub(super) SocketAddr);

impl HostPort {
    /// Looks its name up, which may take long.
    pub(super) fn look_up(&self) -> io::Result<()> {
        match &self.host {
            Host::Address(_) => Ok(()),
            Host::Name(name) => (name.as_str(), self.port).to_socket_addrs().map(|_| ()),
        }
    }
}

impl FromStr for HostPort {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (host, port) = split(text)?;
        if host.address().is_some_and(|address| address.is_unspecified()) {
            return Err("this is every address of a machine; name the one to connect to".into());
        }
        Ok(Self { host, port })
    }
}

impl FromStr for Local {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (host, port) = split(text)?;
        match host.address() {
            Some(address) => Ok(Self(SocketAddr::new(address, port))),
            None => {
                Err("name an IP address of this machine, such as 192.168.7.1 or 192.168.7.1:7447; \
                         `ip address` shows those it has"
                    .into())
            }
        }
    }
}

impl Host {
    fn address(&self) -> Option<IpAddr> {
        match self {
            Self::Address(address) => Some(*address),
            Self::Name(_) => None,
        }
    }
}

fn split(text: &str) -> Result<(Host, u16), String> {
    let no_address = || {
        Err("name a host, with or without a port: plant-b, 192.168.7.1:7447, [fd00::1]:7447".into())
    };
    if let Ok(address) = text.parse::<Ipv6Addr>() {
        return Ok((Host::Address(address.into()), DEFAULT_PORT));
    }
    // The colons within brackets are of the address.
    let (host, port) = match text.rsplit_once(':').filter(|_| !text.ends_with(']')) {
        Some((host, port)) => match port.parse::<u16>() {
            Ok(0) | Err(_) => return Err(format!("{port:?} is no port; ports are 1 to 65535")),
            Ok(port) => (host, port),
        },
        None => (text, DEFAULT_PORT),
    };
    if let Some(inner) = host.strip_prefix('[').and_then(|host| host.strip_suffix(']')) {
        return match inner.parse::<Ipv6Addr>() {
            Ok(address) => Ok((Host::Address(address.into()), port)),
            Err(_) => no_address(),
        };
    }
    if let Ok(address) = host.parse::<IpAddr>().map(Host::Address)
        && !host.contains(':')
    {
        return Ok((address, port));
    }
    // Text that looks like an address but is not one is not a name, either.
    let is_numeric = host.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    let is_of_name = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
    if host.is_empty() || is_numeric || host.starts_with('-') || !host.bytes().all(is_of_name) {
        return no_address();
    }
    Ok((Host::Name(host.to_owned()), port))
}

impl fmt::Display for HostPort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.host {
            Host::Address(address) => SocketAddr::new(*address, self.port).fmt(f),
            Host::Name(name) => write!(f, "{name}:{}", self.port),
        }
    }
}

impl fmt::Display for Local {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn host(text: &str) -> Result<String, String> {
        text.parse::<HostPort>().map(|host| host.to_string())
    }

    #[test]
    fn a_host_is_a_name_or_an_address_with_or_without_a_port() {
        for (text, read) in [
            ("plant-b", "plant-b:7447"),
            ("plant_b.example.org:9000", "plant_b.example.org:9000"),
            ("10.0.0.2", "10.0.0.2:7447"),
            ("10.0.0.2:1", "10.0.0.2:1"),
            ("fd00::1", "[fd00::1]:7447"),
            ("[fd00::1]", "[fd00::1]:7447"),
            ("[fd00::1]:65535", "[fd00::1]:65535"),
        ] {
            assert_eq!(host(text).as_deref(), Ok(read));
        }
    }

    #[test]
    fn what_is_no_host_is_refused_with_what_would_be_one() {
        for text in ["", ":7447", "10.0.0", "10.0.0.256", "a b", "tcp/10.0.0.1", "[fd00::1", "-a"] {
            assert!(host(text).unwrap_err().contains("name a host"), "{text}");
        }
        for text in ["a:", "a:0", "a:65536", "a:http", "10.0.0.1:-1"] {
            assert!(host(text).unwrap_err().contains("ports are 1 to 65535"), "{text}");
        }
        assert!(host("0.0.0.0").unwrap_err().contains("every address"));
    }

    #[test]
    fn a_link_listens_on_an_address_of_this_machine() {
        let local = |text: &str| text.parse::<Local>().map(|local| local.to_string());
        assert_eq!(local("0.0.0.0").as_deref(), Ok("0.0.0.0:7447"));
        assert_eq!(local("[::]:9").as_deref(), Ok("[::]:9"));
        assert!(local("plant-b").unwrap_err().contains("an IP address of this machine"));
    }
}

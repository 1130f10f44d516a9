//! With whom the link's program is connected, as the kernel tells.

use std::collections::BTreeSet;
use std::fs;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

/// In the kernel's tables of TCP sockets.
const ESTABLISHED: &str = "01";

/// The far ends of a process's TCP connections that involve `port`, on either side; of all of them if it is `None`.
pub(super) fn of(pid: u32, port: Option<u16>) -> BTreeSet<SocketAddr> {
    let sockets = sockets(pid);
    let tables = ["tcp", "tcp6"]
        .map(|table| fs::read_to_string(format!("/proc/{pid}/net/{table}")).unwrap_or_default());
    tables.iter().flat_map(|table| established(table, &sockets, port)).collect()
}

/// The inodes of a process's sockets.
fn sockets(pid: u32) -> BTreeSet<String> {
    let entries = fs::read_dir(format!("/proc/{pid}/fd")).into_iter().flatten().flatten();
    let inode = |link: std::path::PathBuf| {
        Some(link.to_str()?.strip_prefix("socket:[")?.strip_suffix(']')?.to_owned())
    };
    entries.filter_map(|entry| inode(fs::read_link(entry.path()).ok()?)).collect()
}

fn established(table: &str, sockets: &BTreeSet<String>, port: Option<u16>) -> BTreeSet<SocketAddr> {
    let far_end = |line: &str| {
        let mut fields = line.split_whitespace().skip(1);
        let (local, far, state) = (fields.next()?, fields.next()?, fields.next()?);
        let inode = fields.nth(5)?;
        let (local, far) = (address(local)?, address(far)?);
        let is_ours = state == ESTABLISHED && sockets.contains(inode);
        let is_meant = port.is_none_or(|port| local.port() == port || far.port() == port);
        (is_ours && is_meant).then_some(far)
    };
    table.lines().skip(1).filter_map(far_end).collect()
}

/// An address in hexadecimal: words in the machine's order, each of bytes in the network's.
fn address(text: &str) -> Option<SocketAddr> {
    let (address, port) = text.split_once(':')?;
    let port = u16::from_str_radix(port, 16).ok()?;
    let word = |at: usize| {
        let digits = address.get(8 * at..8 * (at + 1))?;
        Some(u32::from_str_radix(digits, 16).ok()?.to_ne_bytes())
    };
    let address = match address.len() {
        8 => IpAddr::V4(Ipv4Addr::from(word(0)?)),
        32 => {
            let words = [word(0)?, word(1)?, word(2)?, word(3)?];
            let bytes: [u8; 16] = words.concat().try_into().ok()?;
            IpAddr::V6(Ipv6Addr::from(bytes)).to_canonical()
        }
        _ => return None,
    };
    Some(SocketAddr::new(address, port))
}

#[cfg(test)]
mod tests {
    use std::net::{TcpListener, TcpStream};

    use super::*;

    #[test]
    fn connections_are_those_of_the_process_and_the_port() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let (pid, port) = (std::process::id(), listener.local_addr().unwrap().port());
        assert_eq!(of(pid, Some(port)), BTreeSet::new());
        let near = TcpStream::connect(("127.0.0.1", port)).unwrap();
        // Until it is accepted, the listener's end of it is nobody's.
        let _far = listener.accept().unwrap();
        let ends = [near.local_addr().unwrap(), near.peer_addr().unwrap()];
        assert_eq!(of(pid, Some(port)), BTreeSet::from(ends));
        assert!(of(pid, None).is_superset(&BTreeSet::from(ends)));
        assert_eq!(of(1, Some(port)), BTreeSet::new());
        assert_eq!(of(pid, Some(port ^ 1)), BTreeSet::new());
    }

    #[test]
    #[cfg(target_endian = "little")]
    fn addresses_read_as_the_kernel_writes_them() {
        let read = |text| address(text).map(|address| address.to_string());
        assert_eq!(read("0200A8C0:1D17").as_deref(), Some("192.168.0.2:7447"));
        let mapped = "0000000000000000FFFF00000100007F:0050";
        assert_eq!(read(mapped).as_deref(), Some("127.0.0.1:80"));
        assert_eq!(read("00000000:").as_deref(), None);
    }
}

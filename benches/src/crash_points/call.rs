//! The system calls that change what other processes see, or what the process itself holds.

use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// A system call, by its number on this machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Call(i64);

macro_rules! calls {
    ($($(#[$attribute:meta])* $name:ident = $number:ident,)*) => {
        /// A process dies between two of these: to others, all instants in between are the same.
        const CALLS: &[(&str, i64)] = &[$($(#[$attribute])* (stringify!($name), libc::$number),)*];
    };
}

calls! {
    bind = SYS_bind,
    clone3 = SYS_clone3,
    close = SYS_close,
    connect = SYS_connect,
    exit_group = SYS_exit_group,
    fallocate = SYS_fallocate,
    fchmod = SYS_fchmod,
    fchmodat = SYS_fchmodat,
    fchown = SYS_fchown,
    fcntl = SYS_fcntl,
    flock = SYS_flock,
    fsync = SYS_fsync,
    ftruncate = SYS_ftruncate,
    linkat = SYS_linkat,
    mkdirat = SYS_mkdirat,
    mlockall = SYS_mlockall,
    mmap = SYS_mmap,
    munmap = SYS_munmap,
    openat = SYS_openat,
    pwrite64 = SYS_pwrite64,
    renameat2 = SYS_renameat2,
    renameat = SYS_renameat,
    sendto = SYS_sendto,
    socket = SYS_socket,
    symlinkat = SYS_symlinkat,
    unlinkat = SYS_unlinkat,
    write = SYS_write,
    #[cfg(target_arch = "x86_64")]
    chmod = SYS_chmod,
    #[cfg(target_arch = "x86_64")]
    link = SYS_link,
    #[cfg(target_arch = "x86_64")]
    mkdir = SYS_mkdir,
    #[cfg(target_arch = "x86_64")]
    open = SYS_open,
    #[cfg(target_arch = "x86_64")]
    rename = SYS_rename,
    #[cfg(target_arch = "x86_64")]
    rmdir = SYS_rmdir,
    #[cfg(target_arch = "x86_64")]
    unlink = SYS_unlink,
}

impl Call {
    /// The call of this number, if it is one of those above.
    pub fn numbered(number: i64) -> Option<Self> {
        CALLS.iter().any(|(_, known)| *known == number).then_some(Self(number))
    }

    /// Whether the call of this number, with this second and fourth argument, only waits for a time, or for another
    /// thread for at most a time.
    pub fn is_sleep(number: i64, second: u64, fourth: u64) -> bool {
        const WAITS: [i32; 2] = [libc::FUTEX_WAIT, libc::FUTEX_WAIT_BITSET];
        let operation = second as i32 & !(libc::FUTEX_PRIVATE_FLAG | libc::FUTEX_CLOCK_REALTIME);
        let has_timeout = fourth != 0;
        [libc::SYS_clock_nanosleep, libc::SYS_nanosleep].contains(&number)
            || number == libc::SYS_futex && WAITS.contains(&operation) && has_timeout
    }
}

impl Display for Call {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match CALLS.iter().find(|(_, number)| *number == self.0) {
            Some((name, _)) => f.write_str(name),
            None => write!(f, "{}", self.0),
        }
    }
}

impl FromStr for Call {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let known = CALLS.iter().find(|(name, _)| *name == text);
        known.map(|(_, number)| Self(*number)).ok_or_else(|| {
            let names: Vec<&str> = CALLS.iter().map(|(name, _)| *name).collect();
            format!("{text:?} is not one of the calls {}", names.join(", "))
        })
    }
}

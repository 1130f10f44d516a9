//! Interrupts that can be moved to other CPUs, and those that cannot.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;

use rustix::fs::{PROC_SUPER_MAGIC, fstatfs};
use rustix::io::Errno;

/// Whether an interrupt can be moved to other CPUs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Mobility {
    /// The kernel accepts other CPUs for it.
    Movable,
    /// The kernel placed it and refuses to move it.
    Managed,
    /// The kernel was not asked, and drivers with handlers of this name have managed interrupts.
    ProbablyManaged,
    /// The kernel was not asked: only root may.
    Unknown,
}

impl Mobility {
    /// Whether the kernel refuses to move it, as far as is known.
    pub(crate) const fn is_fixed(self) -> bool {
        matches!(self, Self::Managed | Self::ProbablyManaged)
    }
}

/// Asks without changing anything: before the kernel reads a list of CPUs that is written here, it sees
/// whether the interrupt may be moved at all. So a text that is no list is refused in either case, and
/// the error tells which. Writing back the list that is there would not do: the kernel may then choose
/// another CPU of it.
pub(super) fn ask(affinity: &Path) -> Mobility {
    let Ok(mut file) = OpenOptions::new().write(true).open(affinity) else {
        return Mobility::Unknown;
    };
    // Made-up machines are ordinary files.
    if !fstatfs(&file).is_ok_and(|system| system.f_type == PROC_SUPER_MAGIC) {
        return Mobility::Unknown;
    }
    let refusal = file.write(b"no list").err().and_then(|error| error.raw_os_error());
    match refusal.map(Errno::from_raw_os_error) {
        Some(Errno::INVAL) => Mobility::Movable,
        // The second is what older kernels say.
        Some(Errno::PERM | Errno::IO) => Mobility::Managed,
        _ => Mobility::Unknown,
    }
}

/// Whether drivers with handlers of this name let the kernel manage their interrupts: the queues of
/// virtio disks (`virtio1-req.0`), of virtio SCSI (`virtio0-request`) and of NVMe, but for the first,
/// which is for administration (`nvme0q1`).
pub(super) fn is_managed_by_name(handler: &str) -> bool {
    let after_number =
        |text: &str| text.trim_start_matches(|c: char| c.is_ascii_digit()).to_owned();
    if let Some(rest) = handler.strip_prefix("virtio") {
        let queue = after_number(rest);
        return queue.starts_with("-req.") || queue.starts_with("-request");
    }
    let queue = handler.strip_prefix("nvme").map(after_number);
    queue.is_some_and(|queue| queue.starts_with('q') && queue != "q0")
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::machine::Machine;

    #[test]
    fn queues_of_disks_are_probably_managed() {
        for (handler, is_managed) in [
            ("virtio1-req.0", true),
            ("virtio12-req.3", true),
            ("virtio0-request", true),
            ("nvme0q1", true),
            ("nvme0q0", false),
            ("virtio1-config", false),
            ("virtio2-input.0", false),
            ("xhci_hcd", false),
            ("", false),
        ] {
            assert_eq!(is_managed_by_name(handler), is_managed, "{handler}");
        }
    }

    #[test]
    fn an_ordinary_file_is_not_asked_and_stays_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("smp_affinity_list");
        fs::write(&file, "0-1\n").unwrap();
        assert_eq!(ask(&file), Mobility::Unknown);
        assert_eq!(fs::read_to_string(&file).unwrap(), "0-1\n");
        assert_eq!(ask(&folder.path().join("missing")), Mobility::Unknown);
    }

    /// As root, the kernel answers; as anybody else, nothing is known. Either way nothing changes.
    #[test]
    fn asking_about_the_interrupts_of_this_machine_leaves_them_where_they_may_fire() {
        for irq in Machine::here().names("/proc/irq") {
            let file = format!("/proc/irq/{irq}/smp_affinity_list");
            let Ok(before) = fs::read_to_string(&file) else { continue };
            let mobility = ask(Path::new(&file));
            assert_ne!(mobility, Mobility::ProbablyManaged);
            assert_eq!(fs::read_to_string(&file).ok(), Some(before), "{file}");
        }
    }
}

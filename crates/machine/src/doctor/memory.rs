//! Memory: what may move or take away the task's pages, and room for its ports.

use super::verdict::Verdict;
use crate::machine::{Capability, Machine};

/// Less than this, and a few services with their connections do not fit.
const LITTLE_SHARED: u64 = 16 << 20;
/// Less than this, and not even a node with one service fits.
const NO_SHARED: u64 = 1 << 20;

pub(super) fn huge_pages(machine: &Machine, _cpu: usize) -> Verdict {
    let file = "/sys/kernel/mm/transparent_hugepage/enabled";
    let effect = "The kernel merges pages of running programs into huge pages, and a page fault may wait while it compacts memory.";
    let chosen = machine
        .text(file)
        .and_then(|modes| Some(modes.split_once('[')?.1.split_once(']')?.0.to_owned()));
    let verdict = match chosen.as_deref() {
        Some("always") => {
            Verdict::warning("always").effect(effect).fix(format!("echo madvise > {file}"))
        }
        Some(mode) => Verdict::ok(mode)
            .effect("The task's pages stay as they are, because it requests no huge pages."),
        None if machine.has("/sys/kernel/mm") => {
            Verdict::ok("not built into this kernel").effect("The task's pages stay as they are.")
        }
        None => Verdict::unknown("the mode cannot be read").effect(effect),
    };
    verdict.from(file)
}

pub(super) fn swap(machine: &Machine, _cpu: usize) -> Verdict {
    let file = "/proc/swaps";
    let none = "No page has to be read back from a disk.";
    let Some(swaps) = machine.text(file) else {
        return Verdict::unknown("the list of swap areas cannot be read")
            .effect("A cycle that needs a swapped-out page waits for the disk.")
            .from(file);
    };
    let areas: Vec<_> =
        swaps.lines().skip(1).filter_map(|line| line.split_whitespace().next()).collect();
    let can_lock = machine.capability(Capability::IpcLock) == Some(true)
        || machine.limit("Max locked memory").is_some_and(|limit| limit.hard == u64::MAX);
    let verdict = match (areas.is_empty(), can_lock) {
        (true, _) => Verdict::ok("none").effect(none),
        (false, true) => Verdict::note(areas.join(", ")).effect(
            "The task's memory is locked in RAM; peers that do not lock theirs may wait for the disk.",
        ),
        (false, false) => Verdict::warning(areas.join(", "))
            .effect("The task's memory is not locked (see memory_lock), so a cycle may wait for the disk."),
    };
    let verdict = if areas.is_empty() { verdict } else { verdict.fix("swapoff -a") };
    verdict.from(file)
}

pub(super) fn shared_memory(machine: &Machine, _cpu: usize) -> Verdict {
    let folder = "/dev/shm";
    let effect = "Ports are stored here. If it is full, no port can be created, and a process that connects to a peer at that moment is killed (SIGBUS).";
    let fix = machine.container().fix(
        "start the container with --shm-size 256m, or --ipc host",
        "mount -o remount,size=256m /dev/shm  # or delete the files that fill it",
    );
    let free = machine.has(folder).then(|| machine.free_bytes(folder));
    let verdict = match free {
        None => Verdict::problem("there is no /dev/shm")
            .effect("Ports cannot be created.")
            .fix("mount -t tmpfs tmpfs /dev/shm"),
        Some(None) => Verdict::unknown("its free space cannot be read").effect(effect),
        Some(Some(bytes)) => {
            let value = format!("{} MiB free", bytes >> 20);
            match bytes {
                0..NO_SHARED => Verdict::problem(format!("{} KiB free", bytes >> 10)).fix(fix),
                NO_SHARED..LITTLE_SHARED => Verdict::warning(value).fix(fix),
                _ => Verdict::ok(value),
            }
            .effect(effect)
        }
    };
    verdict.from(folder)
}

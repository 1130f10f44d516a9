//! The real-time threads of the machine.

use super::Machine;

/// A thread that goes before all normal ones.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RealTimeThread {
    pub(crate) id: u32,
    pub(crate) name: String,
    /// `fifo:80`, `rr:10` or `deadline`.
    pub(crate) scheduler: String,
    /// It belongs to the kernel.
    pub(crate) is_kernel: bool,
}

/// Flag of the kernel's own threads (`PF_KTHREAD`).
const KERNEL_THREAD: u64 = 0x0020_0000;

impl Machine {
    /// The real-time threads that ran on a CPU last, those of other users included where `/proc`
    /// shows them. Each CPU has a `migration` thread of its own, which is left out.
    pub(crate) fn real_time_threads_on(&self, cpu: usize) -> Option<Vec<RealTimeThread>> {
        let processes = self.names("/proc");
        let is_number = |name: &&String| name.bytes().all(|byte| byte.is_ascii_digit());
        let threads = processes.iter().filter(is_number).flat_map(|process| {
            let tasks = format!("/proc/{process}/task");
            self.names(&tasks).into_iter().map(move |task| format!("{tasks}/{task}/stat"))
        });
        let found = threads.filter_map(|stat| thread(&self.text(&stat)?)).collect::<Vec<_>>();
        if found.is_empty() && !self.has("/proc/self/status") {
            return None;
        }
        let here = found.into_iter().filter_map(|(on, thread)| (on == cpu).then_some(thread?));
        Some(here.filter(|thread| !thread.name.starts_with("migration/")).collect())
    }
}

/// The CPU of a thread, and the thread if it is a real-time one.
fn thread(stat: &str) -> Option<(usize, Option<RealTimeThread>)> {
    // The name may contain anything, also parentheses.
    let (start, rest) = stat.rsplit_once(')')?;
    let (id, name) = start.split_once(" (")?;
    let fields: Vec<_> = rest.split_whitespace().collect();
    let field = |number: usize| fields.get(number - 3)?.parse::<u64>().ok();
    let (flags, cpu, priority, policy) = (field(9)?, field(39)?, field(40)?, field(41)?);
    let scheduler = match policy {
        1 => Some(format!("fifo:{priority}")),
        2 => Some(format!("rr:{priority}")),
        6 => Some("deadline".to_owned()),
        _ => None,
    };
    let thread = scheduler.map(|scheduler| RealTimeThread {
        id: id.parse().unwrap_or(0),
        name: name.to_owned(),
        scheduler,
        is_kernel: flags & KERNEL_THREAD != 0,
    });
    Some((usize::try_from(cpu).ok()?, thread))
}

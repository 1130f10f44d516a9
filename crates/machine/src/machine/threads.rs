//! The real-time threads of the machine.

use super::{CpuList, Machine};
use crate::quiet::BoundThread;

/// A thread that goes before all normal ones.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RealTimeThread {
    pub(crate) id: u32,
    pub(crate) name: String,
    /// From 1 to 99; 0: it has a deadline instead.
    priority: u8,
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
        let threads = self.processes().into_iter().flat_map(|process| self.threads_of(&process));
        let stats = threads.filter_map(|thread| self.text(&format!("{thread}/stat")));
        let found = stats.filter_map(|stat| thread(&stat)).collect::<Vec<_>>();
        if found.is_empty() && !self.has("/proc/self/status") {
            return None;
        }
        let here = found.into_iter().filter_map(|(on, thread)| (on == cpu).then_some(thread?));
        Some(here.filter(|thread| !thread.name.starts_with("migration/")).collect())
    }

    /// The highest SCHED_FIFO or SCHED_RR priority of a process's threads; `None`: they have none, or nothing is
    /// known of them.
    pub fn highest_priority(&self, process: u32) -> Option<u8> {
        let threads = self.threads_of(&process.to_string()).into_iter();
        let stats = threads.filter_map(|folder| self.text(&format!("{folder}/stat")));
        let priorities = stats.filter_map(|stat| Some(thread(&stat)?.1?.priority));
        priorities.filter(|priority| *priority > 0).max()
    }

    /// The threads of programs that somebody bound to one CPU for their own sake: those of real-time
    /// priority, and ordinary ones in a process that as a whole may use other CPUs. (A process that runs
    /// under `taskset -c 1`, or in a container with one CPU, has nothing that must keep a beat there.)
    pub(crate) fn bound_threads(&self) -> Vec<BoundThread> {
        self.processes().iter().flat_map(|process| self.bound_threads_of(process)).collect()
    }

    fn bound_threads_of(&self, process: &str) -> Vec<BoundThread> {
        let is_program = |stat: &String| thread_flags(stat).is_some_and(|f| f & KERNEL_THREAD == 0);
        if !self.text(&format!("/proc/{process}/stat")).as_ref().is_some_and(is_program) {
            return Vec::new();
        }
        let of_process = self.affinity_of(&format!("/proc/{process}"));
        let bound = |folder: String| {
            let affinity = self.affinity_of(&folder)?;
            let cpu = affinity.last().filter(|_| affinity.len() == 1)?;
            let stat = self.text(&format!("{folder}/stat"))?;
            let is_real_time = || thread(&stat).is_some_and(|(_, found)| found.is_some());
            (of_process.as_ref() != Some(&affinity) || is_real_time()).then_some(())?;
            let (_, name) = stat.rsplit_once(')')?.0.split_once(" (")?;
            Some(BoundThread { process: Some(process.parse().ok()?), name: name.to_owned(), cpu })
        };
        self.threads_of(process).into_iter().filter_map(bound).collect()
    }

    fn affinity_of(&self, folder: &str) -> Option<CpuList> {
        let status = self.text(&format!("{folder}/status"))?;
        let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"))?;
        CpuList::parse(list)
    }

    /// The processes, by number.
    fn processes(&self) -> Vec<String> {
        let mut names = self.names("/proc");
        names.retain(|name| name.bytes().all(|byte| byte.is_ascii_digit()));
        names
    }

    /// The folders of a process's threads.
    fn threads_of(&self, process: &str) -> Vec<String> {
        let tasks = format!("/proc/{process}/task");
        self.names(&tasks).into_iter().map(|task| format!("{tasks}/{task}")).collect()
    }
}

fn thread_flags(stat: &str) -> Option<u64> {
    let (_, rest) = stat.rsplit_once(')')?;
    rest.split_whitespace().nth(6)?.parse().ok()
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
        priority: priority.try_into().unwrap_or(0),
        scheduler,
        is_kernel: flags & KERNEL_THREAD != 0,
    });
    Some((usize::try_from(cpu).ok()?, thread))
}

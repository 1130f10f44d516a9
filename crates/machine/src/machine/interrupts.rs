//! `/proc/interrupts`: which interrupts there are, and how often each fired on each CPU.

use std::collections::BTreeMap;

use super::mobility::{Mobility, is_managed_by_name};
use super::{CpuList, Machine};

/// A device's interrupt that can fire on a CPU.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Interrupt {
    pub(crate) number: u32,
    /// Who handles it.
    pub(crate) name: String,
    /// The CPUs that it can fire on.
    pub(crate) affinity: String,
    /// How often it fired on the CPU since the start.
    pub(crate) fired: u64,
    /// Whether it can be moved to other CPUs.
    pub(crate) mobility: Mobility,
}

/// The file, parsed.
pub(super) struct Table {
    /// The CPUs, in the order of the columns.
    cpus: Vec<usize>,
    pub(super) rows: Vec<Row>,
}

/// An interrupt.
pub(super) struct Row {
    /// A number, or the letters of one of the kernel's own: `36`, `LOC`.
    label: String,
    /// In the order of the columns; the kernel's own may have fewer.
    counts: Vec<u64>,
    /// Chip, number, trigger and handlers.
    description: String,
}

impl Table {
    fn parse(text: &str) -> Option<Self> {
        let mut lines = text.lines();
        let number = |column: &str| column.strip_prefix("CPU")?.parse().ok();
        let cpus = lines.next()?.split_whitespace().map(number).collect::<Option<Vec<usize>>>()?;
        let row = |line: &str| {
            let (label, rest) = line.split_once(':')?;
            let words: Vec<&str> = rest.split_whitespace().collect();
            let counts: Vec<u64> =
                words.iter().take(cpus.len()).map_while(|word| word.parse().ok()).collect();
            let description = words.get(counts.len()..).unwrap_or_default().join(" ");
            Some(Row { label: label.trim().to_owned(), counts, description })
        };
        let rows = lines.filter_map(row).collect();
        Some(Self { cpus, rows })
    }

    /// How often one interrupt fired on a CPU, on all of them if `cpu` is `None`.
    pub(super) fn count(&self, row: &Row, cpu: Option<usize>) -> u64 {
        let columns = self.cpus.iter().zip(&row.counts);
        columns.filter(|(of, _)| cpu.is_none_or(|cpu| cpu == **of)).map(|(_, count)| count).sum()
    }
}

impl Row {
    /// A CPU's own timer, which wakes what sleeps there.
    pub(super) fn is_timer(&self) -> bool {
        self.label == "LOC" || self.description.contains("arch_timer")
    }

    /// The number of a device's interrupt. The kernel's own (timers, other CPUs) have letters, or, on
    /// some architectures and in Xen, a number and a name by which they are known.
    fn device(&self) -> Option<u32> {
        let is_kernel = self.is_timer()
            || self.description.contains("xen-percpu")
            || handler(&self.description) == "timer";
        self.label.parse().ok().filter(|_| !is_kernel)
    }
}

impl Machine {
    pub(super) fn interrupt_table(&self) -> Option<Table> {
        Table::parse(&self.text("/proc/interrupts")?)
    }

    /// How often devices interrupted each CPU since the start.
    pub(crate) fn device_interrupts(&self) -> Option<BTreeMap<usize, u64>> {
        let table = self.interrupt_table()?;
        let of_devices = || table.rows.iter().filter(|row| row.device().is_some());
        let count = |cpu: usize| of_devices().map(|row| table.count(row, Some(cpu))).sum();
        Some(table.cpus.iter().map(|cpu| (*cpu, count(*cpu))).collect())
    }

    /// The interrupts that can fire on a CPU, the most frequent first.
    pub(crate) fn interrupts_on(&self, cpu: usize) -> Option<Vec<Interrupt>> {
        let table = self.interrupt_table()?;
        table.cpus.contains(&cpu).then_some(())?;
        let interrupt = |row: &Row| {
            let number = row.device()?;
            let affinity = self.affinity(number)?;
            CpuList::parse(&affinity)?.contains(cpu).then_some(())?;
            let name = handler(&row.description).to_owned();
            let mobility = match self.mobility(number) {
                Mobility::Unknown if is_managed_by_name(&name) => Mobility::ProbablyManaged,
                mobility => mobility,
            };
            let fired = table.count(row, Some(cpu));
            Some(Interrupt { number, name, affinity, fired, mobility })
        };
        let mut interrupts: Vec<_> = table.rows.iter().filter_map(interrupt).collect();
        interrupts.sort_by_key(|interrupt| (u64::MAX - interrupt.fired, interrupt.number));
        Some(interrupts)
    }

    /// The CPUs that an interrupt can fire on: those chosen, or, where the kernel does not tell,
    /// those allowed.
    fn affinity(&self, number: u32) -> Option<String> {
        let files = ["effective_affinity_list", "smp_affinity_list"];
        files.into_iter().find_map(|file| self.text(&format!("/proc/irq/{number}/{file}")))
    }
}

/// The handlers, after chip, number and trigger: `PCI-MSIX-0000:00:02.0 1-edge virtio1-req.0`.
fn handler(description: &str) -> &str {
    let is_trigger = |word: &str| {
        let word = word.to_ascii_lowercase();
        ["edge", "level", "fasteoi"].into_iter().any(|trigger| word.ends_with(trigger))
    };
    let mut rest = description;
    while let Some((word, after)) = rest.split_once(' ') {
        if is_trigger(word) {
            return after;
        }
        rest = after;
    }
    if is_trigger(rest) { "" } else { description }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_handler_is_what_follows_the_trigger_on_every_architecture() {
        for (line, name) in [
            ("PCI-MSIX-0000:00:02.0 1-edge virtio1-req.0", "virtio1-req.0"),
            ("IO-APIC 16-fasteoi i801_smbus, snd_hda", "i801_smbus, snd_hda"),
            ("GICv3 27 Level arch_timer", "arch_timer"),
            ("XT-PIC timer", "XT-PIC timer"),
            ("IO-APIC 2-edge", ""),
        ] {
            assert_eq!(handler(line), name, "{line}");
        }
    }

    #[test]
    fn the_kernels_own_interrupts_are_no_device_s() {
        let table = Table::parse(
            "       CPU0  CPU2\n  0:  9  9  IO-APIC  2-edge  timer\n 11:  9  9  GICv3  27 Level  arch_timer\n \
             36:  3  40  PCI-MSIX  1-edge  virtio1-req.0\n 48:  9  9  xen-percpu  -virq  timer0\n \
             50:  1  2  xen-dyn  -event  eth0\nIPI0:  9  9  Rescheduling\nLOC:  9  9  Local timer\nERR:  0\n",
        )
        .unwrap();
        let devices: Vec<u32> = table.rows.iter().filter_map(Row::device).collect();
        assert_eq!(devices, [36, 50]);
        assert_eq!(table.cpus, [0, 2], "CPU 1 is offline");
    }

    #[test]
    fn a_row_with_fewer_counts_than_cpus_counts_on_those_it_has() {
        let table = Table::parse("  CPU0 CPU1\nERR:  7\nLOC:  1  2  Local timer\n").unwrap();
        let counts = |cpu| table.rows.iter().map(|row| table.count(row, cpu)).collect::<Vec<_>>();
        assert_eq!(
            (counts(Some(0)), counts(Some(1)), counts(None)),
            (vec![7, 1], vec![0, 2], vec![7, 3])
        );
    }
}

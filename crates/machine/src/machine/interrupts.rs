//! The interrupts of devices, and where they fire.

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
}

impl Machine {
    /// The interrupts that can fire on a CPU, the most frequent first.
    pub(crate) fn interrupts_on(&self, cpu: usize) -> Option<Vec<Interrupt>> {
        let table = self.text("/proc/interrupts")?;
        let mut lines = table.lines();
        let columns: Vec<_> = lines.next()?.split_whitespace().collect();
        let column = columns.iter().position(|name| *name == format!("CPU{cpu}"))?;
        let mut interrupts: Vec<_> = lines
            .filter_map(|line| {
                let (number, rest) = line.split_once(':')?;
                // Those of the kernel itself (timer, rescheduling) have letters, and no affinity.
                let number = number.trim().parse().ok()?;
                let words: Vec<_> = rest.split_whitespace().collect();
                let affinity = self.affinity(number)?;
                CpuList::parse(&affinity)?.contains(cpu).then_some(())?;
                Some(Interrupt {
                    number,
                    name: handler(words.get(columns.len()..)?),
                    affinity,
                    fired: words.get(column)?.parse().ok()?,
                })
            })
            .collect();
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
fn handler(words: &[&str]) -> String {
    let trigger = words.iter().position(|word| {
        let word = word.to_ascii_lowercase();
        ["edge", "level", "fasteoi"].into_iter().any(|trigger| word.ends_with(trigger))
    });
    let names = trigger.map_or(words, |trigger| words.get(trigger + 1..).unwrap_or_default());
    names.join(" ")
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
            assert_eq!(handler(&line.split(' ').collect::<Vec<_>>()), name, "{line}");
        }
    }
}

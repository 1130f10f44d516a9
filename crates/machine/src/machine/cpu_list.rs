//! The kernel's way to name CPUs: `0-3,8`.

use std::fmt;
use std::ops::RangeInclusive;

/// A set of CPUs, displayed as the kernel lists them: `0-3,8`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CpuList(Vec<RangeInclusive<usize>>);

impl CpuList {
    /// Parses `0-3,8`, `all` or an empty list; `None` if the text is none of these.
    pub fn parse(list: &str) -> Option<Self> {
        match list.trim() {
            // The second is how some kernels print an empty mask.
            "" | "(null)" => return Some(Self::default()),
            "all" => return Some(Self(vec![0..=usize::MAX])),
            _ => {}
        }
        let ranges = list.trim().split(',').map(|range| {
            let (first, last) = range.split_once('-').unwrap_or((range, range));
            Some(first.trim().parse().ok()?..=last.trim().parse().ok()?)
        });
        ranges.collect::<Option<_>>().map(Self)
    }

    /// Whether the set contains a CPU.
    pub fn contains(&self, cpu: usize) -> bool {
        self.0.iter().any(|range| range.contains(&cpu))
    }

    /// Whether the set contains no CPU.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many CPUs it names.
    pub(crate) fn len(&self) -> usize {
        let lengths = self.0.iter().map(|range| {
            if range.is_empty() { 0 } else { (range.end() - range.start()).saturating_add(1) }
        });
        lengths.fold(0, usize::saturating_add)
    }

    /// The highest CPU.
    pub(crate) fn last(&self) -> Option<usize> {
        self.0.iter().map(|range| *range.end()).max()
    }

    /// Its CPUs in order; no more than a machine can have.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        /// The largest machines that Linux supports have 8192.
        const MOST: usize = 8192;
        (0..self.last().map_or(0, |last| last.min(MOST) + 1)).filter(|cpu| self.contains(*cpu))
    }

    /// All but one.
    pub(crate) fn without(&self, cpu: usize) -> Self {
        let split = self.0.iter().flat_map(|range| {
            let (first, last) = (*range.start(), *range.end());
            if !range.contains(&cpu) {
                return [Some(range.clone()), None];
            }
            [(first < cpu).then(|| first..=cpu - 1), (cpu < last).then(|| cpu + 1..=last)]
        });
        Self(split.flatten().collect())
    }
}

impl fmt::Display for CpuList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, range) in self.0.iter().enumerate() {
            let comma = if index > 0 { "," } else { "" };
            if range.start() == range.end() {
                write!(f, "{comma}{}", range.start())?
            } else {
                write!(f, "{comma}{}-{}", range.start(), range.end())?
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(text: &str) -> CpuList {
        CpuList::parse(text).unwrap()
    }

    #[test]
    fn a_list_names_its_ranges_and_single_cpus() {
        let cpus = list("0-3,8\n");
        assert_eq!((cpus.len(), cpus.last(), cpus.is_empty()), (5, Some(8), false));
        for cpu in 0..10 {
            assert_eq!(cpus.contains(cpu), [0, 1, 2, 3, 8].contains(&cpu), "{cpu}");
        }
        assert_eq!(cpus.to_string(), "0-3,8");
        assert_eq!(cpus.iter().collect::<Vec<_>>(), [0, 1, 2, 3, 8]);
        assert_eq!(list("all").iter().count(), 8193);
        assert_eq!(list("").iter().count(), 0);
    }

    #[test]
    fn an_empty_list_names_none_and_all_names_all() {
        for empty in ["", "\n", "(null)\n"] {
            assert!(list(empty).is_empty() && list(empty).last().is_none(), "{empty:?}");
        }
        assert!(list("all").contains(4096) && !list("all").is_empty());
    }

    #[test]
    fn what_is_not_a_list_is_not_taken_for_one() {
        for text in ["x", "0-", "0-7:1/2", "1;2", "-1"] {
            assert_eq!(CpuList::parse(text), None, "{text}");
        }
    }

    #[test]
    fn a_cpu_is_taken_out_of_any_range() {
        for (from, cpu, left) in [
            ("0-1", 1, "0"),
            ("0-3", 2, "0-1,3"),
            ("0-3", 0, "1-3"),
            ("0,5", 5, "0"),
            ("3", 3, ""),
            ("0-1", 9, "0-1"),
        ] {
            assert_eq!(list(from).without(cpu).to_string(), left, "{from} without {cpu}");
        }
    }
}

//! Rows of CSV, as `scope`, `subscribe` and `export` write them.

use std::path::Path;

use isochrone_engine::escaped;
use isochrone_scope::{Head, ObservedTask, TrackSignal, Triggered};

use super::readable::{Contents, Each, Enough, Readable};
use crate::base::csv_table::CsvTable;
use crate::base::failure::Failure;

/// A file that was read.
pub(super) struct OfCsv {
    table: CsvTable,
    contents: Contents,
}

pub(super) fn read(path: &Path) -> Result<OfCsv, Failure> {
    let table = CsvTable::with_cycles(path).map_err(Failure::usage)?;
    let Some(times_ns) = table.times_ns() else {
        return Err(Failure::usage(format!(
            "{} has no column \"time_s\": scope shows what `scope`, `subscribe --csv` and `export` write",
            path.display()
        )));
    };
    // A shot counts its times from the trigger.
    let begin_ns = (table.begin_s() * 1e9).round();
    let before_ns = if begin_ns < 0.0 { begin_ns.abs() as u64 } else { 0 };
    let cycle = || {
        let row = times_ns.partition_point(|ns| *ns < before_ns);
        table.cycle(row).unwrap_or(row as u64)
    };
    let trigger = (before_ns > 0).then(|| Triggered {
        cycle: cycle(),
        release_ns: before_ns,
        text: "trigger".into(),
        ..Triggered::default()
    });
    let signal = |(name, unit): (&String, &String)| TrackSignal {
        name: escaped(name).into_owned(),
        unit: escaped(unit).into_owned(),
        ..TrackSignal::default()
    };
    let signals = table.columns().iter().zip(table.units()).map(signal).collect();
    let track = ObservedTask { task: String::new(), period_ns: period_ns(times_ns), signals };
    let node = escaped(&path.display().to_string()).into_owned();
    let contents = Contents { tracks: vec![track], node, trigger, ..Contents::default() };
    Ok(OfCsv { table, contents })
}

/// The time between most rows.
fn period_ns(times_ns: &[u64]) -> Option<u64> {
    let mut distances: Vec<u64> =
        times_ns.iter().zip(times_ns.iter().skip(1)).map(|(one, next)| next - one).collect();
    distances.sort_unstable();
    distances.get(distances.len() / 2).copied().filter(|distance| *distance > 0)
}

impl Readable for OfCsv {
    fn contents(&self) -> &Contents {
        &self.contents
    }

    fn rows(&self, each: &mut Each<'_>) -> Result<(), Failure> {
        let mut last = None;
        for (row, after_ns) in self.table.times_ns().unwrap_or_default().iter().enumerate() {
            let cycle = self.table.cycle(row).unwrap_or(row as u64);
            // A cycle that is not there was lost, unless the file says that it was missed.
            let between =
                last.replace(cycle).map_or(0, |last| cycle.saturating_sub(last.saturating_add(1)));
            let missed = self.table.missed(row).min(between);
            let head = Head { cycle, release_ns: *after_ns, lost: between - missed, missed };
            if each(0, head, self.table.row(row as u64))? == Enough::Yes {
                break;
            }
        }
        Ok(())
    }
}

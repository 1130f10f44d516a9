//! The two processes of a redundant node, in words.

use isochrone_control::{LastTakeover, RedundancyDescription};
use isochrone_timing::units::counted;

use crate::operate::time;

/// Who holds the node and who stands by, and, if there was one, the last takeover: a line each.
pub(crate) fn twins(redundancy: &RedundancyDescription) -> Vec<String> {
    let RedundancyDescription { holder, standby, is_complete, behind_cycles, takeovers, .. } =
        redundancy;
    let standby = match (standby, is_complete, behind_cycles) {
        (None, ..) => "no standby".to_owned(),
        (Some(pid), false, _) => format!("pid {pid} joins as standby"),
        (Some(pid), true, Some(behind)) if *behind > 1 => {
            format!("pid {pid} stands by, {behind} cycles behind")
        }
        (Some(pid), true, _) => format!("pid {pid} stands by"),
    };
    let mut lines = vec![format!("held by pid {holder}, {standby}")];
    if let Some(LastTakeover { unix_ns, was_asked, lost_cycles }) = redundancy.last_takeover {
        let (when, count) = (time(unix_ns), counted(*takeovers, "takeover"));
        let how = if was_asked {
            "as the holder had asked".to_owned()
        } else {
            format!("the holder was silent, {} lost", counted(lost_cycles, "cycle"))
        };
        lines.push(format!("{count}, the last {when}: {how}"));
    }
    lines
}

//! Entries of recorded journals.

use isochrone_engine::Plan;
use isochrone_model::Entry;

use super::line::Line;
use super::lines::without_place;

/// Reads an entry from a line of a journal; returns it with the index of its task in the plan.
///
/// # Errors
/// The line is not an entry that a node of this version writes for this plan; the reason, as part of a sentence.
pub fn entry_of_line(line: &str, plan: &Plan) -> Result<(usize, Entry), String> {
    let entry = match serde_json::from_str(line) {
        Ok(Line::Entry(entry)) => entry,
        Ok(_) => return Err("a line that is no entry".into()),
        Err(error) => return Err(without_place(&error.to_string())),
    };
    let task = plan.task_index(&entry.task);
    let task = task.ok_or_else(|| format!("there is no task \"{}\"", entry.task))?;
    if entry.left_out > 0 {
        return Err("an entry without all of its values".into());
    }
    if entry.until_cycle.is_some_and(|until| until <= entry.cycle) {
        return Err("a force that ends before it begins".into());
    }
    Ok((task, entry))
}

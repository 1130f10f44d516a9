//! The answer to `apply`.

use isochrone_model::ChangeSummary;

use isochrone_control::{
    ApplyResult, ByTask, ChangedValue, Entry, Finding, Part, Reply, Room, Tuned,
};

/// The changes of a new configuration, and the tasks that have it.
pub(super) struct Applied {
    pub(super) tasks: ByTask<Part>,
    pub(super) summary: ChangeSummary,
    pub(super) values: Vec<ChangedValue>,
    pub(super) tuned: Vec<Tuned>,
    pub(super) lost_alarms: Vec<String>,
    pub(super) cost_ns: u64,
    /// For a dry run, why it would be refused now.
    pub(super) refused: Option<String>,
}

impl Applied {
    pub(super) fn take(&mut self, entry: &Entry) {
        self.tasks.insert(entry.task.clone(), Part { cycle: entry.cycle, pending: false });
    }

    /// `number` is 0 for a dry run.
    pub(super) fn reply(self, number: u64, notes: Vec<Finding>) -> Reply {
        let Self { tasks, summary, values, tuned, lost_alarms, cost_ns, refused, .. } = self;
        let transaction = Some(number).filter(|number| *number > 0);
        let ChangeSummary { added, removed, kept, changed, limits } = summary;
        let mut room = Room::of_answer();
        let warnings = notes.into_iter().take_while(|note| room.takes(note)).collect();
        // Values that have changed go before values that have not.
        let [lost_alarms, limits, removed, added, changed, kept] =
            [lost_alarms, limits, removed, added, changed, kept]
                .map(|names| fitting(names, &mut room));
        let tuned = tuned.into_iter().take_while(|one| room.takes(one)).collect();
        let all = values.len();
        let values: Vec<_> = values.into_iter().take_while(|one| room.takes(one)).collect();
        let values_left_out = all - values.len();
        Reply::Apply(ApplyResult {
            transaction,
            tasks,
            warnings,
            added,
            removed,
            kept,
            changed,
            values,
            values_left_out,
            tuned,
            limits,
            lost_alarms,
            cost_ns,
            refused,
        })
    }
}

/// The first names, as many as fit; the last item then says how many are left out.
fn fitting(names: Vec<String>, room: &mut Room) -> Vec<String> {
    /// For the words.
    const LEFT_OUT: &str = "and 1000000 more";
    let all = names.len();
    let has_words = room.takes(LEFT_OUT);
    let mut page: Vec<String> = names.into_iter().take_while(|name| room.takes(name)).collect();
    let left_out = all - page.len();
    if left_out > 0 && has_words {
        page.push(format!("and {left_out} more"));
    }
    page
}

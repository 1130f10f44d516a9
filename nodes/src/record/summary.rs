//! What was recorded, in the end.

use isochrone_engine::escaped;
use isochrone_report::Table;
use isochrone_timing::units::counted;
pub(super) use isochrone_timing::units::size;
use serde_json::{Value, json};

use super::output::Output;
use super::source::Source;

/// A service that was to be recorded and was not.
#[derive(Debug, serde::Serialize)]
pub(super) struct LeftOut {
    pub(super) service: String,
    pub(super) why: String,
}

/// What was recorded.
pub(super) struct Summary<'a> {
    sources: &'a [Source<'a>],
    output: &'a Output,
    left_out: &'a [LeftOut],
}

impl<'a> Summary<'a> {
    pub(super) fn new(
        sources: &'a [Source<'a>],
        output: &'a Output,
        left_out: &'a [LeftOut],
    ) -> Self {
        Self { sources, output, left_out }
    }

    /// For people: one line, and one more for each service that has something to be said of it.
    pub(super) fn text(&self) -> String {
        let files = &self.output.files;
        let received = sentence(self.sources, self.output.frames(), self.unwritten());
        let mut text = format!("{received}, {}\n", size(self.output.bytes()));
        if let [_, .., last] = &files[..] {
            text += &format!("{} files, the last is {}\n", files.len(), last.path.display());
        }
        let mut table = Table::default();
        for source in self.sources {
            let counters = source.counters();
            let lost = (counters.lost > 0).then(|| format!("{} lost", counters.lost));
            let restarts =
                (counters.restarts > 0).then(|| counted(counters.restarts, "restart").to_string());
            let others = counters.other_writers;
            let others = (others > 0)
                .then(|| format!("{} of other writers left out", counted(others, "frame")));
            let layouts = (source.layouts() > 1).then(|| format!("{} layouts", source.layouts()));
            let unwritten = self.unwritten_of(source);
            let unwritten = (unwritten > 0)
                .then(|| format!("{} received and not written", counted(unwritten, "frame")));
            let said: Vec<String> =
                [unwritten, lost, restarts, others, layouts].into_iter().flatten().collect();
            if !said.is_empty() {
                table.row([&*escaped(source.service()), &*said.join(", ")]);
            }
        }
        text + &table.draw(2)
    }

    /// Frames that were received and are in no file.
    pub(super) fn unwritten(&self) -> u64 {
        self.sources.iter().map(|source| self.unwritten_of(source)).sum()
    }

    fn unwritten_of(&self, source: &Source<'_>) -> u64 {
        source.frames().saturating_sub(self.output.frames_of(source.service()))
    }

    /// For programs.
    pub(super) fn document(&self) -> Value {
        let service = |source: &Source<'_>| {
            let counters = source.counters();
            json!({
                "service": source.service(),
                "frames": self.output.frames_of(source.service()),
                "unwritten": self.unwritten_of(source),
                "lost": counters.lost,
                "restarts": counters.restarts,
                "other_writers": counters.other_writers,
                "layouts": source.layouts(),
            })
        };
        json!({
            "files": self.output.files,
            "frames": self.output.frames(),
            "unwritten_frames": self.unwritten(),
            "left_out": self.left_out,
            "is_complete": self.unwritten() == 0 && self.left_out.is_empty(),
            "services": self.sources.iter().map(service).collect::<Vec<_>>(),
        })
    }
}

/// How much was recorded, and what was not.
pub(super) fn sentence(sources: &[Source<'_>], frames: u64, unwritten: u64) -> String {
    let missed: u64 = sources.iter().map(|source| source.counters().lost).sum();
    let services = counted(sources.len(), "service");
    let lost = missed.saturating_add(unwritten);
    format!("{} of {services}, {lost} lost", counted(frames, "frame"))
}

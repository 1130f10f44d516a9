//! What was recorded, in the end.

use isochrone_engine::escaped;
use isochrone_report::Table;
use isochrone_timing::units::counted;
pub(super) use isochrone_timing::units::size;
use serde_json::{Value, json};

use super::output::{Output, WrittenFile};
use super::source::Source;

/// What was recorded.
pub(super) struct Summary<'a> {
    sources: &'a [Source],
    files: &'a [WrittenFile],
}

impl<'a> Summary<'a> {
    pub(super) fn new(sources: &'a [Source], output: &'a Output) -> Self {
        Self { sources, files: &output.files }
    }

    /// For people: one line, and one more for each service that has something to be said of it.
    pub(super) fn text(&self) -> String {
        let bytes = self.files.iter().map(|file| file.bytes).sum();
        let mut text = format!("{}, {}\n", sentence(self.sources), size(bytes));
        if let [_, .., last] = self.files {
            text += &format!("{} files, the last is {}\n", self.files.len(), last.path.display());
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
            let layouts = (source.layouts > 1).then(|| format!("{} layouts", source.layouts));
            let said: Vec<String> =
                [lost, restarts, others, layouts].into_iter().flatten().collect();
            if !said.is_empty() {
                table.row([&*escaped(&source.service), &*said.join(", ")]);
            }
        }
        text + &table.draw(2)
    }

    /// Frames that were received and are in no file.
    pub(super) fn unwritten(&self) -> u64 {
        let received: u64 = self.sources.iter().map(|source| source.frames).sum();
        received.saturating_sub(self.written())
    }

    fn written(&self) -> u64 {
        self.files.iter().map(|file| file.frames).sum()
    }

    /// For programs.
    pub(super) fn document(&self) -> Value {
        let service = |source: &Source| {
            let counters = source.counters();
            json!({
                "service": source.service,
                "frames": source.frames,
                "lost": counters.lost,
                "restarts": counters.restarts,
                "other_writers": counters.other_writers,
                "layouts": source.layouts,
            })
        };
        json!({
            "files": self.files,
            "frames": self.written(),
            "unwritten_frames": self.unwritten(),
            "is_complete": self.unwritten() == 0,
            "services": self.sources.iter().map(service).collect::<Vec<_>>(),
        })
    }
}

/// How much was received.
pub(super) fn sentence(sources: &[Source]) -> String {
    let frames: u64 = sources.iter().map(|source| source.frames).sum();
    let lost: u64 = sources.iter().map(|source| source.counters().lost).sum();
    let services = counted(sources.len(), "service");
    format!("{} of {services}, {lost} lost", counted(frames, "frame"))
}

//! The final summary of a recording.

use isochrone_engine::escaped;
use isochrone_report::Table;
use isochrone_timing::units::counted;
pub(super) use isochrone_timing::units::size;

use super::left_out::LeftOut;
use super::output::{Output, WrittenFile};
use super::source::Source;

/// The summary.
#[derive(serde::Serialize)]
pub(super) struct Summary<'a> {
    files: &'a [WrittenFile],
    frames: u64,
    /// Frames that were received and are in no file.
    pub(super) unwritten_frames: u64,
    left_out: &'a [LeftOut],
    is_complete: bool,
    services: Vec<ServiceRow<'a>>,
}

/// The summary of a service.
#[derive(serde::Serialize)]
struct ServiceRow<'a> {
    service: &'a str,
    frames: u64,
    unwritten: u64,
    lost: u64,
    restarts: u64,
    other_writers: u64,
    layouts: u64,
}

impl<'a> ServiceRow<'a> {
    fn of(source: &'a Source<'_>, output: &Output) -> Self {
        let (counters, frames) = (source.counters(), output.frames_of(source.service()));
        Self {
            service: source.service(),
            frames,
            unwritten: source.frames().saturating_sub(frames),
            lost: counters.lost,
            restarts: counters.restarts,
            other_writers: counters.other_writers,
            layouts: source.layouts(),
        }
    }

    /// Remarks on the service, if any.
    fn remarks(&self) -> Option<String> {
        let Self { unwritten, lost, restarts, other_writers: others, layouts, .. } = *self;
        let frames = |count| counted(count, "frame");
        let said = [
            (unwritten > 0).then(|| format!("{} received and not written", frames(unwritten))),
            (lost > 0).then(|| format!("{lost} lost")),
            (restarts > 0).then(|| counted(restarts, "restart").to_string()),
            (others > 0).then(|| format!("{} of other writers left out", frames(others))),
            (layouts > 1).then(|| format!("{layouts} layouts")),
        ];
        let said: Vec<String> = said.into_iter().flatten().collect();
        (!said.is_empty()).then(|| said.join(", "))
    }
}

impl<'a> Summary<'a> {
    pub(super) fn new(
        sources: &'a [Source<'a>],
        output: &'a Output,
        left_out: &'a [LeftOut],
    ) -> Self {
        let services: Vec<_> =
            sources.iter().map(|source| ServiceRow::of(source, output)).collect();
        let unwritten_frames = services.iter().map(|row| row.unwritten).sum();
        Self {
            files: &output.files,
            frames: output.frames(),
            unwritten_frames,
            left_out,
            is_complete: unwritten_frames == 0 && left_out.is_empty(),
            services,
        }
    }

    /// As text: one line, and one more for each service with a remark.
    pub(super) fn text(&self) -> String {
        let lost = self.services.iter().map(|row| row.lost).sum::<u64>();
        let lost = lost.saturating_add(self.unwritten_frames);
        let bytes = self.files.iter().map(|file| file.bytes).sum();
        let received = sentence(self.services.len(), self.frames, lost);
        let mut text = format!("{received}, {}\n", size(bytes));
        if let [_, .., last] = self.files {
            text += &format!("{} files, the last is {}\n", self.files.len(), last.path.display());
        }
        let mut table = Table::default();
        for row in &self.services {
            if let Some(remarks) = row.remarks() {
                table.row([&*escaped(row.service), &*remarks]);
            }
        }
        text + &table.draw(2)
    }
}

/// How much was recorded, and what was not.
pub(super) fn sentence(services: usize, frames: u64, lost: u64) -> String {
    let services = counted(services, "service");
    format!("{} of {services}, {lost} lost", counted(frames, "frame"))
}

//! The outputs of a bench.

use std::fs;
use std::path::{Path, PathBuf};

use isochrone_report::{
    Gate, Measurement, Report, Series, cyclictest_histogram, hgrm, hlog, html, pictures,
};
use isochrone_timing::{Unit, Warning, WarningCode};

use crate::base::failure::Failure;
use crate::base::files::{ResultFile, keep_apart};
use crate::base::gate;
use crate::base::terminal;

/// Which files to write, and which gate to pass.
#[derive(Clone, Debug, Default, clap::Args)]
// Its group would have the name of the verb's.
#[group(skip)]
pub(crate) struct Args {
    /// Print the report as JSON instead of the table
    #[arg(long)]
    json: bool,
    /// Write the report (JSON), which `isochrone compare` reads
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Write a self-contained report page (HTML)
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
    /// Write a percentile table for each arm, in the format of HdrHistogram's plotters
    #[arg(long, value_name = "FOLDER")]
    hgrm: Option<PathBuf>,
    /// Write an interval log of all turns, in the format of HdrHistogram's tools
    #[arg(long, value_name = "FILE.hlog")]
    hlog: Option<PathBuf>,
    /// Write the histogram in the format of `cyclictest --histogram`, with one column per arm
    #[arg(long, value_name = "FILE")]
    histogram: Option<PathBuf>,
    /// Write each chart of the page to its own SVG file
    #[arg(long, value_name = "FOLDER")]
    svg: Option<PathBuf>,
    /// Check the result against a gate (TOML): exit status 0 passed, 1 failed, 4 too little data
    #[arg(long, value_name = "FILE.toml")]
    gate: Option<PathBuf>,
}

/// Opened before the bench, so that the bench is not in vain.
pub(crate) struct Outputs {
    args: Args,
    report: Option<ResultFile>,
    html: Option<ResultFile>,
    hlog: Option<ResultFile>,
    histogram: Option<ResultFile>,
    gate: Option<GateFile>,
}

impl Args {
    /// Opens the files, makes the folders and reads the gate.
    pub(crate) fn open(&self) -> Result<Outputs, Failure> {
        keep_apart([&self.report, &self.html, &self.hlog, &self.histogram].into_iter().flatten())?;
        let open = |path: &Option<PathBuf>| path.as_deref().map(ResultFile::open).transpose();
        for folder in [&self.hgrm, &self.svg].into_iter().flatten() {
            fs::create_dir_all(folder).map_err(|error| {
                Failure::usage(format!("cannot make the folder {}: {error}", folder.display()))
            })?;
        }
        Ok(Outputs {
            report: open(&self.report)?,
            html: open(&self.html)?,
            hlog: open(&self.hlog)?,
            histogram: open(&self.histogram)?,
            gate: self.gate.as_deref().map(GateFile::read).transpose()?,
            args: self.clone(),
        })
    }
}

/// A gate and where it was read, which its messages name.
struct GateFile {
    path: PathBuf,
    gate: Gate,
}

impl GateFile {
    fn read(path: &Path) -> Result<Self, Failure> {
        Ok(Self { path: path.to_owned(), gate: gate::read(path)? })
    }
}

impl Outputs {
    /// Looks whether the gate names only arms that will be measured.
    pub(crate) fn check_arms(&self, arms: &[impl AsRef<str>]) -> Result<(), Failure> {
        let arms: Vec<&str> = arms.iter().map(AsRef::as_ref).collect();
        let Some(GateFile { path, gate }) = &self.gate else { return Ok(()) };
        gate.check_arms(&arms)
            .map_err(|error| Failure::usage(format!("{}: {error}", path.display())))
    }

    /// Compares the arms, writes everything, and says whether the gate holds. What cannot be written
    /// keeps nothing else from being written, nor the gate from being judged.
    pub(crate) fn write(mut self, report: &mut Report) -> Result<(), Failure> {
        if cfg!(debug_assertions) {
            report.warnings.push(Warning::new(
                WarningCode::DebugBuild,
                "this program was built for debugging; its figures are not those of a release",
            ));
        }
        report.compare_arms();
        let judged =
            self.gate.as_ref().map(|GateFile { path, gate }| gate::hold(path, gate, report));
        let files = self.write_files(report);
        let printed = if self.args.json {
            terminal::print_json(report)
        } else {
            terminal::print(&report.to_string())
        };
        judged.unwrap_or(Ok(())).and(files).and(printed)
    }

    /// Writes all files that can be written; the first failure.
    fn write_files(&mut self, report: &Report) -> Result<(), Failure> {
        let measured = report.measured();
        let mut done = Ok(());
        let mut note = |result: Result<(), Failure>| {
            if done.is_ok() {
                done = result;
            }
        };
        if let Some(file) = self.report.take() {
            note(file.write_report(report));
        }
        for (file, text) in
            [(self.html.take(), html as fn(&Report) -> String), (self.hlog.take(), hlog)]
        {
            if let Some(file) = file {
                note(file.write(&text(report)));
            }
        }
        if let Some(file) = self.histogram.take() {
            note(histogram(&measured).and_then(|text| file.write(&text)));
        }
        if let Some(folder) = &self.args.hgrm {
            let name = |measured: &Measurement| format!("{}.hgrm", file_name(&measured.label()));
            let tables =
                measured.iter().map(|arm| (name(arm), hgrm(&arm.distribution, arm.metric)));
            note(write_all(folder, tables));
        }
        if let Some(folder) = &self.args.svg {
            let name = |(shows, svg): (String, String)| (format!("{}.svg", file_name(&shows)), svg);
            note(write_all(folder, pictures(report).into_iter().map(name)));
        }
        done
    }
}

/// Times only: the cost of a block is below its unit.
fn histogram(measured: &[Measurement]) -> Result<String, Failure> {
    /// The most rows that anybody will look at.
    const MOST_US: u64 = 10_000;
    let times: Vec<(String, &Measurement)> = measured
        .iter()
        .filter(|measured| measured.metric.unit == Unit::Nanoseconds)
        .map(|measured| (measured.label(), measured))
        .collect();
    let series: Vec<Series<'_>> = times
        .iter()
        .map(|(name, measured)| Series { name, distribution: &measured.distribution })
        .collect();
    if series.is_empty() {
        return Err(Failure::found(
            "--histogram: cyclictest's form has microseconds, and this is none",
        ));
    }
    let longest_ns = series.iter().map(|series| series.distribution.quantile(1.0)).max();
    Ok(cyclictest_histogram(&series, (longest_ns.unwrap_or(0) / 1_000 + 1).min(MOST_US)))
}

fn write_all(
    folder: &Path,
    files: impl IntoIterator<Item = (String, String)>,
) -> Result<(), Failure> {
    files
        .into_iter()
        .try_for_each(|(name, text)| ResultFile::open(&folder.join(name))?.write(&text))
}

/// A label as the name of a file: letters, digits and dashes.
fn file_name(label: &str) -> String {
    let words = label.split(|c: char| !c.is_alphanumeric() && c != '.');
    words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join("-")
}

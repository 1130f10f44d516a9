//! Signals over time as one page: the picture, the values under the cursor, and a closer look at an interval.

use isochrone_scope::{Column, Decimation, Extremes};
use serde::Serialize;

use super::page::Page;
use crate::output::picture::{
    Axis, COLUMNS, ChartSignal, FIRST_COLUMN, Pane, Screen, SignalChart, signals_svg,
};

const SCRIPT: &str = include_str!("signals.js");

/// What the script reads. Times are in s, as the picture counts them; lengths in units of the picture.
#[derive(Serialize)]
struct Data<'a> {
    begin: f64,
    end: f64,
    left: i32,
    right: i32,
    width: u32,
    tasks: Vec<TaskRows>,
    signals: Vec<SignalValues<'a>>,
    panes: Vec<PaneOnPage>,
}

/// The rows of a task.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct TaskRows {
    begin: f64,
    period: f64,
    rows: u64,
    rows_per_bucket: u64,
}

#[derive(Serialize)]
struct SignalValues<'a> {
    name: &'a str,
    unit: &'a str,
    #[serde(rename = "type")]
    value_type: &'a str,
    task: usize,
    buckets: Vec<Bucket>,
}

/// The values of a bucket; nothing where none is finite, and a 1 behind them where some are not.
#[derive(Serialize)]
#[serde(untagged)]
enum Bucket {
    None,
    One(f64),
    Range(f64, f64),
    Partly(f64, f64, u8),
}

impl From<Column> for Bucket {
    fn from(Column { values, is_odd, .. }: Column) -> Self {
        match values {
            None => Self::None,
            Some(Extremes { low, high }) if is_odd => Self::Partly(low, high, 1),
            Some(Extremes { low, high }) if low == high => Self::One(low),
            Some(Extremes { low, high }) => Self::Range(low, high),
        }
    }
}

/// A pane of the picture: from the top to the bottom, and of its curves from the high end to the low one.
#[derive(Serialize)]
struct PaneOnPage {
    top: i32,
    bottom: i32,
    high: i32,
    low: i32,
    /// The least and the greatest value, or each of those that stand at equal distances.
    axis: Vec<f64>,
    levels: bool,
    /// Where the lines of the labels are.
    grid: Vec<i32>,
    traces: Vec<TraceOnPage>,
}

#[derive(Serialize)]
struct TraceOnPage {
    signal: usize,
    colour: String,
    dash: String,
}

impl From<Pane<'_>> for PaneOnPage {
    fn from(pane: Pane<'_>) -> Self {
        let ((high, low), grid) = (pane.inside(), pane.grid());
        let levels = matches!(pane.axis, Some(Axis::Levels(_)));
        let axis = match pane.axis {
            None => vec![],
            Some(Axis::Linear(Extremes { low, high })) => vec![low, high],
            Some(Axis::Levels(levels)) => levels,
        };
        let traces = pane.traces.iter().map(|trace| TraceOnPage {
            signal: trace.index,
            colour: trace.ink.css_colour(),
            dash: trace.ink.dash.map_or(String::new(), |(dash, gap)| format!("{dash} {gap}")),
        });
        let traces = traces.collect();
        Self { top: pane.top, bottom: pane.bottom, high, low, axis, levels, grid, traces }
    }
}

/// Writes signals over time as one self-contained page, without access to the network: the picture, and a script
/// that tells the values under the cursor and draws an interval larger.
pub fn signals_html(chart: &SignalChart) -> String {
    let mut page = Page::with_script(&chart.title, "Signals over time");
    page.markup("</header>\n<main>\n");
    page.markup("<figure class=\"signals\">\n");
    page.drawing(&signals_svg(chart));
    page.markup("<div id=\"cursor\" hidden></div>\n<div id=\"chosen\" hidden></div>\n</figure>\n");
    page.markup(
        "<p>Point at the picture to read values. Drag across it to see an interval larger; a double click or \
         <button id=\"all\" disabled>Show all</button> shows all of it again.</p>\n",
    );
    page.markup("<p><b id=\"time\">&nbsp;</b></p>\n");
    page.markup(
        "<div class=\"scroll\"><table>\n<thead><tr><th>signal</th><th class=\"n\">value</th>\
         <th class=\"n\">cycle of its task</th></tr></thead>\n<tbody>\n",
    );
    for ChartSignal { signal, .. } in &chart.signals {
        let cells = "</th><td class=\"n\"></td><td class=\"n\"></td></tr>\n";
        page.element("<tr><th scope=\"row\">", &signal.name, cells);
    }
    page.markup("</tbody>\n</table></div>\n");
    page.markup("<script type=\"application/json\" id=\"data\">");
    page.json(&data(chart));
    page.markup("</script>\n<script>\n");
    page.markup(SCRIPT);
    page.markup("</script>\n</main>\n</body>\n</html>\n");
    page.finish()
}

fn data(chart: &SignalChart) -> Data<'_> {
    let span = chart.span();
    let time_s = |ns| chart.time_ns(ns) / 1e9;
    let task = |it: &Decimation| TaskRows {
        begin: time_s(it.due_ns(0)),
        period: it.period_ns() as f64 / 1e9,
        rows: it.rows(),
        rows_per_bucket: it.rows_per_bucket(),
    };
    let signal = |it: &'_ ChartSignal| {
        let buckets = chart.tasks.get(it.task).map(|task| task.buckets(it.place));
        buckets.into_iter().flatten().map(Bucket::from).collect()
    };
    let signals = chart.signals.iter().map(|it| SignalValues {
        name: &it.signal.name,
        unit: &it.signal.unit,
        value_type: &it.signal.value_type,
        task: it.task,
        buckets: signal(it),
    });
    Data {
        begin: time_s(span.begin_ns),
        end: time_s(span.end_ns),
        left: FIRST_COLUMN,
        right: FIRST_COLUMN + COLUMNS,
        width: Screen::Wide.width(),
        tasks: chart.tasks.iter().map(task).collect(),
        signals: signals.collect(),
        panes: chart.panes().into_iter().map(PaneOnPage::from).collect(),
    }
}

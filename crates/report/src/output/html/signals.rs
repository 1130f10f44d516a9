//! Signals over time as one page: the picture, and the values under the cursor.

use isochrone_scope::{Column, Extremes};
use serde::Serialize;

use super::page::Page;
use crate::output::picture::{COLUMNS, FIRST_COLUMN, Screen, SignalChart, signals_svg};

const SCRIPT: &str = include_str!("signals.js");

/// What the script reads.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Data<'a> {
    names: Vec<&'a str>,
    units: Vec<&'a str>,
    types: Vec<&'a str>,
    buckets: Vec<Vec<Bucket>>,
    rows_per_bucket: u64,
    rows: u64,
    period_s: f64,
    left: i32,
    right: i32,
    width: u32,
}

/// The values of a bucket; nothing where none is finite.
#[derive(Serialize)]
#[serde(untagged)]
enum Bucket {
    None,
    One(f64),
    Range(f64, f64),
}

impl From<Column> for Bucket {
    fn from(column: Column) -> Self {
        match column.values {
            None => Self::None,
            Some(Extremes { low, high }) if low == high => Self::One(low),
            Some(Extremes { low, high }) => Self::Range(low, high),
        }
    }
}

/// Writes signals over time as one self-contained page, without access to the network: the picture, and a script
/// that tells the values under the cursor.
pub fn signals_html(chart: &SignalChart) -> String {
    let mut page = Page::with_script(&chart.title);
    page.markup("</header>\n<main>\n");
    page.markup("<figure class=\"signals\">\n");
    page.drawing(&signals_svg(chart));
    page.markup("<div id=\"cursor\" hidden></div>\n</figure>\n");
    page.markup("<p><b id=\"time\">Point at the picture to read values</b></p>\n");
    page.markup("<div class=\"scroll\"><table>\n<thead><tr><th>signal</th><th class=\"n\">value</th></tr></thead>\n<tbody>\n");
    for signal in &chart.signals {
        page.element("<tr><th scope=\"row\">", &signal.name, "</th><td class=\"n\"></td></tr>\n");
    }
    page.markup("</tbody>\n</table></div>\n");
    let signals = || chart.signals.iter();
    let of = |index| chart.data.buckets(index).map(Bucket::from).collect();
    let data = Data {
        names: signals().map(|it| it.name.as_str()).collect(),
        units: signals().map(|it| it.unit.as_str()).collect(),
        types: signals().map(|it| it.value_type.as_str()).collect(),
        buckets: (0..chart.signals.len()).map(of).collect(),
        rows_per_bucket: chart.data.rows_per_bucket(),
        rows: chart.data.rows(),
        period_s: chart.period_ns as f64 / 1e9,
        left: FIRST_COLUMN,
        right: FIRST_COLUMN + COLUMNS,
        width: Screen::Wide.width(),
    };
    page.markup("<script type=\"application/json\" id=\"data\">");
    page.json(&data);
    page.markup("</script>\n<script>\n");
    page.markup(SCRIPT);
    page.markup("</script>\n</main>\n</body>\n</html>\n");
    page.finish()
}

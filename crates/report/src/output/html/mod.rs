//! A report as one page that stands alone: tables, pictures, and how to read them.

mod about;
mod costs;
mod links;
mod loops;
mod page;
mod section;
mod signals;
mod turns;
mod verdict;

pub use page::{Page, Row, TableColumn};
pub use signals::signals_html;

use crate::report::Report;

/// Writes a report as one self-contained HTML page, without scripts and without access to the
/// network: tables, pictures, conditions, and how to read them.
pub fn html(report: &Report) -> String {
    write(report).finish()
}

/// The pictures of the page: what each shows, and its SVG.
pub fn pictures(report: &Report) -> Vec<(String, String)> {
    write(report).pictures
}

fn write(report: &Report) -> Page {
    let command = format!("isochrone {}", report.command.join(" "));
    let title = format!("{command} - {}", report.started);
    let mut page = Page::with_title(title, command.trim_end());
    let version = format!("Started {}, version {}.", report.started, report.isochrone);
    page.element("<p class=\"soft\">", version, "</p>\n");
    about::banner(&mut page, report);
    verdict::verdict(&mut page, report);
    page.markup("</header>\n<main>\n");
    if !loops::lead(&mut page, report) {
        links::lead(&mut page, report);
    }
    page.contents();
    about::warnings(&mut page, report);
    about::how_to_read(&mut page, report);
    loops::sections(&mut page, report);
    links::sections(&mut page, report);
    costs::section(&mut page, report);
    section::left_out(&mut page, &report.left_out);
    turns::invalid(&mut page, report);
    turns::outliers(&mut page, report);
    about::machine(&mut page, report);
    page.markup("</main>\n</body>\n</html>\n");
    page
}

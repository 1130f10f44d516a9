//! A report as one page that stands alone: tables, pictures, and how to read them.

mod about;
mod costs;
mod links;
mod loops;
mod page;
mod section;
mod turns;
mod verdict;

use page::Page;

use crate::report::Report;

const STYLE: &str = include_str!("page.css");
/// The page fetches nothing, and runs nothing, even if a text in it were ever taken for markup.
const HEAD: &str = "<!DOCTYPE html>
<html lang=\"en\">
<head>
<meta charset=\"utf-8\">
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">
<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">
";

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
    let mut page = Page::default();
    page.markup(HEAD);
    page.element("<title>", format!("{command} - {}", report.started), "</title>\n");
    page.markup("<style>\n");
    page.markup(STYLE);
    page.markup("</style>\n</head>\n<body>\n<header>\n");
    page.element("<h1>", command.trim_end(), "</h1>\n");
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

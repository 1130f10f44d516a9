//! Writes HTML. Markup comes from this program's own text, everything else is escaped.

use std::fmt::Display;

use crate::output::picture::Screen;

const STYLE: &str = include_str!("page.css");
/// The page fetches nothing, and runs nothing, even if a text in it were ever taken for markup.
const HEAD: &str = "<!DOCTYPE html>
<html lang=\"en\">
<head>
<meta charset=\"utf-8\">
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">
<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">
";

/// A page that stands alone, as far as it is written: tables and pictures, without scripts and without access to the
/// network. What comes from elsewhere is text and never markup.
#[derive(Default)]
pub struct Page {
    html: String,
    /// Where the contents go, once all headings are known.
    contents_at: Option<usize>,
    headings: Vec<String>,
    /// What each picture shows, and the picture.
    pub(super) pictures: Vec<(String, String)>,
}

/// A column of a table of a [`Page`].
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum TableColumn {
    /// Words: to the left.
    Words(&'static str),
    /// Numbers: to the right.
    Number(&'static str),
}

/// A row of a table of a [`Page`].
#[derive(Debug)]
pub struct Row {
    /// What the style sheet calls it; empty for most.
    pub(super) class: &'static str,
    pub(super) cells: Vec<String>,
}

impl Row {
    /// A row of these cells.
    pub fn of(cells: impl IntoIterator<Item = String>) -> Self {
        Self { class: "", cells: cells.into_iter().collect() }
    }
}

impl Page {
    /// A page up to its heading, which is also its title; what follows stands in its header.
    pub fn begin(title: impl Display) -> Self {
        Self::with_title(&title, &title)
    }

    /// A page with a title of its own, and a style sheet behind that of all pages.
    pub(super) fn with_title(title: impl Display, heading: impl Display) -> Self {
        let mut page = Self::default();
        page.markup(HEAD);
        page.element("<title>", title, "</title>\n");
        page.markup("<style>\n");
        page.markup(STYLE);
        page.markup("</style>\n</head>\n<body>\n<header>\n");
        page.element("<h1>", heading, "</h1>\n");
        page
    }

    /// A page of its own kind: a script that stands in this program may run, and nothing else.
    pub(super) fn with_script(title: impl Display) -> Self {
        let mut page = Self::with_title(&title, &title);
        let policy = "style-src 'unsafe-inline'";
        page.html =
            page.html.replacen(policy, "style-src 'unsafe-inline'; script-src 'unsafe-inline'", 1);
        page
    }

    /// Data for a script. Nothing in it ends the element that it stands in.
    pub(super) fn json(&mut self, data: &impl serde::Serialize) {
        // It has texts and finite numbers only, which JSON has.
        let text = serde_json::to_string(data).unwrap_or_default();
        self.html.push_str(&text.replace('<', "\\u003c"));
    }

    /// A picture that this crate drew, on its own.
    pub(super) fn drawing(&mut self, svg: &str) {
        self.drawn("alone", svg);
    }

    /// Markup: only what stands in this program.
    pub fn markup(&mut self, markup: &'static str) {
        self.html.push_str(markup);
    }

    /// A text from anywhere.
    pub fn text(&mut self, text: impl Display) {
        for c in text.to_string().chars() {
            match c {
                '&' => self.html.push_str("&amp;"),
                '<' => self.html.push_str("&lt;"),
                '>' => self.html.push_str("&gt;"),
                '"' => self.html.push_str("&quot;"),
                '\'' => self.html.push_str("&#39;"),
                // A document may not contain them.
                c if c.is_control() && c != '\n' => self.html.push('\u{fffd}'),
                c => self.html.push(c),
            }
        }
    }

    /// A text between an opening and a closing tag.
    pub fn element(&mut self, open: &'static str, text: impl Display, close: &'static str) {
        self.markup(open);
        self.text(text);
        self.markup(close);
    }

    /// The heading of a section, which the contents list.
    pub fn heading(&mut self, text: impl Display) {
        self.headings.push(text.to_string());
        self.html.push_str(&format!("<h2 id=\"s{}\">", self.headings.len()));
        self.text(text);
        self.markup("</h2>\n");
    }

    /// The place of the contents.
    pub fn contents(&mut self) {
        self.contents_at = Some(self.html.len());
    }

    /// A table; the first cell of a row is its heading. Without rows there is none.
    pub fn table(
        &mut self,
        caption: impl Display,
        columns: &[TableColumn],
        rows: impl IntoIterator<Item = Row>,
    ) {
        let mut rows = rows.into_iter().peekable();
        if rows.peek().is_none() {
            return;
        }
        self.markup("<div class=\"scroll\" tabindex=\"0\"><table>\n<caption>");
        self.text(caption);
        self.markup("</caption>\n<thead><tr>");
        for column in columns {
            match column {
                TableColumn::Words(name) => self.element("<th scope=\"col\">", name, "</th>"),
                TableColumn::Number(name) => {
                    self.element("<th scope=\"col\" class=\"n\">", name, "</th>")
                }
            }
        }
        self.markup("</tr></thead>\n<tbody>\n");
        for row in rows {
            match row.class {
                "" => self.markup("<tr>"),
                class => {
                    self.markup("<tr class=\"");
                    self.markup(class);
                    self.markup("\">");
                }
            }
            for (index, (cell, column)) in row.cells.iter().zip(columns).enumerate() {
                match (index, column) {
                    (0, _) => self.element("<th scope=\"row\">", cell, "</th>"),
                    (_, TableColumn::Words(_)) => self.element("<td>", cell, "</td>"),
                    (_, TableColumn::Number(_)) => self.element("<td class=\"n\">", cell, "</td>"),
                }
            }
            self.markup("</tr>\n");
        }
        self.markup("</tbody>\n</table></div>\n");
    }

    /// A picture that this crate drew, with what it shows for people who cannot see it: once for a
    /// wide screen and once for a narrow one, of which the style sheet shows one.
    pub(super) fn picture(&mut self, shows: &str, draw: impl Fn(Screen) -> String) {
        self.markup("<figure role=\"img\" aria-label=\"");
        self.text(shows);
        self.markup("\">\n");
        let wide = draw(Screen::Wide);
        self.drawn("wide", &wide);
        self.drawn("narrow", &draw(Screen::Narrow));
        self.markup("</figure>\n");
        self.pictures.push((shows.to_owned(), wide));
    }

    fn drawn(&mut self, class: &str, svg: &str) {
        // Within HTML an SVG needs no name space, and its height follows its width.
        let svg = svg.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1);
        self.html.push_str(&svg.replacen("<svg ", &format!("<svg class=\"{class}\" "), 1));
    }

    /// The page.
    pub fn finish(mut self) -> String {
        let Some(at) = self.contents_at.filter(|_| !self.headings.is_empty()) else {
            return self.html;
        };
        let after = self.html.split_off(at);
        self.markup("<nav aria-label=\"Contents\"><ul>\n");
        for (index, heading) in std::mem::take(&mut self.headings).iter().enumerate() {
            self.html.push_str(&format!("<li><a href=\"#s{}\">", index + 1));
            self.text(heading);
            self.markup("</a></li>\n");
        }
        self.markup("</ul></nav>\n");
        self.html + &after
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_cannot_become_markup() {
        let mut page = Page::default();
        page.text("<script>alert(\"a\" & 'b')</script>\u{0}");
        let expected =
            "&lt;script&gt;alert(&quot;a&quot; &amp; &#39;b&#39;)&lt;/script&gt;\u{fffd}";
        assert_eq!(page.finish(), expected);
    }

    #[test]
    fn a_table_without_rows_is_none() {
        let mut page = Page::default();
        page.table("nothing", &[TableColumn::Words("arm")], []);
        assert_eq!(page.finish(), "");
    }
}

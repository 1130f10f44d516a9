//! The files of the page, which the program carries in itself.

const HTML: &str = "text/html; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const PICTURE: &str = "image/svg+xml";

/// The file at a path, and its kind.
pub(super) fn find(path: &str) -> Option<(&'static str, &'static str)> {
    macro_rules! files {
        ($($path:literal, $kind:ident, $file:literal;)*) => {
            match path {
                $($path => Some(($kind, include_str!(concat!("page/", $file)))),)*
                _ => None,
            }
        };
    }
    files! {
        "/", HTML, "page.html";
        "/page.css", STYLE, "page.css";
        "/page.js", SCRIPT, "page.js";
        "/chart.js", SCRIPT, "chart.js";
        "/curves.js", SCRIPT, "curves.js";
        "/document.js", SCRIPT, "document.js";
        "/lists.js", SCRIPT, "lists.js";
        "/setting.js", SCRIPT, "setting.js";
        "/table.js", SCRIPT, "table.js";
        "/tasks.js", SCRIPT, "tasks.js";
        "/icon.svg", PICTURE, "icon.svg";
    }
}

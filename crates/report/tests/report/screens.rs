//! The page of a report in a browser, on a screen and on a phone.
//!
//! It needs Chromium. Without it the test skips itself, but not where `CI` is set.

use crate::made_up;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use isochrone_report::{Report, html};
use serde::Deserialize;

/// Text below this cannot be read at arm's length, in CSS pixels.
const LEGIBLE_PX: f64 = 11.0;

/// A box on the page, in CSS pixels from its upper left corner.
#[derive(Debug, Deserialize)]
struct Place {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

impl Place {
    fn lies_within(&self, width: f64, height: f64) -> bool {
        let has_area = self.right > self.left && self.bottom > self.top;
        has_area
            && self.left >= 0.0
            && self.top >= 0.0
            && self.right <= width
            && self.bottom <= height
    }
}

/// What the browser measured.
#[derive(Debug, Deserialize)]
struct Seen {
    /// Width of the part of the page that shows, without a scroll bar.
    width: f64,
    /// Width of all of the page.
    scroll_width: f64,
    verdict: Option<Place>,
    /// The first picture, as drawn.
    picture: Option<Place>,
    /// The smallest text of all pictures that show.
    smallest_text_px: f64,
    /// Texts of pictures that another covers, or that reach beyond their picture.
    hidden_texts: Vec<String>,
    /// Tables that reach beyond the page without a box to scroll in.
    loose_tables: usize,
    pictures: usize,
}

/// Measures the page in a frame of a size: a window of the browser cannot be as narrow as a phone.
const WRAPPER: &str = r#"<!DOCTYPE html><meta charset="utf-8"><body style="margin:0">
<iframe id="page" src="page.html" style="border:0;display:block" width="WIDTH" height="HEIGHT"></iframe>
<pre id="seen"></pre><script>
const place = e => { if (!e) return null; const b = e.getBoundingClientRect();
  return { left: b.left, top: b.top, right: b.right, bottom: b.bottom }; };
const overlap = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 &&
  Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 2;
document.getElementById("page").onload = () => {
  const page = document.getElementById("page").contentDocument;
  const view = page.defaultView;
  const shown = [...page.querySelectorAll("figure svg")].filter(e => e.getClientRects().length);
  const hidden = [];
  let smallest = Infinity;
  for (const svg of shown) {
    const frame = svg.getBoundingClientRect(), scale = frame.width / svg.viewBox.baseVal.width;
    const texts = [...svg.querySelectorAll("text")].map(e => ({ says: e.textContent.trim(),
      box: e.getBoundingClientRect(), px: parseFloat(view.getComputedStyle(e).fontSize) * scale }));
    texts.forEach((text, index) => {
      smallest = Math.min(smallest, text.px);
      const box = text.box;
      if (box.left < frame.left - 1 || box.right > frame.right + 1 || box.bottom > frame.bottom + 1 ||
        texts.slice(0, index).some(other => overlap(other.box, box))) hidden.push(text.says);
    });
  }
  const width = page.documentElement.clientWidth;
  const loose = [...page.querySelectorAll("table")].filter(table =>
    table.getBoundingClientRect().right > width + 1 && !(e =>
      e && view.getComputedStyle(e).overflowX === "auto" && e.getBoundingClientRect().right <= width
    )(table.closest(".scroll")));
  document.getElementById("seen").textContent = JSON.stringify({ width,
    scroll_width: Math.max(page.documentElement.scrollWidth, page.body.scrollWidth),
    verdict: place(page.getElementById("verdict")), picture: place(shown[0]),
    smallest_text_px: smallest, hidden_texts: hidden, loose_tables: loose.length,
    pictures: shown.length });
};
</script>"#;

fn chromium() -> Option<&'static str> {
    let runs = |program: &&str| {
        let version = Command::new(program).arg("--version").stderr(Stdio::null()).output();
        version.is_ok_and(|version| version.status.success())
    };
    let found = ["chromium", "chromium-browser", "google-chrome"].into_iter().find(runs);
    if found.is_none() {
        let why = "no chromium on the path; apt-get install chromium";
        assert!(std::env::var_os("CI").is_none(), "{why}");
        // Past the test harness, which keeps what tests that pass print to itself.
        let _ = writeln!(std::io::stderr(), "NOT TESTED: report pages in a browser: {why}");
    }
    found
}

fn see(browser: &str, report: &Report, width: u32, height: u32) -> Seen {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("page.html"), html(report)).unwrap();
    let wrapper = WRAPPER.replace("WIDTH", &width.to_string());
    let wrapper = wrapper.replace("HEIGHT", &height.to_string());
    let at = folder.path().join("wrapper.html");
    fs::write(&at, wrapper).unwrap();
    let dom = dump(browser, folder.path(), &at);
    let (_, seen) = dom.split_once("<pre id=\"seen\">").unwrap_or_else(|| panic!("{dom}"));
    let (seen, _) = seen.split_once("</pre>").unwrap();
    let seen = seen.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    serde_json::from_str(&seen).unwrap_or_else(|error| panic!("{error}: {seen}"))
}

/// The document as it stands once its script has run.
fn dump(browser: &str, folder: &Path, page: &Path) -> String {
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"])
        .args(["--disable-quic", "--no-first-run", "--disable-background-networking"])
        .args(["--disable-component-update", "--disable-sync", "--disable-extensions"])
        // Else each file is an origin of its own, and the script may not look into the frame.
        .arg("--allow-file-access-from-files")
        .arg("--window-size=1500,1100")
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg("--dump-dom")
        .arg(format!("file://{}", page.display()))
        // An ordinary user of a build machine may have no home to write to.
        .env("HOME", folder)
        .env("XDG_CONFIG_HOME", folder.join("config"))
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .env("XDG_RUNTIME_DIR", folder)
        .output()
        .unwrap();
    let (dom, log) = (output.stdout, String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{}: {log}", output.status);
    String::from_utf8(dom).unwrap()
}

#[track_caller]
fn assert_fits(seen: &Seen, height: u32) {
    let within = |place: &Option<Place>| {
        place.as_ref().is_some_and(|place| place.lies_within(seen.width, f64::from(height)))
    };
    assert!(within(&seen.verdict), "the verdict is not in the first screen: {seen:?}");
    assert!(within(&seen.picture), "the picture is not in the first screen: {seen:?}");
    assert!(seen.scroll_width <= seen.width, "the page scrolls sideways: {seen:?}");
    assert!(seen.smallest_text_px >= LEGIBLE_PX, "a text is too small: {seen:?}");
    assert!(seen.hidden_texts.is_empty(), "texts cover each other: {seen:?}");
    assert_eq!(seen.loose_tables, 0, "{seen:?}");
}

/// The report of a bench with as many verdicts as the first screen ever shows, and a long command.
fn bench() -> Report {
    let mut report = made_up::report();
    let more = ["--arms", "sleep,hybrid", "--turn", "1", "--html", "/tmp/report.html"];
    report.command.extend(more.map(str::to_owned));
    report
}

#[test]
fn the_first_screen_of_a_page_has_the_verdict_and_a_legible_picture_on_a_screen_and_a_phone() {
    let Some(browser) = chromium() else { return };
    for (width, height) in [(1400, 1000), (420, 900)] {
        let seen = see(browser, &bench(), width, height);
        assert_eq!(seen.pictures, 10, "one drawing of each picture shows: {seen:?}");
        assert_fits(&seen, height);
    }
}

#[test]
fn a_page_of_few_arms_and_one_in_a_window_between_the_two_sizes_are_as_legible() {
    let Some(browser) = chromium() else { return };
    let mut run = bench();
    run.tasks.truncate(1);
    run.links.clear();
    run.comparisons.clear();
    assert_fits(&see(browser, &run, 420, 900), 900);
    for width in [360, 700, 900] {
        assert_fits(&see(browser, &bench(), width, 1_100), 1_100);
    }
}

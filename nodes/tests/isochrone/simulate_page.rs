//! The page of `simulate --plot` in a browser: values under the cursor, and an interval drawn larger.

use crate::browser::Browser;
use isochrone_testing::{Domain, Plant};
use serde_json::Value;

/// 10,000 cycles of 1 ms: a value that rises by 1 each, and is no number once.
fn page(domain: &Domain) {
    let plant = Plant::new("rise").task("t", "1ms").column("a", "LREAL").with("unit = \"m\"");
    domain.write("rise.toml", plant.column("b", "BOOL").output("out", &["a", "b"]));
    let row = |cycle: u32| match cycle {
        2_500 => "NaN,0\n".into(),
        _ => format!("{cycle},{}\n", u32::from(cycle == 5_000)),
    };
    domain.write("in.csv", "a,b\n".to_owned() + &(0..10_000).map(row).collect::<String>());
    let simulate = "simulate rise.toml --inputs in.csv --output out.csv --plot rise.html";
    domain.run(simulate).expect_code(0);
}

/// A point at this part of the time that the picture shows.
fn at(browser: &Browser, part: f64) -> (f64, f64) {
    let point = browser.run(&format!(
        "const box = picture.getBoundingClientRect(); const scale = box.width / width; \
         return [box.left + (left + {part} * (right - left)) * scale, box.top + 150 * scale]"
    ));
    (point[0].as_f64().unwrap(), point[1].as_f64().unwrap())
}

fn point(browser: &Browser, part: f64) -> String {
    browser.mouse("mouseMoved", at(browser, part), 0);
    let read = "return document.querySelector('#time').innerText + ' | ' + \
        [...document.querySelectorAll('tbody tr')].map(it => it.innerText.replace(/\\t/g, ' ')).join(' | ')";
    browser.run(read).as_str().unwrap().into()
}

#[test]
fn the_page_tells_values_and_draws_an_interval_larger_until_a_double_click() {
    let domain = Domain::new();
    page(&domain);
    let Some(browser) = Browser::start(&domain) else { return };
    browser.resize(1100, 900);
    browser.open(&format!("file://{}", domain.path("rise.html").display()));

    // 10,000 rows are 2,500 buckets of 4.
    let says = "7 s … 7.003 s | a 7000 … 7003 m 7000 … 7003 | b FALSE 7000 … 7003";
    assert_eq!(point(&browser, 0.7001), says);
    assert_eq!(
        point(&browser, 0.2501),
        "2.5 s … 2.503 s | a 2501 … 2503 m, and NaN or infinite 2500 … 2503 | b FALSE 2500 … 2503"
    );

    // From 4.9 s to 5.1 s.
    browser.mouse("mousePressed", at(&browser, 0.49), 1);
    browser.mouse("mouseMoved", at(&browser, 0.51), 1);
    assert_eq!(browser.run("return chosen.hidden"), false, "the interval is marked");
    browser.mouse("mouseReleased", at(&browser, 0.51), 1);
    let view = browser.run("return [view.begin, view.end]");
    for (index, expected) in [4.9, 5.1].into_iter().enumerate() {
        assert!((view[index].as_f64().unwrap() - expected).abs() < 0.02, "{view}");
    }
    let labels =
        "return [...document.querySelectorAll('.zoomed text')].map(it => it.textContent).join(' ')";
    let labels = browser.run(labels).to_string();
    assert!(labels.contains("time in ms") && labels.contains("5000"), "{labels}");
    let part = browser.run("return (5.0011 - view.begin) / (view.end - view.begin)");
    assert_eq!(
        point(&browser, part.as_f64().unwrap()),
        "5 s … 5.003 s | a 5000 … 5003 m 5000 … 5003 | b FALSE … TRUE 5000 … 5003"
    );
    // The curves of the interval are drawn within the panes: one path each, from edge to edge.
    let drawn = browser.run(
        "return [...document.querySelectorAll('.zoomed path[stroke-width]')].map(it => it.getBBox())\
           .map(it => [Math.round(it.x) === left, Math.round(it.x + it.width) === right])",
    );
    assert_eq!(drawn, serde_json::json!([[true, true], [true, true]]));
    assert_eq!(browser.run("return all.disabled"), false);

    for clicks in [1, 2] {
        browser.mouse("mousePressed", at(&browser, 0.5), clicks);
        browser.mouse("mouseReleased", at(&browser, 0.5), clicks);
    }
    let all = "return [document.querySelector('.zoomed'), all.disabled, view.end === end]";
    assert_eq!(browser.run(all), serde_json::json!([null, true, true]));
    assert_eq!(point(&browser, 0.7001), says);
    assert_eq!(browser.complaints(), [] as [Value; 0]);
}

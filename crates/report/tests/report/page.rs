//! The page of a report.

use crate::made_up;
use isochrone_machine::{Cause, CheckResult, Severity};
use isochrone_report::{LinkArm, Outlier, Report, TaskArm, TurnReport, Verdict, hlog, html};
use isochrone_timing::{LinkReport, Summary, TaskReport, Warning};

/// The names of the elements that are open at the end, or what closes something else.
fn unbalanced(page: &str) -> Option<String> {
    const VOID: [&str; 5] = ["meta", "br", "!DOCTYPE", "hr", "img"];
    let mut open: Vec<&str> = Vec::new();
    for piece in page.split('<').skip(1) {
        let (tag, _) = piece.split_once('>')?;
        let name = tag.split([' ', '\n', '/']).find(|part| !part.is_empty()).unwrap_or_default();
        if tag.starts_with('/') {
            match open.pop() {
                Some(last) if last == name => {}
                other => return Some(format!("</{name}> closes {other:?}")),
            }
        } else if !tag.ends_with('/') && !VOID.contains(&name) {
            open.push(name);
        }
    }
    (!open.is_empty()).then(|| format!("{open:?} stay open"))
}

#[test]
fn the_page_of_a_bench_has_every_part_and_stands_alone() {
    let report = made_up::report();
    let page = html(&report);
    assert_eq!(unbalanced(&page), None);
    for outside in
        ["http:", "https:", "src=", "href=\"h", "href=\"/", "url(", "@import", "<script", "<link"]
    {
        assert!(!page.contains(outside), "{outside}");
    }
    for part in [
        "<h1>isochrone bench jitter --seconds 60</h1>",
        "2026-11-20T12:00:00Z, version 0.1.0",
        "Ended early",
        "run as root, or set rtprio 80",
        ">Release jitter, 1 ms, idle</h2>",
        ">Release jitter, 1 ms, cpu</h2>",
        ">One-way latency, 1000 Hz, 10 values</h2>",
        "<td>corrected</td>",
        "<td>valid</td>",
        "<td>age at release</td>",
        "<td>age at publish</td>",
        "<th scope=\"col\" class=\"n\">mean</th>",
        "virtual machine",
        "Invalid turns",
        "the host took 0.40 % of the CPU",
        "Largest outliers",
        "<td>steal</td>",
        "Time of one instance",
        "6.18.44",
        "ulimit -l unlimited",
        "1 other check passed",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // Two groups of loops and one of links with three pictures each, and the costs.
    for part in ["<figure ", "<svg class=\"wide\" ", "<svg class=\"narrow\" "] {
        assert_eq!(page.matches(part).count(), 10, "{part}");
    }
    assert_eq!(page.matches("<caption>Comparison of the ").count(), 3);
    let (_, outliers) = page.split_once("Largest outliers</h2>").unwrap();
    let (outliers, _) = outliers.split_once("</table>").unwrap();
    assert_eq!(outliers.matches("<th scope=\"row\">").count(), 20);
}

#[test]
fn no_text_of_a_report_becomes_markup() {
    let bad = "<script>alert('&')</script>".to_owned();
    let report = Report {
        isochrone: bad.clone(),
        command: vec![bad.clone()],
        started: bad.clone(),
        warnings: vec![Warning {
            code: bad.clone().into(),
            message: bad.clone(),
            remedy: bad.clone(),
        }],
        tasks: vec![TaskArm {
            task: TaskReport {
                name: bad.clone(),
                wake: bad.clone(),
                scheduler: bad.clone(),
                ..made_up::report().tasks.remove(0).task
            },
            load: bad.clone(),
            turns: vec![TurnReport { invalid: Some(bad.clone()), ..TurnReport::default() }],
            ..made_up::report().tasks.remove(0)
        }],
        links: vec![LinkArm {
            link: LinkReport { service: bad.clone(), ..LinkReport::default() },
            ..LinkArm::default()
        }],
        findings: vec![CheckResult {
            code: bad.clone(),
            severity: Severity::Problem,
            value: bad.clone(),
            details: vec![bad.clone()],
            source: bad.clone(),
            effect: bad.clone(),
            fix: Some(bad.clone()),
            inert: true,
            inert_why: Some(bad.clone()),
        }],
        ..Report::default()
    };
    let page = html(&report);
    assert!(!page.contains("<script"), "{page}");
    assert!(page.contains("&lt;script&gt;alert(&#39;&amp;&#39;)&lt;/script&gt;"));
    assert_eq!(unbalanced(&page), None);
}

#[test]
fn a_percentile_stands_on_the_page_only_where_the_samples_support_it() {
    let few = Summary { count: 12, p50: Some(7_000), max: Some(9_000), ..Summary::default() };
    let tasks = vec![TaskArm {
        task: TaskReport { release_jitter_ns: few, ..TaskReport::default() },
        ..TaskArm::default()
    }];
    let page = html(&Report { tasks, ..Report::default() });
    let row = "<td class=\"n\">12</td><td class=\"n\">7.00 us</td><td class=\"n\">–</td>\
        <td class=\"n\">–</td><td class=\"n\">–</td><td class=\"n\">–</td><td class=\"n\">9.00 us</td>";
    assert!(page.contains(row), "{page}");
}

#[test]
fn the_page_of_a_run_has_neither_turns_nor_comparisons() {
    let task =
        TaskArm { turns: Vec::new(), outliers: Vec::new(), ..made_up::report().tasks.remove(1) };
    let page = html(&Report { tasks: vec![task], ..Report::default() });
    assert!(page.contains("<td>execution</td>") && page.contains("Percentiles: "));
    for absent in ["Over time", "Invalid", "outliers", "Comparison of", "Ended early", "virtual"] {
        assert!(!page.contains(absent), "{absent}");
    }
}

#[test]
fn the_page_of_an_empty_report_is_a_page() {
    let page = html(&Report::default());
    assert_eq!(unbalanced(&page), None);
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
}

#[test]
fn the_log_of_a_bench_has_a_line_for_each_turn() {
    let report = made_up::report();
    let tasks = report.tasks.iter().map(|task| task.turns.len());
    let links = report.links.iter().map(|link| link.turns.len());
    let costs = report.costs.iter().map(|cost| cost.turns.len());
    let turns: usize = tasks.chain(links).chain(costs).sum();
    let lines = hlog(&report).lines().filter(|line| line.starts_with("Tag=")).count();
    assert_eq!((lines, turns), (264, 264));
}

#[test]
fn the_verdict_and_a_picture_come_before_everything_that_explains_them() {
    let page = html(&made_up::report());
    let place = |what: &str| page.find(what).unwrap_or_else(|| panic!("no {what}"));
    let verdict = place("times lower than sleep at p50");
    let picture = place("aria-label=\"Percentiles: release jitter, 1 ms, idle");
    assert!(verdict < picture && picture < place("<nav ") && picture < place("<details class"));
    assert_eq!(page.matches("Percentiles: release jitter, 1 ms, idle\">").count(), 1);
    for link in page.split("href=\"#").skip(1) {
        let (id, _) = link.split_once('"').unwrap();
        assert!(page.contains(&format!("id=\"{id}\"")), "{id}");
    }
}

#[test]
fn what_the_verdict_calls_the_same_is_not_said_to_be_so_many_times_lower() {
    let mut report = made_up::report();
    for (number, found) in report.comparisons.iter_mut().enumerate() {
        (found.ratio, found.low, found.high) = (13.0, 0.8, 170.0);
        let is_first = found.percentile == "p50";
        found.verdict = if is_first && number > 0 { Verdict::Better } else { Verdict::Same };
    }
    let page = html(&report);
    let (_, verdict) = page.split_once("<ul id=\"verdict\"").unwrap();
    let (verdict, _) = verdict.split_once("</ul>").unwrap();
    let lines: Vec<&str> = verdict.lines().filter(|line| line.starts_with("<li>")).collect();
    let both =
        "</b>: no demonstrable difference from sleep at p50; no demonstrable difference at p99";
    assert!(lines[0].contains(both), "{verdict}");
    let one = "</b>: 13.0 times lower than sleep at p50; no demonstrable difference at p99";
    assert!(lines[1].contains(one), "{verdict}");
}

#[test]
fn the_releases_of_one_stall_are_one_row_with_its_length_and_their_number() {
    let late = |at_s, late_ns| Outlier { at_s, late_ns, cause: Cause::Steal };
    let task = TaskArm {
        task: TaskReport { period_ns: 1_000_000, ..TaskReport::default() },
        outliers: vec![late(2.0, 5_000_000), late(2.001, 4_000_000), late(7.0, 3_000_000)],
        ..TaskArm::default()
    };
    let page = html(&Report { tasks: vec![task], ..Report::default() });
    let row = "<td class=\"n\">2.000 s</td><td class=\"n\">5.00 ms</td><td class=\"n\">2</td>";
    assert!(page.contains(row), "{page}");
    let (_, outliers) = page.split_once("Seconds count").unwrap();
    assert_eq!(outliers.split_once("</table>").unwrap().0.matches("scope=\"row\"").count(), 2);
    assert!(!outliers.contains("2.001 s"));
}

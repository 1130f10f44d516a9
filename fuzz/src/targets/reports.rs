//! Reports in JSON, and behind a zero a gate in TOML.

use isochrone_report::{
    ComparisonTable, Gate, Report, compare_reports, hlog, html, overall, pictures,
};

use crate::Target;

pub(crate) const TARGET: Target = Target { name: "reports", max_bytes: 16384, max_mib: 64, read };

fn read(bytes: &[u8]) {
    let mut parts = bytes.splitn(2, |byte| *byte == 0);
    let report = serde_json::from_slice::<Report>(parts.next().unwrap_or_default());
    let gate = parts.next().and_then(|gate| std::str::from_utf8(gate).ok()).map(toml::from_str);
    if let Some(Err(refused)) = &gate {
        assert!(!refused.to_string().is_empty());
    }
    let report = match report {
        Ok(report) => report,
        Err(refused) => return assert!(!refused.to_string().is_empty()),
    };
    let text = serde_json::to_string(&report).expect("what was read can be written");
    let again: Report = serde_json::from_str(&text).unwrap_or_else(|it| panic!("{it}\n{text}"));
    let text_again = serde_json::to_string(&again).expect("what was read can be written");
    assert_eq!(text_again, text, "it reads back as another report");
    assert!(!report.to_string().is_empty());
    assert!(html(&report).ends_with("</html>\n"));
    pictures(&report);
    hlog(&report);
    let compared = compare_reports(&report, &again);
    assert!(compared.differences.iter().all(|difference| !difference.is_empty()));
    let _ = (ComparisonTable(&compared.comparisons).to_string(), overall(&compared.comparisons));
    compared.left_out.iter().for_each(|left_out| assert!(!left_out.why.is_empty()));
    if let Some(Ok::<Gate, _>(gate)) = gate {
        gate.judge(&report).iter().for_each(|judgement| assert!(!judgement.says.is_empty()));
    }
}

//! The file, from its text to what it says.

use std::time::Duration;

use isochrone_engine::{Diagnostic, Diagnostics as Wrong, Problem, Source};
use toml::de::DeTable;

use super::bases::Bases;
use super::from_ros::from_ros;
use super::table::{Errors, Table, Text, tables};
use super::to_ros::to_ros;
use super::{Config, Diagnostics};
use crate::names;

/// The highest domain of DDS whose ports are no others.
pub(crate) const MOST_DOMAIN: u32 = 232;

/// Reads the file: what it says, and what it is to be warned of.
pub(crate) fn read(source: Source, bases: &mut Bases) -> Result<(Config, Option<Wrong>), Wrong> {
    let text = source.text.clone();
    let (document, syntax) = DeTable::parse_recoverable(&text);
    if !syntax.is_empty() {
        let diagnostic = |error: &toml::de::Error| {
            Diagnostic::new(Problem::Syntax, error.span().unwrap_or_default(), error.message())
        };
        return Err(Wrong::new(source, syntax.iter().map(diagnostic).collect()));
    }
    let errors = Errors::default();
    let config = config(document.get_ref(), bases, &errors);
    let all = errors.into_all();
    let is_wrong = all.iter().any(|diagnostic| !diagnostic.is_warning());
    let wrong = (!all.is_empty()).then(|| Wrong::new(source, all));
    match wrong {
        Some(wrong) if is_wrong => Err(wrong),
        warnings => Ok((config, warnings)),
    }
}

fn config(file: &DeTable<'_>, bases: &mut Bases, errors: &Errors) -> Config {
    let known = ["ros2", "to_ros", "from_ros", "parameters", "diagnostics"];
    let top = Table::new("the file", &known, file, 0..0, errors);
    let mut config = Config { domain: bases.domain, ..Config::default() };
    let section = |title, key: &str, keys: &[&str]| {
        let entry = top.get(key)?;
        let Some(table) = entry.get_ref().as_table() else {
            top.report(Problem::WrongType, entry.span(), &format!("{title} is a table"), "");
            return None;
        };
        Some(Table::new(title, keys, table, entry.span(), errors))
    };
    let keys = ["node", "namespace", "domain", "local", "msg_path"];
    let ros2 = section("[ros2]", "ros2", &keys);
    let text = |key| ros2.as_ref().and_then(|table| table.text(key));
    let [node, namespace] = [text("node"), text("namespace")];
    let named = |given: &Option<String>, written: Option<Text>, default: &str| {
        let name = given.clone().map(|text| Text { text, span: 0..0 }).or(written);
        name.unwrap_or(Text { text: default.into(), span: 0..0 })
    };
    let node = named(&bases.node, node, "isochrone");
    let namespace = named(&bases.namespace, namespace, "/");
    if let Err(bad) = names::check(&format!("/{}", node.text)) {
        let message = format!("\"{}\" is no name of a node: {}", node.text, bad.problem);
        let help = format!("write node = \"{}\"", bad.suggestion.trim_start_matches('/'));
        top.report(Problem::BadName, node.span.clone(), &message, &help);
    }
    if namespace.text != "/"
        && let Err(bad) = names::check(&namespace.text)
    {
        let message = format!("\"{}\" is no namespace: {}", namespace.text, bad.problem);
        let help = format!("write namespace = \"{}\"", bad.suggestion);
        top.report(Problem::BadName, namespace.span.clone(), &message, &help);
    }
    config.node = node.text;
    config.namespace = namespace.text;
    if let Some(ros2) = &ros2 {
        config.is_local = ros2.truth("local");
        if let Some(domain) = ros2.whole("domain", 0, MOST_DOMAIN) {
            config.domain = domain as u16;
        }
        for path in ros2.texts("msg_path").unwrap_or_default() {
            if let Err(error) = bases.definitions.add_folder(&bases.folder.join(&path.text)) {
                ros2.report(Problem::OutOfRange, path.span, &error.to_string(), "");
            }
        }
    }
    let keys = [
        "service", "topic", "type", "fields", "names", "rate", "on_bad", "quality", "qos", "depth",
    ];
    for table in tables("[[to_ros]]", "to_ros", &keys, file, errors) {
        config.to_ros.extend(to_ros(&table, bases, &config));
    }
    let keys = ["topic", "type", "service", "fields", "names", "max_gap", "qos", "depth"];
    for table in tables("[[from_ros]]", "from_ros", &keys, file, errors) {
        if let Some(from_ros) = from_ros(&table, bases, &config) {
            config.from_ros.push(from_ros);
        }
    }
    for table in tables("[[parameters]]", "parameters", &["node"], file, errors) {
        let Some(node) = table.wanted("node", "level") else { continue };
        if config.parameters.contains(&node.text) {
            let message = format!("the parameters of \"{}\" are there already", node.text);
            table.report(Problem::Duplicate, node.span, &message, "");
        } else if let Some((_, name)) = node.text.rsplit_once('/') {
            let message = format!(
                "\"{}\" is no control node: it is named as in its own file under [node], without slashes",
                node.text
            );
            let help = format!("write node = \"{}\"", if name.is_empty() { "level" } else { name });
            table.report(Problem::BadName, node.span, &message, &help);
        } else if let Err(bad) = names::check(&format!("/{}", node.text)) {
            let message = format!("\"{}\" is no name of a node of ROS: {}", node.text, bad.problem);
            table.report(Problem::BadName, node.span, &message, "");
        } else {
            config.parameters.push(node.text);
        }
    }
    if let Some(table) = section("[diagnostics]", "diagnostics", &["nodes", "rate"]) {
        let nodes = table.texts("nodes").unwrap_or_default();
        let rate = table.number("rate", 0.01, 10.0).unwrap_or(1.0);
        config.diagnostics = Some(Diagnostics {
            nodes: nodes.into_iter().map(|node| node.text).collect(),
            interval: Duration::from_secs_f64(1.0 / rate),
        });
    }
    let has_nothing = config.to_ros.is_empty()
        && config.from_ros.is_empty()
        && config.parameters.is_empty()
        && config.diagnostics.is_none();
    if has_nothing && known[1..].iter().all(|key| top.get(key).is_none()) {
        let message = "the file says nothing to do";
        let help = "write [[to_ros]] with service = \"plant/level\", or [[from_ros]]";
        top.report(Problem::MissingKey, 0..0, message, help);
    }
    config
}

//! `[node]`: its name, what may be done to it, and what it retains.

use isochrone_model::Access;
use toml::Spanned;

use super::section::Section;
use crate::Diagnostic;
use crate::config::{OnDamaged, OnWarmStart, Retain};
use crate::diagnostic::Problem;
use crate::keys::{Key, file, node as keys};

/// The one name that no node may have.
const LAYOUT: &str = "layout";

/// `[node]` as written.
#[derive(Debug, Default)]
pub(super) struct Node {
    pub(super) name: Option<Spanned<String>>,
    pub(super) control: Access,
    pub(super) retain: Option<Retain>,
}

pub(super) fn node(file: &Section<'_>) -> Node {
    let Some(section) = file.table(&file::NODE, &keys::TABLE) else {
        if file.get(&file::NODE).is_none() {
            let diagnostic = Diagnostic::new(Problem::MissingKey, 0..0, "the file has no [node]");
            file.report(diagnostic.help("begin with [node] and name = \"…\""));
        }
        return Node::default();
    };
    let name = section.name(&keys::NAME);
    if let Some(name) = name.as_ref().filter(|name| name.get_ref() == LAYOUT) {
        let message = format!("[node] name \"{LAYOUT}\" is taken");
        let help = "layouts of frames are announced on isochrone/layout/…; choose another name";
        section.report(Diagnostic::new(Problem::BadName, name.span(), message).help(help));
    }
    let control = section.choice(&keys::CONTROL, &Access::ALL);
    let control = control.map_or_else(Access::default, Spanned::into_inner);
    Node { name, control, retain: retain(&section, control) }
}

fn retain(section: &Section<'_>, control: Access) -> Option<Retain> {
    let usual = Retain::default();
    let retain = Retain {
        for_ns: section.duration_ns(&keys::RETAIN_FOR).map_or(usual.for_ns, Spanned::into_inner),
        every_ns: section
            .duration_ns(&keys::RETAIN_EVERY)
            .map_or(usual.every_ns, Spanned::into_inner),
        on_damaged: section
            .choice(&keys::ON_DAMAGED, &OnDamaged::ALL)
            .map_or(usual.on_damaged, Spanned::into_inner),
        on_warm_start: section
            .choice(&keys::WARM_START, &OnWarmStart::ALL)
            .map_or(usual.on_warm_start, Spanned::into_inner),
    };
    if section.truth(&keys::RETAIN).is_some_and(Spanned::into_inner) {
        if let Some(written) = section.get(&keys::WARM_START)
            && retain.on_warm_start == OnWarmStart::Confirm
            && control < Access::Set
        {
            let control = control.as_str();
            let message = format!("control = \"{control}\" lets nobody start the node");
            let help = "write control = \"set\", or leave out warm_start = \"confirm\"";
            let diagnostic = Diagnostic::new(Problem::Conflict, written.span(), message);
            section.report(diagnostic.help(help));
        }
        return Some(retain);
    }
    let others: [&'static Key; 4] =
        [&keys::RETAIN_FOR, &keys::RETAIN_EVERY, &keys::ON_DAMAGED, &keys::WARM_START];
    for key in others {
        if let Some(written) = section.get(key) {
            let message = format!("[node] {} is for a node that retains its state", key.name);
            let help = format!("write retain = true, or leave {} out", key.name);
            section.report(Diagnostic::new(Problem::Conflict, written.span(), message).help(help));
        }
    }
    None
}

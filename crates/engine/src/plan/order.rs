//! In what order blocks step: a block's depth is the longest path of wires that leads to it.

use std::collections::{HashMap, HashSet};

use isochrone_blocks::BlockType;

use super::names::Names;
use super::wires::{Origin, Wire, Wiring};
use crate::Diagnostic;
use crate::diagnostic::Problem;

/// Depth of every instance. Loops are reported, one diagnostic for each.
pub(super) fn depths(
    names: &Names<'_>,
    wiring: &Wiring,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<usize> {
    let instances = names.instances();
    let orders = |wire: &&Wire| producer(names, wire).is_some();
    let mut readers = vec![Vec::new(); instances];
    let mut waiting = vec![0usize; instances];
    for wire in wiring.wires.iter().filter(orders) {
        let from = producer(names, wire).unwrap_or_default();
        readers[from].push(wire.to_instance);
        waiting[wire.to_instance] += 1;
    }
    let mut depths = vec![0; instances];
    let mut ready: Vec<usize> = (0..instances).filter(|instance| waiting[*instance] == 0).collect();
    let mut unordered = 0;
    let mut reported = HashSet::new();
    loop {
        while let Some(instance) = ready.pop() {
            for &reader in &readers[instance] {
                depths[reader] = depths[reader].max(depths[instance] + 1);
                // A reader on a loop that was cut is done before all its producers are.
                waiting[reader] = waiting[reader].saturating_sub(1);
                if waiting[reader] == 0 {
                    ready.push(reader);
                }
            }
            readers[instance].clear();
        }
        // Whatever still waits is on a loop or behind one.
        while waiting.get(unordered) == Some(&0) {
            unordered += 1;
        }
        if unordered == instances {
            return depths;
        }
        let cut = report_loop(names, wiring, &waiting, unordered, &mut reported, diagnostics);
        waiting[cut] = 0;
        ready.push(cut);
    }
}

/// The instance in the same task whose step must come before a wire's reader.
fn producer(names: &Names<'_>, wire: &Wire) -> Option<usize> {
    let Origin::Pin { instance, .. } = wire.from else { return None };
    let task = |instance| names.entry_of(instance).and_then(|entry| entry.task);
    (!wire.previous && task(instance) == task(wire.to_instance)).then_some(instance)
}

/// Walks back along the wires from an instance that waits until the walk meets itself; reports the
/// loop and returns an instance on it. A wire that closes a loop in each instance of its block is
/// reported once.
fn report_loop(
    names: &Names<'_>,
    wiring: &Wiring,
    waiting: &[usize],
    from: usize,
    reported: &mut HashSet<usize>,
    diagnostics: &mut Vec<Diagnostic>,
) -> usize {
    let mut path: Vec<&Wire> = Vec::new();
    let mut visited = HashMap::new();
    let mut at = from;
    let start = loop {
        let back = wiring
            .wires_to(at)
            .iter()
            .find(|wire| producer(names, wire).is_some_and(|producer| waiting[producer] > 0));
        // An instance that waits has a producer that waits.
        let Some(wire) = back else { return at };
        visited.insert(at, path.len());
        path.push(wire);
        at = producer(names, wire).unwrap_or(at);
        if let Some(start) = visited.get(&at) {
            break *start;
        }
    };
    let on_loop = path.get(start..).unwrap_or_default();
    let span = on_loop.first().map_or(0..0, |wire| wire.span.clone());
    if !reported.insert(span.start) {
        return at;
    }
    let mut blocks: Vec<String> =
        on_loop.iter().rev().map(|wire| names.instance_name(wire.to_instance)).collect();
    blocks.insert(0, names.instance_name(at));
    let is_expr = |known: &BlockType| known.formulas().is_some();
    let block_type = names.entry_of(at).and_then(|entry| entry.block_type);
    let help = if on_loop.len() == 1 && block_type.as_ref().is_some_and(is_expr) {
        "all outputs of an Expr are computed together: name its own with @prev, or use another Expr"
    } else {
        "one wire of a loop must say \"block.pin@prev\": the value of the cycle before"
    };
    let message = format!("loop: {}", blocks.join(" -> "));
    diagnostics.push(Diagnostic::new(Problem::Loop, span, message).help(help));
    at
}

//! The quality of values that are read: the flags of everything that they are computed from.

use std::collections::HashMap;
use std::ops::Range;

use isochrone_blocks::Indication;
use isochrone_engine::orders::{ErrorPin, Evidence};
use isochrone_model::{Flags, Role};

use super::signals::Signals;

/// The most instances that a reading looks through. The cycle reads a pin of each, which should not cost more than
/// reading the most values of one request.
const MOST: usize = 4_096;

/// What values of one task are computed from. The cycle reports the flags of the sources and the blocks with errors;
/// what follows from that for each value is worked out here.
#[derive(Debug)]
pub(super) struct Behind {
    /// Indices of sources in the engine.
    sources: Box<[u32]>,
    instances: Box<[Instance]>,
    /// The wires from sources and instances to instances.
    steps: Box<[Step]>,
    /// One for each value that is read.
    targets: Box<[Target]>,
}

#[derive(Debug)]
struct Instance {
    /// Its slots, and how many of them are input pins.
    slots: Range<usize>,
    inputs: usize,
    indication: Option<Indication>,
}

/// A wire.
#[derive(Debug)]
struct Step {
    from: Node,
    from_slot: usize,
    to: usize,
}

/// What has flags.
#[derive(Debug, Clone, Copy)]
enum Node {
    Source(usize),
    Instance(usize),
    /// It has no flag but that of a force.
    Variable,
}

#[derive(Debug)]
struct Target {
    slot: usize,
    /// `None`: it depends on nothing.
    node: Option<(Node, usize)>,
}

impl Behind {
    /// Finds what these slots of a task are computed from; `None` if that is too much to look through.
    pub(super) fn of(signals: &Signals, task: usize, slots: &[usize]) -> Option<Self> {
        let mut search = Search {
            signals,
            task,
            sources: Vec::new(),
            instances: Vec::new(),
            steps: Vec::new(),
            places: HashMap::new(),
        };
        let target = |slot: &usize| {
            let target = search.target(*slot);
            (!search.is_too_much()).then_some(target)
        };
        let targets = slots.iter().map(target).collect::<Option<Box<_>>>()?;
        let mut next = 0;
        while let Some(instance) = search.instances.get(next) {
            let inputs = instance.slots.start..instance.slots.start + instance.inputs;
            for (from_slot, _) in signals.wires_to(task, inputs) {
                if let Some(from) = search.node(from_slot) {
                    search.steps.push(Step { from, from_slot, to: next });
                }
            }
            if search.is_too_much() {
                return None;
            }
            next += 1;
        }
        let Search { sources, instances, mut steps, .. } = search;
        // Wires lead forward in the image, except those that carry values of the previous cycle.
        steps.sort_unstable_by_key(|step| step.from_slot);
        let (sources, instances, steps) = (sources.into(), instances.into(), steps.into());
        Some(Self { sources, instances, steps, targets })
    }

    /// The request to the cycle: the flags of the sources and the error pins of the instances, both in the order that
    /// they have here.
    pub(super) fn evidence(&self) -> Evidence {
        let pin = |instance: &Instance| {
            let indication = instance.indication?;
            let slot = instance.slots.start + indication.place();
            Some(ErrorPin { slot, indication, has_error: false })
        };
        Evidence {
            sources: self.sources.iter().map(|place| (*place, Flags::NONE)).collect(),
            errors: self.instances.iter().filter_map(pin).collect(),
            is_known: false,
        }
    }

    /// The flags of each value; `None` if the cycle reported none. `is_forced` tells which slots were forced in the
    /// cycle.
    pub(super) fn flags(
        &self,
        evidence: &Evidence,
        is_forced: impl Fn(Range<usize>) -> bool,
    ) -> Option<Vec<Flags>> {
        if !evidence.is_known {
            return None;
        }
        let forced = |slots| if is_forced(slots) { Flags::FORCED } else { Flags::NONE };
        let mut errors = evidence.errors.iter();
        let own = |instance: &Instance| {
            let start = instance.slots.start;
            let pin = instance.indication.and_then(|_| errors.next());
            let has_error = pin.is_some_and(|pin| pin.has_error);
            let error = if has_error { Flags::ERROR } else { Flags::NONE };
            error | forced(start..start + instance.inputs)
        };
        let mut of: Vec<Flags> = self.instances.iter().map(own).collect();
        let at = |of: &[Flags], node: Node, slot: usize| {
            let flags = match node {
                Node::Source(place) => evidence.sources.get(place).map(|(_, flags)| *flags),
                Node::Instance(place) => of.get(place).copied(),
                Node::Variable => None,
            };
            flags.unwrap_or(Flags::NONE) | forced(slot..slot + 1)
        };
        let mut has_news = true;
        while has_news {
            has_news = false;
            for Step { from, from_slot, to } in &self.steps {
                let flags = at(&of, *from, *from_slot);
                let Some(known) = of.get_mut(*to) else { continue };
                has_news |= !known.contains(flags);
                *known |= flags;
            }
        }
        let target = |Target { slot, node }: &Target| {
            let flags = node.map_or(Flags::NONE, |(node, slot)| at(&of, node, slot));
            flags | forced(*slot..slot + 1)
        };
        Some(self.targets.iter().map(target).collect())
    }
}

struct Search<'s> {
    signals: &'s Signals,
    task: usize,
    sources: Vec<u32>,
    instances: Vec<Instance>,
    steps: Vec<Step>,
    /// Sources by their place in the engine, instances by their first slot behind all of those.
    places: HashMap<(bool, usize), usize>,
}

impl Search<'_> {
    fn is_too_much(&self) -> bool {
        self.instances.len() > MOST
    }

    fn target(&mut self, slot: usize) -> Target {
        let node = match self.signals.at(self.task, slot).map(|signal| signal.role) {
            Some(Role::Input | Role::Output) => self.node(slot).map(|node| (node, slot)),
            Some(Role::Wired) => {
                let mut wires = self.signals.wires_to(self.task, slot..slot + 1);
                let from = wires.next().map(|(from, _)| from);
                from.and_then(|from| Some((self.node(from)?, from)))
            }
            // `ok` and `age` of an input, and what operators give, are always good themselves.
            Some(Role::Ok | Role::Age | Role::Variable | Role::Parameter) | None => None,
        };
        Target { slot, node }
    }

    /// What gives a slot its value.
    fn node(&mut self, slot: usize) -> Option<Node> {
        if let Some(source) = self.signals.source_at(self.task, slot) {
            let place = *self.places.entry((true, source)).or_insert(self.sources.len());
            if place == self.sources.len() {
                self.sources.push(source as u32);
            }
            return Some(Node::Source(place));
        }
        if self.signals.is_variable(self.task, slot) {
            return Some(Node::Variable);
        }
        let (slots, inputs, indication) = self.signals.pins_of(self.task, slot)?;
        let place = *self.places.entry((false, slots.start)).or_insert(self.instances.len());
        if place == self.instances.len() {
            self.instances.push(Instance { slots, inputs, indication });
        }
        Some(Node::Instance(place))
    }
}

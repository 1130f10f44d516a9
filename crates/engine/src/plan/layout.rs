//! The layout of the process images.

use std::collections::{BTreeMap, HashMap};

use isochrone_blocks::PinType;
use toml::Spanned;

use super::labels::Labels;
use super::names::{Entry, Names};
use super::wires::{Origin, Wire, Wiring};
use super::{
    AlarmPlan, BankPlan, InputPlan, Instances, LinkPlan, OutputPlan, SignalPlan, TaskPlan,
    Upstream, VariablePlan, WirePlan,
};
use crate::config::{self, Config};

/// Most instances of a bank. The wires of a bank are copied just before it steps, so its slots
/// (at most 24 of 8 bytes each) should still be in the first-level cache when it does.
const BANK_INSTANCES: usize = 128;

/// Lays out the images of a configuration without errors.
pub(super) fn lay_out(
    config: &Config,
    names: &Names<'_>,
    (wiring, labels): (&Wiring, &Labels<'_>),
    depths: &[usize],
) -> (Vec<TaskPlan>, Vec<LinkPlan>) {
    let mut layout = Layout {
        names,
        wiring,
        tasks: config.tasks.iter().map(task_plan).collect(),
        input_places: vec![(0, 0); config.inputs.len()],
        variable_places: vec![(0, 0); config.variables.len()],
        first_slots: vec![0; names.instances()],
        places: vec![(0, 0); names.instances()],
        links: BTreeMap::new(),
    };
    layout.place_inputs(config);
    layout.place_variables(config);
    layout.place_imports();
    let banks = layout.place_banks(depths);
    layout.alarms(config);
    layout.wire(&banks);
    layout.outputs(config, labels);
    layout.finish()
}

fn task_plan(task: &config::Task) -> TaskPlan {
    TaskPlan {
        name: task.name.as_ref().map(|name| name.get_ref().clone()).unwrap_or_default(),
        settings: task.settings.clone(),
        inputs: Vec::new(),
        variables: Vec::new(),
        outputs: Vec::new(),
        banks: Vec::new(),
        alarms: Vec::new(),
        previous: Vec::new(),
        image: Vec::new(),
    }
}

/// A link that is being filled.
#[derive(Default)]
struct LinkDraft {
    origins: Vec<Origin>,
    positions: HashMap<Origin, usize>,
    first_slot: usize,
}

struct Layout<'a> {
    names: &'a Names<'a>,
    wiring: &'a Wiring,
    tasks: Vec<TaskPlan>,
    /// Task of every input, and its index there.
    input_places: Vec<(usize, usize)>,
    /// Task of every variable, and its index there.
    variable_places: Vec<(usize, usize)>,
    /// First slot of every instance in its task's image.
    first_slots: Vec<usize>,
    /// Bank of every instance in its task, and its place there.
    places: Vec<(usize, usize)>,
    /// Links by reader and producer.
    links: BTreeMap<(usize, usize), LinkDraft>,
}

impl Layout<'_> {
    fn place_inputs(&mut self, config: &Config) {
        for (index, input) in config.inputs.iter().enumerate() {
            let Some(name) = &input.name else { continue };
            let Some(known) = self.names.inputs.get(name.get_ref().as_str()) else { continue };
            let (Some(task), Some(value_type)) = (known.task, known.value_type) else { continue };
            let plan = &mut self.tasks[task];
            let default = input.default.as_ref().map_or(0.0, |default| *default.get_ref());
            self.input_places[index] = (task, plan.inputs.len());
            plan.image.push(default);
            plan.inputs.push(InputPlan {
                name: name.get_ref().clone(),
                value_type,
                service: input.service.as_ref().map(|service| service.get_ref().clone()),
                binding: input.binding.clone(),
                default,
                range: input.range,
                finite: input.finite,
                max_age_ns: input.max_age_ns,
                on_stale: input.on_stale,
                bad: input.bad,
                feedback: input.feedback.as_ref().is_some_and(|feedback| *feedback.get_ref()),
                unit: input.unit.clone().unwrap_or_default(),
                comment: input.comment.clone().unwrap_or_default(),
                span: name.span(),
            });
        }
        for plan in &mut self.tasks {
            let inputs = plan.inputs.len();
            plan.image.extend(std::iter::repeat_n(0.0, inputs));
            plan.image.extend(std::iter::repeat_n(f64::INFINITY, inputs));
        }
    }

    fn place_variables(&mut self, config: &Config) {
        for (index, variable) in config.variables.iter().enumerate() {
            let Some(name) = &variable.name else { continue };
            let Some(known) = self.names.variables.get(name.get_ref().as_str()) else { continue };
            let (Some(task), Some(value_type)) = (known.task, known.value_type) else { continue };
            let plan = &mut self.tasks[task];
            let initial = variable.initial.as_ref().map_or(0.0, |initial| *initial.get_ref());
            self.variable_places[index] = (task, plan.variables.len());
            plan.image.push(initial);
            plan.variables.push(VariablePlan {
                name: name.get_ref().clone(),
                value_type,
                initial,
                unit: variable.unit.clone().unwrap_or_default(),
                comment: variable.comment.clone().unwrap_or_default(),
            });
        }
    }

    fn task_of(&self, instance: usize) -> usize {
        self.names.entry_of(instance).and_then(|entry| entry.task).unwrap_or_default()
    }

    fn task_of_origin(&self, origin: Origin) -> usize {
        match origin {
            Origin::Input { input, .. } => self.input_places[input].0,
            Origin::Variable(variable) => self.variable_places[variable].0,
            Origin::Pin { instance, .. } => self.task_of(instance),
        }
    }

    /// Gives every value that comes from another task a slot in its reader's image.
    fn place_imports(&mut self) {
        let wires =
            self.wiring.wires.iter().map(|wire| (wire.from, self.task_of(wire.to_instance)));
        let signals =
            self.wiring.signals.iter().zip(&self.names.outputs).flat_map(|(signals, task)| {
                signals.iter().map(|signal| (signal.from, task.unwrap_or_default()))
            });
        let crossing: Vec<(Origin, usize)> = wires
            .chain(signals)
            .filter(|(origin, reader)| self.task_of_origin(*origin) != *reader)
            .collect();
        let mut seen = std::collections::HashSet::new();
        for (origin, reader) in crossing.into_iter().filter(|import| seen.insert(*import)) {
            let producer = self.task_of_origin(origin);
            let link = self.links.entry((reader, producer)).or_default();
            link.positions.insert(origin, link.origins.len());
            link.origins.push(origin);
        }
        for ((reader, _), link) in &mut self.links {
            let image = &mut self.tasks[*reader].image;
            link.first_slot = image.len();
            image.resize(image.len() + link.origins.len(), 0.0);
        }
    }

    /// Groups the instances into banks and places them; returns the instances of every bank.
    fn place_banks(&mut self, depths: &[usize]) -> Vec<Vec<Vec<usize>>> {
        // Within a depth, types come in the order in which the file first names them.
        let mut groups: BTreeMap<(usize, usize, usize), Vec<usize>> = BTreeMap::new();
        let mut first_of_type: HashMap<(usize, usize, (&str, usize)), usize> = HashMap::new();
        let entry_of = |instance| self.names.entry_of(instance);
        for (instance, &depth) in depths.iter().enumerate() {
            let Some(Entry { block_type: Some(block_type), .. }) = entry_of(instance) else {
                continue;
            };
            let task = self.task_of(instance);
            let of_type = (task, depth, block_type.id());
            let first = *first_of_type.entry(of_type).or_insert(instance);
            groups.entry((task, depth, first)).or_default().push(instance);
        }
        let mut banks = vec![Vec::new(); self.tasks.len()];
        for ((task, depth, _), instances) in groups {
            for instances in instances.chunks(BANK_INSTANCES) {
                self.place_bank(task, depth, instances);
                banks[task].push(instances.to_vec());
            }
        }
        banks
    }

    fn place_bank(&mut self, task: usize, depth: usize, instances: &[usize]) {
        let Some(first) = instances.first().and_then(|first| self.names.entry_of(*first)) else {
            return;
        };
        let Some(block_type) = first.block_type else { return };
        let plan = &mut self.tasks[task];
        let first_slot = plan.image.len();
        for (place, &instance) in instances.iter().enumerate() {
            self.first_slots[instance] = plan.image.len();
            self.places[instance] = (plan.banks.len(), place);
            let entry = self.names.entries.partition_point(|entry| entry.first <= instance) - 1;
            let constants = self.wiring.constants_of(instance, entry).iter();
            plan.image.extend(constants.map(|constant| constant.unwrap_or_default()));
            plan.image.resize(plan.image.len() + block_type.outputs.len(), 0.0);
        }
        plan.banks.push(BankPlan {
            block_type,
            depth,
            first_slot,
            instances: instances
                .iter()
                .map(|instance| self.names.instance_name(*instance))
                .collect(),
            wires: Vec::new(),
        });
    }

    fn alarms(&mut self, config: &Config) {
        let entries = self.names.entries.get(config.blocks.len()..).unwrap_or_default();
        for (alarm, entry) in config.alarms.iter().zip(entries) {
            let (first_slot, task) =
                (self.first_slots[entry.first], entry.task.unwrap_or_default());
            let Some(wire) = self.wiring.wires_to(entry.first).first() else { continue };
            let value_type = self.type_of(config, wire.from).unwrap_or(PinType::Lreal);
            let (copy, previous) = self.copy(wire, task);
            let value_slot = if previous { copy.to } else { copy.from } as usize;
            let inputs = entry.block_type.map_or(0, |block_type| block_type.inputs.len());
            let slots = [first_slot, first_slot + inputs];
            let plan = AlarmPlan::of(alarm, (value_type, value_slot), slots);
            self.tasks[task].alarms.extend(plan);
        }
    }

    fn type_of(&self, config: &Config, origin: Origin) -> Option<PinType> {
        match origin {
            Origin::Input { input, part } => {
                Some(part.pin_type(config.inputs.get(input)?.value_type?))
            }
            Origin::Variable(variable) => config.variables.get(variable)?.value_type,
            Origin::Pin { instance, pin } => {
                let block_type = self.names.entry_of(instance)?.block_type?;
                Some(block_type.outputs.get(pin)?.pin_type)
            }
        }
    }

    /// Slot in the image of `reader` where a value is found.
    fn slot(&self, origin: Origin, reader: usize) -> usize {
        let producer = self.task_of_origin(origin);
        if producer != reader {
            let link = &self.links[&(reader, producer)];
            return link.first_slot + link.positions[&origin];
        }
        match origin {
            Origin::Input { input, part } => {
                self.tasks[reader].input_slot(self.input_places[input].1, part)
            }
            Origin::Variable(variable) => {
                self.tasks[reader].variable_slot(self.variable_places[variable].1)
            }
            Origin::Pin { instance, pin } => self.output_slot(instance, pin),
        }
    }

    fn output_slot(&self, instance: usize, pin: usize) -> usize {
        let block_type = self.names.entry_of(instance).and_then(|entry| entry.block_type);
        self.first_slots[instance] + block_type.map_or(0, |known| known.inputs.len()) + pin
    }

    /// The copy that a wire in a task is, and whether it is of the cycle before.
    fn copy(&self, wire: &Wire, task: usize) -> (WirePlan, bool) {
        let copy = WirePlan {
            from: index(self.slot(wire.from, task)),
            to: index(self.first_slots[wire.to_instance] + wire.to_pin),
        };
        // Another task's value is that of its last finished cycle either way.
        let first_bank = self.tasks[task].banks.first();
        let is_own = first_bank.is_some_and(|bank| copy.from as usize >= bank.first_slot);
        (copy, wire.previous && is_own)
    }

    fn wire(&mut self, banks: &[Vec<Vec<usize>>]) {
        for (task, banks) in banks.iter().enumerate() {
            for (bank, instances) in banks.iter().enumerate() {
                for wire in instances.iter().flat_map(|i| self.wiring.wires_to(*i)) {
                    let (copy, previous) = self.copy(wire, task);
                    let plan = &mut self.tasks[task];
                    if previous {
                        plan.previous.push(copy);
                    } else {
                        plan.banks[bank].wires.push(copy);
                    }
                }
            }
        }
    }

    fn outputs(&mut self, config: &Config, labels: &Labels<'_>) {
        let outputs = config.outputs.iter().zip(&self.wiring.signals).zip(&self.names.outputs);
        for (position, ((output, signals), task)) in outputs.enumerate() {
            let task = task.unwrap_or_default();
            let plan = OutputPlan {
                position,
                service: output.service.as_ref().map(|s| s.get_ref().clone()).unwrap_or_default(),
                signals: output
                    .signals
                    .iter()
                    .map(Spanned::get_ref)
                    .zip(signals)
                    .map(|(name, signal)| SignalPlan {
                        name: name.clone(),
                        value_type: signal.value_type,
                        unit: labels.unit(output, signal, self.names).to_owned(),
                        slot: self.slot(signal.from, task),
                    })
                    .collect(),
                readers: output.readers,
                comment: output.comment.clone().unwrap_or_default(),
                upstream: self.upstream(signals.iter().map(|signal| signal.from), task),
            };
            self.tasks[task].outputs.push(plan);
        }
    }

    /// What values are computed from: everything in their task that wires lead from, back to its
    /// inputs and the values of its incoming links.
    fn upstream(&self, origins: impl Iterator<Item = Origin>, task: usize) -> Upstream {
        let mut sources = std::collections::BTreeSet::new();
        let mut seen = std::collections::HashSet::new();
        let mut open: Vec<Origin> = origins.collect();
        while let Some(origin) = open.pop() {
            let producer = self.task_of_origin(origin);
            match origin {
                _ if producer != task => {
                    sources.insert(self.tasks[task].import_source(self.slot(origin, task)));
                }
                Origin::Input { input, .. } => {
                    sources.insert(self.input_places[input].1);
                }
                Origin::Pin { instance, .. } if seen.insert(instance) => {
                    open.extend(self.wiring.wires_to(instance).iter().map(|wire| wire.from));
                }
                // What operators give has no age and no flags.
                Origin::Variable(_) | Origin::Pin { .. } => {}
            }
        }
        let mut places: Vec<_> = seen.into_iter().map(|instance| self.places[instance]).collect();
        places.sort_unstable();
        let mut blocks: Vec<Instances> = Vec::new();
        for (bank, place) in places {
            match blocks.last_mut() {
                Some(last) if last.bank == bank && last.range.end == place => last.range.end += 1,
                _ => blocks.push(Instances { bank, range: place..place + 1 }),
            }
        }
        Upstream { sources: sources.into_iter().collect(), blocks }
    }

    fn finish(self) -> (Vec<TaskPlan>, Vec<LinkPlan>) {
        let links = self
            .links
            .iter()
            .map(|(&(to, from), link)| LinkPlan {
                from,
                to,
                slots: link.origins.iter().map(|origin| index(self.slot(*origin, from))).collect(),
                first_slot: link.first_slot,
                upstream: link
                    .origins
                    .iter()
                    .map(|origin| self.upstream(std::iter::once(*origin), from))
                    .collect(),
            })
            .collect();
        (self.tasks, links)
    }
}

/// Slots are counted in 32 bits: a wire is then one 64-bit word, and a million blocks need few.
fn index(slot: usize) -> u32 {
    u32::try_from(slot).unwrap_or(u32::MAX)
}

//! Tasks of any size for benches, as configurations: what is measured goes the way of every node.

use std::fmt::Write as _;

use isochrone_blocks::{
    ALARM, BlockType, EXPR, Pin, PinType, lim_rate_of_change::LimRateOfChangeCI,
    saw_tooth::SawTooth, scale_linear::ScaleLinear,
};

use crate::{Source, plan};

/// What the instances of a task are.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Workload {
    /// Chains of a saw, a scale and a ramp.
    Mixed,
    /// Process alarms on one variable. None of them is active.
    Alarms,
    /// Instances of an `Expr` with two outputs, of 20 terms together.
    Expressions,
    /// Instances of one type, each with [`BlockType::typical_inputs`].
    Only(BlockType),
}

/// What a task of a [`Workload`] needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorkloadSize {
    /// Slots of the process image, of 8 bytes.
    pub slots: usize,
    /// Words of private state, of 8 bytes.
    pub state_words: usize,
    /// Wires, of 8 bytes.
    pub wires: usize,
}

impl WorkloadSize {
    /// Memory of all that, in bytes.
    pub const fn bytes(&self) -> u64 {
        8 * (self.slots + self.state_words + self.wires) as u64
    }
}

impl Workload {
    /// Most instances that a task can have.
    pub const MAX_INSTANCES: usize = plan::MAX_INSTANCES;

    /// The mixed one, then one of each type of a catalogue.
    pub fn all(catalogue: &[BlockType]) -> Vec<Self> {
        let types = catalogue.iter().copied().map(Self::Only);
        std::iter::once(Self::Mixed).chain(types).collect()
    }

    /// `mixed`, `alarms`, `expressions`, or the name of the block type.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Mixed => "mixed",
            Self::Alarms => "alarms",
            Self::Expressions => "expressions",
            Self::Only(block_type) => block_type.name,
        }
    }

    /// A node of one task with exactly this many instances, of 1 to
    /// [`MAX_INSTANCES`](Self::MAX_INSTANCES). Where a chain is cut short, its beginning remains.
    pub fn source(&self, instances: usize) -> Source {
        let mut text =
            "[node]\nname = \"bench\"\n\n[[task]]\nname = \"bench\"\nperiod = \"1ms\"\n".to_owned();
        if matches!(self, Self::Alarms) {
            text += "\n[[variable]]\nname = \"level\"\ninitial = 1.2\n";
            for alarm in 0..instances {
                // Writing to a text does not fail.
                let _ = write!(
                    text,
                    "\n[[alarm]]\nname = \"high_{alarm}\"\nwhen = \"level > 1.6\"\nfor = \"2s\"\n\
                     hysteresis = 0.05\n"
                );
            }
            return Source::new(format!("{} x {instances}", self.name()), text);
        }
        if matches!(self, Self::Expressions) {
            let _ = write!(
                text,
                "\n[[variable]]\nname = \"v\"\ninitial = 1.2\n\
                 \n[[block]]\nname = \"block\"\ntype = \"Expr\"\ncount = {instances}\nout = {EXPRESSIONS}\n"
            );
            return Source::new(format!("{} x {instances}", self.name()), text);
        }
        for (part, block) in self.parts().iter().enumerate() {
            let count = (instances + self.parts().len() - 1 - part) / self.parts().len();
            if count > 0 {
                block.write(&mut text, count);
            }
        }
        Source::new(format!("{} x {instances}", self.name()), text)
    }

    /// What so many instances need.
    pub fn size(&self, instances: usize) -> WorkloadSize {
        let parts = self.parts();
        let share = instances.div_ceil(parts.len());
        let sum = |of: &dyn Fn(&Part) -> usize| share * parts.iter().map(of).sum::<usize>();
        WorkloadSize {
            slots: sum(&|part| part.block_type.slots()),
            state_words: sum(&|part| part.block_type.state_words),
            wires: sum(&|part| usize::from(part.wire.is_some())),
        }
    }

    fn parts(&self) -> Vec<Part> {
        let part = |name, block_type, wire| Part { name, block_type, wire };
        match self {
            Self::Mixed => vec![
                part("saw", BlockType::of::<SawTooth>(), None),
                part("scale", BlockType::of::<ScaleLinear>(), Some(("x", "saw.{i}.value"))),
                part("ramp", BlockType::of::<LimRateOfChangeCI>(), Some(("value", "scale.{i}.y"))),
            ],
            Self::Alarms => vec![part("alarm", ALARM, Some(("a", "level")))],
            Self::Expressions => vec![part("block", EXPR, None)],
            Self::Only(block_type) => vec![part("block", *block_type, None)],
        }
    }
}

/// 20 names, literals, operators and functions; `v` is a variable.
const EXPRESSIONS: &str =
    "{ y = \"LIMIT(-10.0, 2.0 * (v - 1.0) + v / 4.0, 10.0)\", on = \"v > 1.5 AND NOT (v < 1.0)\" }";

/// Blocks of one type.
struct Part {
    name: &'static str,
    block_type: BlockType,
    /// A pin that is connected, and to what; all others have their typical inputs.
    wire: Option<(&'static str, &'static str)>,
}

impl Part {
    fn write(&self, text: &mut String, count: usize) {
        let Self { name, block_type, wire } = self;
        let mut typical = vec![0.0; block_type.inputs.len()];
        block_type.typical_inputs(&mut typical);
        let pins = block_type.inputs.iter().zip(typical).filter_map(|(pin, slot)| match wire {
            Some((wired, to)) if *wired == pin.name => Some(format!("{} = \"{to}\"", pin.name)),
            _ => constant(pin, slot),
        });
        let pins: Vec<String> = pins.collect();
        // Writing to a text does not fail.
        let _ = write!(
            text,
            "\n[[block]]\nname = \"{name}\"\ntype = \"{}\"\ncount = {count}\nin = {{ {} }}\n",
            block_type.name,
            pins.join(", ")
        );
    }
}

/// The pin as a configuration has it; `None` where that would only repeat the default.
fn constant(pin: &Pin, slot: f64) -> Option<String> {
    let is_default = pin.default.slot().map(f64::to_bits) == Some(slot.to_bits());
    (!is_default).then(|| match pin.pin_type {
        PinType::Bool => format!("{} = {}", pin.name, slot != 0.0),
        PinType::Lreal => format!("{} = {slot:?}", pin.name),
        PinType::Int | PinType::Time | PinType::Word => format!("{} = {slot}", pin.name),
    })
}

#[cfg(test)]
mod tests {
    use isochrone_blocks::CATALOGUE;

    use super::*;
    use crate::{Plan, Rules, TaskEngine};

    fn plan(workload: &Workload, instances: usize) -> Plan {
        Plan::new(workload.source(instances), &Rules::default()).unwrap()
    }

    #[test]
    fn a_task_has_exactly_as_many_instances_as_were_asked_for() {
        for workload in Workload::all(CATALOGUE) {
            for instances in [1, 2, 3, 10, 1_000] {
                let plan = plan(&workload, instances);
                assert_eq!(plan.instances(), instances, "{}", workload.name());
                assert!(plan.warnings.is_empty(), "{:?}", plan.warnings);
            }
        }
    }

    #[test]
    fn every_type_of_the_catalogue_has_its_workload() {
        let names: Vec<&str> = Workload::all(CATALOGUE).iter().map(Workload::name).collect();
        let types = CATALOGUE.iter().map(|known| known.name);
        assert_eq!(names, std::iter::once("mixed").chain(types).collect::<Vec<_>>());
    }

    #[test]
    fn instances_start_with_their_typical_inputs() {
        for known in CATALOGUE {
            let plan = plan(&Workload::Only(*known), 2);
            let mut typical = vec![0.0; known.inputs.len()];
            known.typical_inputs(&mut typical);
            for instance in plan.tasks[0].image.chunks(known.slots()) {
                let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
                assert!(instance.iter().zip(&typical).all(same), "{}: {instance:?}", known.name);
            }
        }
    }

    #[test]
    fn the_size_is_that_of_the_engine() {
        for workload in Workload::all(CATALOGUE) {
            let plan = plan(&workload, 300);
            let engine = TaskEngine::build(&plan).unwrap().remove(0);
            let wires = plan.tasks[0].banks.iter().map(|bank| bank.wires.len()).sum();
            let (slots, state_words) = (engine.image().len(), engine.state().len());
            let size = WorkloadSize { slots, state_words, wires };
            assert_eq!(workload.size(300), size, "{}", workload.name());
        }
    }

    #[test]
    fn a_signal_goes_through_the_chains() {
        let plan = plan(&Workload::Mixed, 9);
        let mut engine = TaskEngine::build(&plan).unwrap().remove(0);
        (0..2_000).for_each(|cycle| engine.step(cycle));
        let ramps = plan.tasks[0].banks.last().unwrap();
        let outputs = engine.image()[ramps.first_slot..].chunks(ramps.block_type.slots());
        let inputs = ramps.block_type.inputs.len();
        outputs.for_each(|slots| assert!(slots[inputs] > 0.0, "{slots:?}"));
        assert_eq!(engine.block_errors(), 0);
    }
}

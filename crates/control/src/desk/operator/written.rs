//! Reading values as people write them, for known signals.

use isochrone_model::{
    CALLING_TASK, Code, Finding, Refusal, Value, Written, parse_call_ob, parse_duration_ns,
    parse_value,
};

use isochrone_engine::escaped;

use crate::desk::signals::{Signal, Signals};

impl Signals {
    /// Reads a value for a signal; does not check whether the signal can have it.
    pub(super) fn value_of(
        &self,
        signal: &Signal<'_>,
        written: &Written,
    ) -> Result<Value, Refusal> {
        let text = match written {
            Written::Value(value) => return Ok(*value),
            Written::Text(text) => text,
        };
        let value = if signal.can_be_unset {
            parse_call_ob(text, |task| self.value_of_task(task))
        } else {
            parse_value(text, signal.value_type, signal.unit)
        };
        value.map_err(|why| {
            let (name, why) = (&signal.name, escaped(&why));
            Refusal::of(Code::InvalidParams, vec![Finding::new(name, format!("{name}: {why}"))])
        })
    }

    /// The value of a `callOB` for a task, given by its name or, as it is shown without a number, its period.
    fn value_of_task(&self, written: &str) -> Result<Value, String> {
        if let Some(value) = self.task_value(written) {
            return Ok(value);
        }
        if let Ok(period_ns) = parse_duration_ns(written) {
            return Ok(Value::Task { period_ns });
        }
        // TIA Portal calls the OB with number 35 OB35.
        let number = written.to_ascii_lowercase();
        let number = number.strip_prefix("ob").map(|number| number.trim_start_matches('_'));
        let help = match number.and_then(|number| number.parse::<u16>().ok()) {
            Some(number) => format!("write the number alone: {number}"),
            None => {
                let names: Vec<_> = (0..self.tasks()).map(|task| self.task_name(task)).collect();
                format!("give an OB number, {CALLING_TASK}, or a task: {}", names.join(", "))
            }
        };
        Err(format!("there is no task \"{written}\"; {help}"))
    }
}

//! The expressions in what `check` shows.

use isochrone_engine::{TaskPlan, escaped};
use serde::Serialize;

/// An output that an expression computes; of several instances, that of all.
#[derive(Serialize)]
pub(super) struct ExpressionRow<'a> {
    /// With `{i}` for the number of an instance, as in the expression.
    output: String,
    #[serde(rename = "type")]
    value_type: &'static str,
    expression: &'a str,
}

impl<'a> ExpressionRow<'a> {
    /// Those of a task, in the order in which they are computed.
    pub(super) fn all(task: &'a TaskPlan) -> Vec<Self> {
        let (mut rows, mut seen) = (Vec::new(), std::collections::HashSet::new());
        for bank in task.block_banks() {
            let Some(formulas) = bank.block_type.formulas() else { continue };
            for name in bank.instances.iter() {
                let (block, number) = name.split_once('.').unwrap_or((name, ""));
                if !seen.insert(block) {
                    continue;
                }
                let number = if number.is_empty() { "" } else { ".{i}" };
                let outputs = bank.block_type.outputs.iter().take(formulas.len());
                rows.extend(outputs.map(|output| Self {
                    output: format!("{block}{number}.{}", output.name),
                    value_type: output.pin_type.as_str(),
                    expression: output.doc(),
                }));
            }
        }
        rows
    }

    pub(super) fn cells(&self) -> [String; 3] {
        let lines = self.expression.split_whitespace().collect::<Vec<_>>().join(" ");
        [self.output.clone(), self.value_type.to_owned(), format!("= {}", escaped(&lines))]
    }
}

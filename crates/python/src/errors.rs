//! What went wrong, as exceptions of the package.

use isochrone::control::ClientError;
use isochrone::model::{Finding, Refusal};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

pyo3::import_exception!(isochrone, Closed);
pyo3::import_exception!(isochrone, Error);
pyo3::import_exception!(isochrone, NoAnswer);
pyo3::import_exception!(isochrone, Refused);

/// Our sentence, as the package's own exception.
pub(crate) fn failed(error: impl std::fmt::Display) -> PyErr {
    Error::new_err(error.to_string())
}

/// Why a node did not do what it was asked for.
pub(crate) fn unanswered(py: Python<'_>, error: ClientError) -> PyErr {
    match error {
        ClientError::Refused(refusal) => match findings(py, &refusal) {
            Ok(findings) => {
                Refused::new_err((refusal.to_string(), refusal.code.number(), findings.unbind()))
            }
            Err(error) => error,
        },
        error @ (ClientError::NoNode { .. }
        | ClientError::NotOperated { .. }
        | ClientError::Ended { .. }
        | ClientError::NoAnswer { .. }) => NoAnswer::new_err(error.to_string()),
        error => failed(error),
    }
}

/// All findings, as dictionaries.
fn findings<'py>(py: Python<'py>, refusal: &Refusal) -> PyResult<Bound<'py, PyList>> {
    let all = PyList::empty(py);
    for Finding { name, message, help, place } in &refusal.findings {
        let finding = PyDict::new(py);
        finding.set_item("name", name)?;
        finding.set_item("message", message)?;
        if let Some(help) = help {
            finding.set_item("help", help)?;
        }
        if let Some(place) = place {
            finding.set_item("line", place.line)?;
            finding.set_item("column", place.column)?;
        }
        all.append(finding)?;
    }
    Ok(all)
}

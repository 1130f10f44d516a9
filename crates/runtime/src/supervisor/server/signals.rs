//! `signals`: the signals of the node.

use isochrone_control::desk::{Selection, Signal};
use isochrone_control::{
    Begun, Caller, Handle, Refusal, SignalDescription, SignalsParams, SignalsResult,
};

use super::ControlServer;
use super::pages::{fitting, page};

/// Signals of a page, if the request does not say how many.
const SIGNALS: u64 = 1000;
/// The most signals of a page: each takes more than 64 bytes of the answer.
const MOST_SIGNALS: usize = isochrone_ipc::MAX_MESSAGE_BYTES / 64;

impl Handle<SignalsParams> for ControlServer {
    fn handle(
        &mut self,
        params: SignalsParams,
        _: Caller,
    ) -> Result<Begun<SignalsResult>, Refusal> {
        let (offset, limit) = page(params.offset, params.limit.or(Some(SIGNALS)));
        let limit = limit.min(MOST_SIGNALS);
        let (operating, selection) = self.shared.search(|signals| match &params.pattern {
            Some(pattern) => Selection::of(signals, [pattern.as_str()], offset, limit),
            None => Ok(Selection::of_all(signals, offset, limit)),
        })?;
        let signals = operating.operator.signals();
        let some = |text: &str| Some(text.to_owned()).filter(|text| !text.is_empty());
        let describe = |signal: Signal<'_>| SignalDescription {
            forced: operating.operator.is_forced(&signal),
            protected: Some(operating.operator.is_protected(&signal)),
            limits: operating.operator.limits(&signal),
            can_be_unset: signal.can_be_unset,
            value_type: signal.value_type.to_string(),
            unit: some(operating.operator.unit(&signal)),
            comment: some(signal.comment),
            role: signal.role,
            task: signals.task_name(signal.task).to_owned(),
            doc: signal.doc.to_owned(),
            name: signal.name,
        };
        let page = fitting(selection.signals().map(describe));
        Ok(Begun::Ended(SignalsResult { total: selection.total() as u64, signals: page }))
    }
}

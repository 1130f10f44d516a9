//! How a kernel was built.

/// How the kernel was built.
#[derive(Debug)]
pub(crate) struct KernelConfig {
    /// The file it was read from.
    pub(crate) source: String,
    pub(super) text: String,
}

impl KernelConfig {
    /// The value of `CONFIG_<name>`; `None` if it is not set.
    pub(crate) fn value(&self, name: &str) -> Option<&str> {
        self.text
            .lines()
            .find_map(|line| line.strip_prefix("CONFIG_")?.strip_prefix(name)?.strip_prefix('='))
    }

    pub(crate) fn is_set(&self, name: &str) -> bool {
        self.value(name).is_some_and(|value| value != "n")
    }

    /// The model it was built with, which is what a dynamic kernel starts with.
    pub(super) fn preemption(&self) -> Option<&'static str> {
        let models = [
            ("PREEMPT_RT", "rt"),
            ("PREEMPT_NONE", "none"),
            ("PREEMPT_VOLUNTARY", "voluntary"),
            ("PREEMPT_LAZY", "lazy"),
            ("PREEMPT", "full"),
        ];
        models.into_iter().find_map(|(name, model)| self.is_set(name).then_some(model))
    }
}

//! What is said of a text that is no expression.

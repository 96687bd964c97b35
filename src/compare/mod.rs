//! Do images agree? Statistics of differences, and what a comparison says.

pub mod statistics;

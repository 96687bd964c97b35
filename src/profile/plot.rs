//! Plots.
use super::Profile;

/// A plot.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Name.
    pub name: String,
    /// Text.
    pub svg: String,
}

impl Profile {
    /// All plots.
    pub fn plots(&self) -> Vec<Plot> {
        Vec::new()
    }
}

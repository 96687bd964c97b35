//! Page.
use super::{Comparison, Profile};

impl Profile {
    /// Page.
    pub fn to_html(&self, _comparison: Option<&Comparison>) -> String {
        String::new()
    }
}

//! What the channels of a sample are, in their order.

use std::ops::Range;

use serde::{Deserialize, Serialize};

/// Names of a sample's channels: red, green and blue, other colours of the colour model, what the integrator adds, and
/// opacity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Layout {
    names: Vec<String>,
    /// How many are colours.
    colors: usize,
    /// Whether light also comes to places of the film that no sample was begun at.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    splats: bool,
}

impl Layout {
    /// The first three of `colors` are red, green and blue.
    pub(crate) fn new(colors: Vec<String>, extra: Vec<String>) -> Self {
        let count = colors.len();
        let mut names = colors;
        names.extend(extra);
        names.push("A".into());
        Self {
            names,
            colors: count,
            splats: false,
        }
    }

    /// The same, with sums of splats where that is so.
    pub(crate) fn with_splats(self, splats: bool) -> Self {
        Self { splats, ..self }
    }

    /// How many sums a pixel has: the weight, one a channel, and for splats the number of paths and one a colour.
    pub(crate) fn stride(&self) -> usize {
        let samples = self.count() + 1;
        match self.splats {
            true => samples + 1 + self.colors,
            false => samples,
        }
    }

    /// Where among a pixel's sums those of splats are.
    pub(crate) fn splats(&self) -> Option<Range<usize>> {
        self.splats.then(|| self.count() + 1..self.stride())
    }

    /// Whether it is one that [`Layout::new`] may have made: what was read from a file need not be.
    pub(crate) fn is_sound(&self) -> bool {
        self.colors >= 3 && self.names.len() > self.colors
    }

    /// How many channels there are.
    pub(crate) fn count(&self) -> usize {
        self.names.len()
    }

    /// Where the colours are.
    pub(crate) fn colors(&self) -> Range<usize> {
        0..self.colors
    }

    /// Where the channels are that the integrator adds.
    pub(crate) fn extra(&self) -> Range<usize> {
        self.colors..self.opacity()
    }

    /// Takes the values of a sample, a channel each, of a pass over the bands into what all passes come to. Of light and
    /// colours each pass brings a part, of other channels the first brings all.
    pub(crate) fn take(&self, pass: u32, values: &[f32], sums: &mut [f32]) {
        if pass == 0 {
            sums[..values.len()].copy_from_slice(values);
            return;
        }
        for (channel, (sum, value)) in sums.iter_mut().zip(values).enumerate() {
            if self.adds_up(channel) {
                *sum += *value;
            }
        }
    }

    /// Whether a channel is light or a colour.
    fn adds_up(&self, channel: usize) -> bool {
        let is_color = |name: &str| [".R", ".G", ".B"].iter().any(|end| name.ends_with(end));
        channel < self.colors || is_color(&self.names[channel])
    }

    /// Where opacity is.
    pub(crate) fn opacity(&self) -> usize {
        self.names.len() - 1
    }

    /// Where the channels are that an image has beside red, green, blue and opacity.
    pub(crate) fn others(&self) -> Range<usize> {
        3..self.opacity()
    }

    /// The channels' names.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }
}

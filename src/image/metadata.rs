//! What an image says beside its pixels: how it was made, from where, and which part of the whole it is.

use glam::Mat4;

/// Named values that are written into the file where its format has room for them (EXR); the other
/// formats leave them out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// Names and values, in any order; a name stands once.
    pub entries: Vec<(String, MetaValue)>,
}

impl Metadata {
    /// Adds an entry.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, value: impl Into<MetaValue>) -> Self {
        self.entries.push((name.into(), value.into()));
        self
    }
}

/// One value of the metadata.
#[derive(Clone, Debug, PartialEq)]
pub enum MetaValue {
    /// Text, in UTF-8.
    Text(String),
    /// An integer; in EXR an `int`, or text where it has more than 32 bits.
    Integer(i64),
    /// A number; in EXR a `float`, or a `double` where a float would round it.
    Number(f64),
    /// A transform of column vectors, p' = M·p. `world_to_camera` and `world_to_ndc` become OpenEXR's
    /// own `worldToCamera` and `worldToNDC`.
    Matrix(Mat4),
}

impl From<&str> for MetaValue {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for MetaValue {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<i64> for MetaValue {
    fn from(value: i64) -> Self {
        Self::Integer(value)
    }
}

impl From<u32> for MetaValue {
    fn from(value: u32) -> Self {
        Self::Integer(value.into())
    }
}

impl From<f64> for MetaValue {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<f32> for MetaValue {
    fn from(value: f32) -> Self {
        Self::Number(value.into())
    }
}

impl From<Mat4> for MetaValue {
    fn from(matrix: Mat4) -> Self {
        Self::Matrix(matrix)
    }
}

/// Where an image lies within a larger one: EXR's data window inside its display window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Column of the whole at which the image's left column lies.
    pub x: u32,
    /// Row of the whole at which the image's top row lies.
    pub y: u32,
    /// Width of the whole in pixels.
    pub full_width: u32,
    /// Height of the whole in pixels.
    pub full_height: u32,
}

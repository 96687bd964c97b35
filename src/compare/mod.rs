//! Do two images, or two sets of renders, agree? For two images there are the metrics of the field
//! ([`pair`]), which measure how far apart they are but cannot tell noise from error. For several seeds a
//! side there is a statistical test ([`seeds`]) that can, and for one image against a reference of known
//! variance there is Mitsuba's ([`ztest`]). [`Picture`](crate::image::Picture)s become comparable as
//! [`Layer`]s; what differs where, and which is brighter there ([`signed`]), can be drawn ([`map`]).

pub mod flip;
mod layer;
pub mod map;
pub mod metric;
pub mod pair;
pub mod seeds;
pub mod signed;
pub mod ssim;
pub mod statistics;
pub mod ztest;

pub use layer::{Crop, Layer, NotFinite, Selection};

//! Mathematics that everything above stands on: random numbers that are a pure function of where they
//! are used, frames, transforms, warps of the unit square, discrete distributions and the offset that
//! keeps a ray from hitting the surface it leaves.

mod bounds;
pub mod distribution;
pub mod frame;
pub mod moving;
pub mod quadrature;
pub mod random;
pub mod transform;

pub use bounds::Bounds;
pub use frame::Frame;
pub use moving::Moving;
pub use transform::Transform;

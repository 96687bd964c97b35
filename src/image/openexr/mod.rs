//! OpenEXR: linear floating-point images of any channels, layers named by dots, with attributes
//! (openexr.com, "OpenEXR File Layout"). The crate `exr` codes the blocks of pixels; which blocks, where
//! they go and how much memory they may take is decided here.

mod colors;
mod dwa;
mod read;
mod sampling;
mod write;

pub(super) use read::{MAGIC, decode};
pub use write::check_channels;
pub(super) use write::encode;

/// Our name for a transform, and the standard attribute's.
const WORLD_TO_CAMERA: (&str, &str) = ("world_to_camera", "worldToCamera");
const WORLD_TO_NDC: (&str, &str) = ("world_to_ndc", "worldToNDC");

/// How many bytes of pixels are coded at once, over all threads.
const BATCH_BYTES: usize = 64 << 20;

/// How many blocks of `bytes` each make a batch.
fn batch_length(bytes: usize) -> usize {
    (BATCH_BYTES / bytes.max(1)).clamp(1, 256)
}

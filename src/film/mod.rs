//! The film: what a sample's channels are, and sums of samples by filter weight, over rectangles of pixels or apart by
//! block.

mod blocks;
mod layout;
mod splat;
mod splats;
mod sums;

pub(crate) use blocks::{BLOCK, Blocks, Grid, Record};
pub(crate) use layout::Layout;
pub(crate) use splat::{GROUP, Group, row_length};
pub(crate) use splats::Splats;
pub(crate) use sums::{Accumulator, Rows, Summed, Sums, Tally, Times};

use sums::zeros;

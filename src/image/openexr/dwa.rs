//! A check of DWA-compressed blocks. Each begins with eleven counters of 64 bits (OpenEXR, "DWA
//! Compression": `DataSizesSingle`), and the decoder allocates what they say. A block's parts cannot be
//! larger than its pixels, whole groups of 8 × 8, so counters beyond that are refused.

use ::exr::block::chunk::{Chunk, CompressedBlock};
use ::exr::meta::header::Header;
use ::exr::prelude::{Compression, Vec2};

use super::read::refused;
use crate::error::{Error, Result};

/// The places of the counters that say how much a part unpacks to: unknown, run lengths before and after
/// their expansion, and the numbers of AC and DC coefficients.
const UNPACKED: [usize; 5] = [1, 6, 7, 8, 9];

/// Refuses a block whose counters are absurd. Blocks of other compressions pass.
pub(super) fn check(chunk: &Chunk, headers: &[Header]) -> Result<()> {
    let Some(header) = headers.get(chunk.layer_index) else {
        return Err(Error::input("invalid: a block of no part"));
    };
    let (Compression::DWAA(_) | Compression::DWAB(_)) = header.compression else {
        return Ok(());
    };
    let bytes = match &chunk.compressed_block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return Ok(()),
    };
    let place = header
        .get_block_data_indices(&chunk.compressed_block)
        .and_then(|tile| header.get_absolute_block_pixel_coordinates(tile))
        .map_err(refused)?;
    let Vec2(width, height) = place.size;
    let bytes_per_pixel = header.channels.bytes_per_pixel;
    if bytes.len() == width * height * bytes_per_pixel {
        // Packing would have lengthened the block, so it is stored as it is, without counters.
        return Ok(());
    }
    let padded = width.next_multiple_of(8) * height.next_multiple_of(8) * bytes_per_pixel;
    // Run lengths of noise are a little longer than the noise.
    let most = 2 * padded as u64 + 4096;
    let (counters, _) = bytes.as_chunks::<8>();
    let absurd = UNPACKED
        .iter()
        .filter_map(|&i| counters.get(i))
        .any(|&counter| u64::from_le_bytes(counter) > most);
    if absurd {
        return Err(Error::input("invalid: DWA counters"));
    }
    Ok(())
}

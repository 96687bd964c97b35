//! Rows of a fixed number of bytes, of which columns are decoded into arrays in parallel.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::header::{Encoding, Scalar};
use crate::mesh::GRAIN;

/// One property in rows of bytes.
#[derive(Clone, Copy)]
pub(super) struct Column {
    pub(super) offset: usize,
    pub(super) scalar: Scalar,
}

/// Rows of `stride` bytes.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) stride: usize,
    pub(super) encoding: Encoding,
}

impl Rows<'_> {
    /// Appends what `make` makes of each row's `columns`.
    pub(super) fn get<const N: usize, T: Send>(
        &self,
        columns: [Column; N],
        into: &mut Vec<T>,
        make: impl Fn([f32; N]) -> T + Sync,
    ) {
        let rows = self.bytes.par_chunks_exact(self.stride);
        let rows = rows.with_min_len(GRAIN);
        if self.encoding == Encoding::LittleEndian
            && columns.iter().all(|c| c.scalar == Scalar::F32)
        {
            let offsets = columns.map(|c| c.offset);
            into.par_extend(rows.map(|row| {
                make(offsets.map(|o| {
                    let bytes = row[o..].first_chunk().expect("the column lies in the row");
                    f32::from_le_bytes(*bytes)
                }))
            }));
        } else {
            into.par_extend(rows.map(|row| make(columns.map(|c| self.value(c, row)))));
        }
    }

    /// Appends each row's position, with `origin` subtracted in double precision.
    pub(super) fn get_from(&self, origin: DVec3, columns: [Column; 3], into: &mut Vec<Vec3>) {
        let rows = self.bytes.par_chunks_exact(self.stride);
        into.par_extend(rows.with_min_len(GRAIN).map(|row| {
            let place = columns.map(|c| c.scalar.decode(&row[c.offset..], self.encoding));
            (DVec3::from_array(place) - origin).as_vec3()
        }));
    }

    /// Appends each row's `columns`, however many.
    pub(super) fn get_all(&self, columns: &[Column], into: &mut Vec<f32>) {
        let rows = self.bytes.par_chunks_exact(self.stride);
        let start = into.len();
        into.resize(start + rows.len() * columns.len(), 0.0);
        let into = into[start..].par_chunks_exact_mut(columns.len());
        (into.zip(rows).with_min_len(GRAIN)).for_each(|(values, row)| {
            for (value, column) in values.iter_mut().zip(columns) {
                *value = self.value(*column, row);
            }
        });
    }

    fn value(&self, column: Column, row: &[u8]) -> f32 {
        column.scalar.decode(&row[column.offset..], self.encoding) as f32
    }
}

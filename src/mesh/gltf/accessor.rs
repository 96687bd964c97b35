//! Accessors as rows of numbers: strided, normalized, sparse, or zeros. Nothing is read through an offset that was not
//! held against its buffer's length, and no memory is taken for elements that are not in the file.

use super::OrWhy;
use super::container::Buffers;
use super::json::{Accessor, BufferView, Root, Sparse, at, meshopt};
use crate::budget::Account;

/// Elements that an accessor without data may have: all of them are zero, and take no room in the file.
const MOST_ZEROS: usize = 1 << 24;

/// What the accessors of a file give.
pub(super) struct Accessors<'a> {
    pub(super) root: &'a Root<'a>,
    pub(super) buffers: &'a Buffers<'a>,
    /// Who is asked for memory.
    pub(super) account: &'a Account,
}

/// The kinds of numbers, as glTF writes them.
mod component {
    pub(super) const I8: u32 = 5120;
    pub(super) const U8: u32 = 5121;
    pub(super) const I16: u32 = 5122;
    pub(super) const U16: u32 = 5123;
    pub(super) const U32: u32 = 5125;
    pub(super) const F32: u32 = 5126;
}

/// How a number is read.
struct Component<T> {
    /// Bytes.
    size: usize,
    decode: fn(&[u8]) -> T,
}

impl Accessors<'_> {
    /// How many elements accessor `index` has.
    pub(super) fn count(&self, index: usize) -> OrWhy<usize> {
        Ok(self.get(index)?.count)
    }

    fn get(&self, index: usize) -> OrWhy<&Accessor> {
        at(&self.root.accessors, index, "accessor")
    }

    /// Rows of `N` numbers; integers are divided by their greatest value where the accessor is normalized.
    pub(super) fn rows<const N: usize>(&self, index: usize) -> OrWhy<Vec<[f32; N]>> {
        let accessor = self.get(index)?;
        let component = float(accessor.component_type, accessor.normalized);
        self.elements(accessor, component)
            .map_err(|why| format!("accessor {index} {why}"))
    }

    /// Rows of `N` whole numbers.
    pub(super) fn whole_rows<const N: usize>(&self, index: usize) -> OrWhy<Vec<[u32; N]>> {
        let accessor = self.get(index)?;
        self.elements(accessor, whole(accessor.component_type))
            .map_err(|why| format!("accessor {index} {why}"))
    }

    /// Colours, of which the first three of three or four numbers are meant.
    pub(super) fn colors(&self, index: usize) -> OrWhy<Vec<[f32; 3]>> {
        match self.get(index)?.kind.components() {
            4 => {
                let rows = self.rows::<4>(index)?;
                Ok(rows.into_iter().map(|[r, g, b, _]| [r, g, b]).collect())
            }
            _ => self.rows(index),
        }
    }

    fn elements<const N: usize, T: Copy + Default>(
        &self,
        accessor: &Accessor,
        component: OrWhy<Component<T>>,
    ) -> OrWhy<Vec<[T; N]>> {
        let component = component?;
        if accessor.kind.components() != N {
            return Err(format!("should have {N} components"));
        }
        let count = accessor.count;
        let mut rows = match accessor.buffer_view {
            Some(view) => self.stored(view, accessor.byte_offset, count, &component)?,
            None if count > MOST_ZEROS => {
                return Err(format!(
                    "has no data for its {count} elements; at most {MOST_ZEROS} may be zeros"
                ));
            }
            None => {
                let taken = self.account.take_rows(count as u64, size_of::<[T; N]>());
                taken.map_err(|e| e.to_string())?;
                vec![[T::default(); N]; count]
            }
        };
        if let Some(sparse) = &accessor.sparse {
            self.replace(&mut rows, sparse, &component)?;
        }
        Ok(rows)
    }

    /// The elements that begin at byte `offset` of a view.
    fn stored<const N: usize, T>(
        &self,
        view: usize,
        offset: usize,
        count: usize,
        component: &Component<T>,
    ) -> OrWhy<Vec<[T; N]>> {
        let view = at(&self.root.buffer_views, view, "buffer view")?;
        let size = N * component.size;
        let stride = view.byte_stride.unwrap_or(size);
        let data = self.view(view)?.get(offset..).and_then(|data| {
            let needed = match count {
                0 => 0,
                _ => stride.checked_mul(count - 1)?.checked_add(size)?,
            };
            data.get(..needed)
        });
        let Some(data) = data.filter(|_| stride >= size) else {
            return Err("reaches beyond its buffer".to_owned());
        };
        let row = |bytes: &[u8]| {
            std::array::from_fn(|i| (component.decode)(&bytes[i * component.size..]))
        };
        Ok(data.chunks(stride).take(count).map(row).collect())
    }

    /// The bytes of a view.
    fn view(&self, view: &BufferView) -> OrWhy<&[u8]> {
        let buffer = self.buffers.get(view.buffer, &self.root.buffers);
        let buffer = buffer.map_err(|why| match view.extensions.meshopt {
            Some(_) => meshopt(),
            None => why,
        })?;
        let end = view.byte_offset.checked_add(view.byte_length);
        end.and_then(|end| buffer.get(view.byte_offset..end))
            .ok_or_else(|| "reaches beyond its buffer".to_owned())
    }

    /// Puts a sparse accessor's elements in their places.
    fn replace<const N: usize, T: Copy>(
        &self,
        rows: &mut [[T; N]],
        sparse: &Sparse,
        component: &Component<T>,
    ) -> OrWhy<()> {
        let Sparse {
            count,
            indices,
            values,
        } = sparse;
        let places = self.stored::<1, u32>(
            indices.buffer_view,
            indices.byte_offset,
            *count,
            &whole(indices.component_type)?,
        )?;
        let values = self.stored(values.buffer_view, values.byte_offset, *count, component)?;
        for ([place], value) in places.into_iter().zip(values) {
            *rows
                .get_mut(place as usize)
                .ok_or_else(|| format!("replaces its element {place}, which it has not"))? = value;
        }
        Ok(())
    }
}

fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
    *bytes
        .first_chunk()
        .expect("the accessor's rows have been measured")
}

fn whole(kind: u32) -> OrWhy<Component<u32>> {
    let (size, decode): (_, fn(&[u8]) -> u32) = match kind {
        component::U8 => (1, |b| b[0].into()),
        component::U16 => (2, |b| u16::from_le_bytes(first(b)).into()),
        component::U32 => (4, |b| u32::from_le_bytes(first(b))),
        _ => {
            return Err(format!(
                "cannot be of component type {kind}: indices are unsigned integers"
            ));
        }
    };
    Ok(Component { size, decode })
}

fn float(kind: u32, normalized: bool) -> OrWhy<Component<f32>> {
    let (size, decode): (_, fn(&[u8]) -> f32) = match (kind, normalized) {
        (component::F32, _) => (4, |b| f32::from_le_bytes(first(b))),
        (component::U32, _) => (4, |b| u32::from_le_bytes(first(b)) as f32),
        (component::I8, false) => (1, |b| i8::from_le_bytes(first(b)).into()),
        (component::U8, false) => (1, |b| b[0].into()),
        (component::I16, false) => (2, |b| i16::from_le_bytes(first(b)).into()),
        (component::U16, false) => (2, |b| u16::from_le_bytes(first(b)).into()),
        (component::I8, true) => (1, |b| {
            (f32::from(i8::from_le_bytes(first(b))) / 127.0).max(-1.0)
        }),
        (component::U8, true) => (1, |b| f32::from(b[0]) / 255.0),
        (component::I16, true) => (2, |b| {
            (f32::from(i16::from_le_bytes(first(b))) / 32767.0).max(-1.0)
        }),
        (component::U16, true) => (2, |b| f32::from(u16::from_le_bytes(first(b))) / 65535.0),
        _ => return Err(format!("has the unknown component type {kind}")),
    };
    Ok(Component { size, decode })
}

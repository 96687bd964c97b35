//! Colours of vertices and faces as files of bare meshes store them, as linear RGB in [0, 1].

use rayon::prelude::*;

use super::GRAIN;

/// Divides colours by the greatest value of their type: `ranges` has that of each channel, `None` for floats. Whole
/// numbers up to 255 in a type that is wider than 16 bits are bytes all the same; that this was assumed is returned, in
/// words.
pub(super) fn to_unit(values: &mut [f32], ranges: &[Option<f32>]) -> Option<String> {
    let channels = ranges.len();
    let (mut divisors, mut assumed) = (vec![1.0; channels], None);
    // Colours together, and alpha by itself.
    for some in [0..channels.min(3), 3..channels] {
        let Some(&range) = ranges.get(some.start) else {
            continue;
        };
        let divisor = match range {
            Some(range) if range <= 65535.0 => range,
            _ => {
                let rows = values.par_chunks_exact(channels).with_min_len(GRAIN);
                let range_of = |row: &[f32]| {
                    let row = &row[some.clone()];
                    let is_byte = |v: &f32| (0.0..=255.0).contains(v) && v.fract() == 0.0;
                    match row.iter().all(is_byte) {
                        true => row.iter().copied().fold(0.0, f32::max),
                        false => f32::INFINITY,
                    }
                };
                let greatest = rows.map(range_of).reduce(|| 0.0, f32::max);
                if greatest <= 255.0 && (greatest > 1.0 || range.is_some()) {
                    assumed = Some(greatest);
                    255.0
                } else {
                    range.unwrap_or(1.0)
                }
            }
        };
        divisors[some].fill(divisor);
    }
    if divisors.iter().any(|d| *d != 1.0) {
        let rows = values.par_chunks_exact_mut(channels).with_min_len(GRAIN);
        rows.for_each(|row| row.iter_mut().zip(&divisors).for_each(|(v, d)| *v /= d));
    }
    assumed.map(|greatest| {
        format!(
            "colours are whole numbers up to {greatest} in a type for more: they are divided by 255"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_divided_by_the_range_of_their_type() {
        let unit = |values: &[f32], ranges: &[Option<f32>]| {
            let mut values = values.to_vec();
            let said = to_unit(&mut values, ranges).is_some();
            (values, said)
        };
        let byte = [Some(255.0); 3];
        assert_eq!(
            unit(&[0.0, 51.0, 255.0], &byte),
            (vec![0.0, 0.2, 1.0], false)
        );
        assert_eq!(unit(&[1.0, 0.0, 0.0], &byte).0[0], 1.0 / 255.0);
        let wide = [Some(65535.0); 3];
        assert_eq!(
            unit(&[65535.0, 0.0, 13107.0], &wide),
            (vec![1.0, 0.0, 0.2], false)
        );
        let float = [None; 4];
        for whole in [[0.0, 1.0, 1.0, 1.0], [0.25, 2.0, 0.5, 1.0]] {
            assert_eq!(unit(&whole, &float), (whole.to_vec(), false));
        }
        assert_eq!(
            unit(&[51.0, 0.0, 255.0, 1.0], &float),
            (vec![0.2, 0.0, 1.0, 1.0], true)
        );
        let int = [Some(u32::MAX as f32); 3];
        assert_eq!(unit(&[51.0, 0.0, 255.0], &int), (vec![0.2, 0.0, 1.0], true));
        assert_eq!(
            unit(&[u32::MAX as f32, 0.0, 0.0], &int),
            (vec![1.0, 0.0, 0.0], false)
        );
        let mixed = [Some(255.0), Some(255.0), Some(255.0), None];
        assert_eq!(
            unit(&[255.0, 0.0, 51.0, 0.5], &mixed),
            (vec![1.0, 0.0, 0.2, 0.5], false)
        );
    }
}

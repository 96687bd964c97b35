//! Names for pairs of numbers, where they are written for programs.

use serde::{Serialize, Serializer};

macro_rules! pair {
    ($(#[$meta:meta])* $name:ident, $a:ident, $b:ident) => {
        $(#[$meta])*
        pub(super) fn $name<T: Copy + Serialize, S: Serializer>(
            [$a, $b]: &[T; 2],
            serializer: S,
        ) -> Result<S::Ok, S::Error> {
            #[derive(Serialize)]
            struct Pair<T> {
                $a: T,
                $b: T,
            }
            let ($a, $b) = (*$a, *$b);
            Pair { $a, $b }.serialize(serializer)
        }
    };
}

pair!(
    /// How much is done of how much.
    progress, done, of
);
pair!(
    /// The smallest and the largest number.
    range, least, most
);
pair!(
    /// Pixels across and down.
    size, width, height
);
pair!(
    /// Bytes of meshes and images, and of trees.
    bytes, geometry, trees
);

pair!(
    /// The corners of a box.
    corners, min, max
);

pair!(
    /// A pixel's column and row.
    place, x, y
);

/// A pixel's column and row, if there is one.
pub(super) fn pixel<S: Serializer>(
    pixel: &Option<[u32; 2]>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match pixel {
        Some(pixel) => place(pixel, serializer),
        None => serializer.serialize_none(),
    }
}

/// The corners of a box, if there is one.
pub(super) fn bounds<S: Serializer>(
    bounds: &Option<[[f32; 3]; 2]>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match bounds {
        Some(bounds) => corners(bounds, serializer),
        None => serializer.serialize_none(),
    }
}

//! PLY: any order and type of properties, ASCII and binary of both endians. Rows of fixed size are decoded
//! column by column, in parallel, straight from the buffer; ASCII rows, and those with lists, are first written
//! out as rows of f64, so that one decoder serves all. Polygons are fans around their first corner; elements other
//! than `vertex` and `face` are skipped. Texture coordinates are `u v`, `s t` or `texture_u texture_v`, and of a bare mesh also
//! those of faces' corners, `texcoord`.

mod attributes;
mod header;
mod pictures;
mod rows;
mod wedges;
mod write;

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::polygon::Polygons;
use super::read::{Decoded, Input, ReadOptions};
use super::source::Source;
use super::{Attribute, GRAIN, Mesh, Per, colors};
use crate::error::Result;
use attributes::{Plan, Wanted};
use header::{Element, Encoding, Header, Kind, Scalar};
use rows::{Column, Rows};

pub use write::{check_writable, write_ply, write_text};

/// Rows that are written out at a time where they are not of fixed size.
const ROWS: u64 = 1 << 10;
/// Bytes that are decoded at a time: enough for all threads, and few enough for the cache.
const BLOCK: usize = 1 << 22;

pub(super) fn read(input: Input<'_>, options: &ReadOptions) -> Result<Decoded> {
    let (origin, path) = (input.origin, input.path);
    let mut source = Source::new(input);
    let header = Header::read(&mut source)?;
    for wanted in header::WANTED {
        if !header.elements.iter().any(|e| e.name == wanted) {
            return Err(source
                .error_at_last_line(format!("the file has no element {wanted:?}"))
                .help("a mesh needs vertices and faces"));
        }
    }
    if header.encoding != Encoding::Ascii {
        source.binary();
    }
    let mut ply = Ply {
        source,
        encoding: header.encoding,
        vertices: 0,
        bare: options.bare,
        origin,
        widest: 0,
        wedges: Vec::new(),
        texnumbers: Vec::new(),
        decoded: Decoded {
            polygons: Polygons::new(options.bare),
            ..Decoded::default()
        },
    };
    ply.say_what_is_left_out(&header);
    for element in &header.elements {
        ply.check_length(element)?;
        if element.name == "vertex" {
            ply.vertices = element.count;
        }
    }
    let mut wanted = 2;
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => ply.read_vertices(element)?,
            "face" => ply.read_faces(element)?,
            _ => {
                ply.skip(element)?;
                continue;
            }
        }
        wanted -= 1;
        if wanted == 0 {
            break;
        }
    }
    let mut decoded = ply.decoded;
    if options.bare && !ply.wedges.is_empty() {
        wedges::settle(&mut decoded.mesh, &ply.wedges, ply.source.account)?;
    }
    if options.bare && !header.pictures.is_empty() {
        pictures::show(&mut decoded, &header.pictures, &ply.texnumbers, path);
    }
    if options.flip_tex_coords.unwrap_or(false) {
        decoded.mesh.flip_uvs();
    }
    Ok(decoded)
}

struct Ply<'a> {
    source: Source<'a>,
    encoding: Encoding,
    /// As the header promises them.
    vertices: u64,
    /// Whether the file is all there is.
    bare: bool,
    /// What is subtracted from positions.
    origin: DVec3,
    /// Bytes that are taken for a face's corners.
    widest: u64,
    /// Texture coordinates of the triangles' corners, where faces have them.
    wedges: Vec<[Vec2; 3]>,
    /// Which image triangles have, where faces say so.
    texnumbers: Vec<f64>,
    decoded: Decoded,
}

/// The list of texture coordinates of a face's corners, u and v in turn.
const WEDGES: &str = "texcoord";

impl Ply<'_> {
    fn say_what_is_left_out(&mut self, header: &Header) {
        let warnings = &mut self.decoded.warnings;
        for element in &header.elements {
            let Element { name, count, .. } = element;
            if *count == 0 {
                continue;
            }
            if !header::WANTED.contains(&name.as_str()) {
                warnings.push(format!(
                    "{count} rows of element {name:?} left out: only vertices and faces are read"
                ));
                continue;
            }
            let lists = element.properties.iter().filter(|property| {
                matches!(property.kind, Kind::List { .. })
                    && !(name == "face" && is_corners(property))
            });
            let is_wedges = |list: &str| name == "face" && list == WEDGES;
            let lists = lists.map(|list| list.name.as_str());
            let lists = lists.filter(|list| !(self.bare && is_wedges(list)));
            warnings.extend(lists.map(|list| match is_wedges(list) {
                true => format!(
                    "list {list:?} of element {name:?} left out: texture coordinates are those of vertices, s and t"
                ),
                false => format!("list {list:?} of element {name:?} left out"),
            }));
        }
    }

    /// Refuses a count of rows that the rest of the file cannot hold.
    fn check_length(&self, element: &Element) -> Result<()> {
        let Element { name, count, .. } = element;
        // The last row of an ASCII file may lack its end of line.
        let least = count
            .saturating_mul(element.least_row(self.encoding))
            .saturating_sub(1);
        let remaining = self.source.remaining();
        if least > remaining {
            return Err(self.source.error(format!(
                "the header promises {count} rows of element {name:?}, at least {least} bytes; \
                 {remaining} bytes follow it"
            )));
        }
        if name == "vertex" && *count > u64::from(u32::MAX) {
            return Err(self.source.error(format!(
                "{count} vertices are more than 32-bit indices reach"
            )));
        }
        Ok(())
    }

    fn read_vertices(&mut self, element: &Element) -> Result<()> {
        let find = |names: &[&str]| -> Option<Vec<usize>> {
            names.iter().map(|name| element.scalar(name)).collect()
        };
        let Some(position) = find(&["x", "y", "z"]) else {
            return Err(self
                .source
                .error("element \"vertex\" needs the properties x, y and z"));
        };
        let normal = find(&["nx", "ny", "nz"]);
        let uv = find(&["u", "v"])
            .or_else(|| find(&["s", "t"]))
            .or_else(|| find(&["texture_u", "texture_v"]));
        let named = [Some(&position), normal.as_ref(), uv.as_ref()];
        let taken: Vec<usize> = named.into_iter().flatten().flatten().copied().collect();
        let wanted = Wanted {
            prefix: "vertex_",
            taken: &taken,
            bare: self.bare,
        };
        let plans = attributes::plan(element, &wanted, &mut self.decoded.warnings);
        let ranges: Vec<_> = plans.iter().map(|p| p.ranges.clone()).collect();
        let origin = self.origin;

        let (stride, columns) = self.columns(element);
        let place = |properties: &[usize]| -> Vec<Column> {
            properties.iter().map(|&i| columns[i]).collect()
        };
        let position = triple(&place(&position));
        let normal = normal.map(|n| triple(&place(&n)));
        let uv = uv.map(|uv| [columns[uv[0]], columns[uv[1]]]);
        let attributes: Vec<Vec<Column>> = plans.iter().map(|p| place(&p.properties)).collect();

        let count = usize::try_from(element.count).expect("the file holds so many rows");
        let numbers: usize = attributes.iter().map(Vec::len).sum();
        self.take(count, size_of::<[f32; 8]>() + numbers * size_of::<f32>())?;
        let mut mesh = Mesh {
            attributes: start(plans, Per::Vertex, count),
            ..Mesh::default()
        };
        mesh.positions.reserve_exact(count);
        mesh.normals.reserve_exact(normal.map_or(0, |_| count));
        mesh.uvs.reserve_exact(uv.map_or(0, |_| count));
        self.each_rows(element, stride, |rows| {
            if origin == DVec3::ZERO {
                rows.get(position, &mut mesh.positions, Vec3::from_array);
            } else {
                rows.get_from(origin, position, &mut mesh.positions);
            }
            if let Some(normal) = normal {
                rows.get(normal, &mut mesh.normals, Vec3::from_array);
            }
            if let Some(uv) = uv {
                rows.get(uv, &mut mesh.uvs, Vec2::from_array);
            }
            for (attribute, columns) in mesh.attributes.iter_mut().zip(&attributes) {
                rows.get_all(columns, &mut attribute.values);
            }
        })?;
        self.divide_colors(&mut mesh.attributes, &ranges);
        mesh.triangles = std::mem::take(&mut self.decoded.mesh.triangles);
        mesh.attributes.append(&mut self.decoded.mesh.attributes);
        self.decoded.mesh = mesh;
        Ok(())
    }

    /// Divides those of the attributes that have ranges.
    fn divide_colors(&mut self, attributes: &mut [Attribute], ranges: &[Option<Vec<Option<f32>>>]) {
        for (attribute, ranges) in attributes.iter_mut().zip(ranges) {
            if let Some(ranges) = ranges {
                let assumed = colors::to_unit(&mut attribute.values, ranges);
                self.decoded.warnings.extend(assumed);
            }
        }
    }

    /// The row's length and each property's place in it, in what [`Ply::each_rows`] gives.
    fn columns(&self, element: &Element) -> (usize, Vec<Column>) {
        let fixed = self.encoding != Encoding::Ascii && element.stride().is_some();
        let mut stride = 0;
        let columns = element.properties.iter().map(|property| {
            let scalar = match property.kind {
                Kind::Scalar(scalar) if fixed => scalar,
                _ => Scalar::F64,
            };
            let offset = stride;
            stride += scalar.size();
            Column { offset, scalar }
        });
        let columns = columns.collect();
        (stride, columns)
    }

    /// Shows all rows of `element`, some at a time.
    fn each_rows(
        &mut self,
        element: &Element,
        stride: usize,
        mut each: impl FnMut(Rows<'_>),
    ) -> Result<()> {
        let mut left = element.count;
        let encoding = self.encoding;
        if encoding != Encoding::Ascii && element.stride().is_some() {
            while left > 0 {
                let shown = self.source.peek(BLOCK.max(stride))?;
                let fitting =
                    (shown.len() / stride).min(usize::try_from(left).unwrap_or(usize::MAX));
                if fitting == 0 {
                    return Err(self.ends_early(element, left));
                }
                let bytes = &shown[..fitting * stride];
                each(Rows {
                    bytes,
                    stride,
                    encoding,
                });
                self.source.consume(fitting * stride);
                left -= fitting as u64;
            }
            return Ok(());
        }
        let (mut bytes, mut scalars) = (Vec::new(), Vec::new());
        while left > 0 {
            bytes.clear();
            let some = left.min(ROWS);
            for _ in 0..some {
                self.read_row(element, &mut scalars, &mut [])?;
                bytes.extend(scalars.iter().flat_map(|s: &f64| s.to_le_bytes()));
            }
            each(Rows {
                bytes: &bytes,
                stride,
                encoding: Encoding::LittleEndian,
            });
            left -= some;
        }
        Ok(())
    }

    fn read_faces(&mut self, element: &Element) -> Result<()> {
        let Some(corners) = element.properties.iter().position(is_corners) else {
            return Err(self
                .source
                .error("element \"face\" has no corners")
                .help("it needs a property \"list uchar int vertex_indices\""));
        };
        let Kind::List { count, item } = element.properties[corners].kind else {
            return Err(self.source.error("the corners of a face must be a list"));
        };
        if !item.is_integer() {
            return Err(self
                .source
                .error("the corners of a face must be whole numbers"));
        }
        let texnumber = element.scalar("texnumber").filter(|_| self.bare);
        let wanted = Wanted {
            prefix: "face_",
            taken: texnumber.as_slice(),
            bare: self.bare,
        };
        let plans = attributes::plan(element, &wanted, &mut self.decoded.warnings);
        let ranges: Vec<_> = plans.iter().map(|p| p.ranges.clone()).collect();
        let sources: Vec<Vec<usize>> = plans.iter().map(|p| p.properties.clone()).collect();
        // A face of three corners takes so many bytes; fans only grow beyond it.
        let triangle = element.least_row(self.encoding)
            + 3 * if self.encoding == Encoding::Ascii {
                2
            } else {
                item.size() as u64
            };
        let fitting = element.count.min(self.source.remaining() / triangle + 1);
        let fitting = usize::try_from(fitting).expect("the file holds so many rows");
        let wedges = element
            .properties
            .iter()
            .position(|p| self.bare && p.name == WEDGES && matches!(p.kind, Kind::List { .. }));
        let numbers: usize = sources.iter().map(Vec::len).sum();
        let numbers = numbers + wedges.map_or(0, |_| 6) + texnumber.map_or(0, |_| 2);
        let row = size_of::<[u32; 3]>() + numbers * size_of::<f32>();
        self.take(fitting, row)?;
        let mut room = fitting;
        let mut attributes = start(plans, Per::Face, fitting);
        let mut triangles: Vec<[u32; 3]> = Vec::with_capacity(fitting);

        let common = element.properties.len() == 1
            && count.size() == 1
            && item.size() == 4
            && self.encoding != Encoding::Ascii;
        let mut scalars = Vec::new();
        let mut lists = vec![List::at(corners)];
        lists.extend(wedges.map(List::at));
        let (mut degenerate, mut unfit, mut face) = (0_u64, 0_u64, 0);
        while face < element.count {
            if common {
                face += self.read_triangles(element.count - face, &mut triangles)?;
                if face == element.count {
                    break;
                }
            }
            self.read_row(element, &mut scalars, &mut lists)
                .map_err(|e| {
                    e.help(format!(
                        "{} faces were promised, and this is face {face}",
                        element.count
                    ))
                })?;
            let polygon = &lists[0].items;
            if let Some(&wrong) = polygon
                .iter()
                .find(|&&i| !(i >= 0.0 && i < self.vertices as f64 && i.fract() == 0.0))
            {
                return Err(self.out_of_range(face, wrong));
            }
            degenerate += u64::from(polygon.len() < 3);
            let wanted = triangles.len() + polygon.len();
            if wanted > room {
                // Lists that grow are twice as long as before, and copied there.
                let grown = wanted.max(2 * room);
                self.take(grown, row + Polygons::ROW)?;
                room = grown;
            }
            let polygons = &mut self.decoded.polygons;
            polygons.push(triangles.len(), polygon.len());
            // In range of `vertices`, which fits into 32 bits.
            let at = |i: usize| polygon[i] as u32;
            let uvs = lists.get(1).map(|list| &list.items);
            let fits = uvs.is_none_or(|uvs| uvs.len() == 2 * polygon.len());
            unfit += u64::from(!fits);
            let uv = |i: usize| match uvs {
                Some(uvs) if fits => Vec2::new(uvs[2 * i] as f32, uvs[2 * i + 1] as f32),
                _ => Vec2::ZERO,
            };
            for i in 2..polygon.len() {
                triangles.push([at(0), at(i - 1), at(i)]);
                if wedges.is_some() {
                    self.wedges.push([uv(0), uv(i - 1), uv(i)]);
                }
                self.texnumbers
                    .extend(texnumber.map(|place| scalars[place]));
                for (attribute, sources) in attributes.iter_mut().zip(&sources) {
                    attribute
                        .values
                        .extend(sources.iter().map(|&i| scalars[i] as f32));
                }
            }
            face += 1;
        }
        if degenerate > 0 {
            let warning =
                format!("{degenerate} faces left out: they have fewer than three corners");
            self.decoded.warnings.push(warning);
        }
        if unfit > 0 {
            self.decoded.warnings.push(format!(
                "{unfit} faces have not two texture coordinates a corner: 0 stands for them"
            ));
        }
        self.divide_colors(&mut attributes, &ranges);
        self.decoded.mesh.triangles = triangles;
        self.decoded.mesh.attributes.append(&mut attributes);
        Ok(())
    }

    /// The common layout, a byte and three 32-bit indices: reads triangles until a face is none, and
    /// returns how many.
    fn read_triangles(&mut self, most: u64, triangles: &mut Vec<[u32; 3]>) -> Result<u64> {
        const ROW: usize = 13;
        let before = triangles.len();
        let done = |triangles: &Vec<_>| (triangles.len() - before) as u64;
        let encoding = self.encoding;
        // The first face may be none, as all others.
        let mut block = ROW;
        loop {
            let (rows, _) = self.source.peek(block)?.as_chunks::<ROW>();
            let left = usize::try_from(most - done(triangles)).unwrap_or(usize::MAX);
            let rows = &rows[..rows.len().min(left)];
            let are_triangles = |rows: &[[u8; ROW]]| rows.iter().all(|row| row[0] == 3);
            // Among polygons there are many short runs.
            let many = rows.len() >= GRAIN
                && are_triangles(&rows[..GRAIN])
                && rows.par_chunks(GRAIN).all(are_triangles);
            let rows = if many {
                rows
            } else {
                let end = rows.iter().position(|row| row[0] != 3);
                &rows[..end.unwrap_or(rows.len())]
            };
            if rows.is_empty() {
                return Ok(done(triangles));
            }
            let first = triangles.len();
            let triangle = |&[_, ref row @ ..]: &[u8; ROW]| {
                let (indices, _) = row.as_chunks();
                std::array::from_fn(|i| match encoding {
                    Encoding::BigEndian => u32::from_be_bytes(indices[i]),
                    _ => u32::from_le_bytes(indices[i]),
                })
            };
            if many {
                let rows = rows.par_iter().with_min_len(GRAIN);
                triangles.par_extend(rows.map(triangle));
            } else {
                triangles.extend(rows.iter().map(triangle));
            }
            let used = ROW * rows.len();
            self.source.consume(used);
            let new = triangles[first..].as_flattened();
            let highest = new.par_chunks(3 * GRAIN).map(|indices| {
                indices
                    .iter()
                    .fold(0, |highest: u32, index| highest.max(*index))
            });
            if highest.max().map(u64::from) >= Some(self.vertices) {
                let is_wrong = |t: &[u32; 3]| t.iter().any(|&i| u64::from(i) >= self.vertices);
                let at = first + triangles[first..].iter().position(is_wrong).unwrap_or(0);
                let wrong = triangles[at].into_iter().fold(0, u32::max);
                // Faces before this one may have been polygons: the number counts triangles.
                return Err(self.out_of_range(at as u64, f64::from(wrong)));
            }
            block = BLOCK;
        }
    }

    /// Reads one row: its scalars, one a property (0 for a list), and the lists that are wanted.
    fn read_row(
        &mut self,
        element: &Element,
        scalars: &mut Vec<f64>,
        wanted: &mut [List],
    ) -> Result<()> {
        scalars.clear();
        for (i, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::Scalar(scalar) => {
                    let value = self.read_scalar(scalar)?;
                    scalars.push(value);
                }
                Kind::List { count, item } => {
                    scalars.push(0.0);
                    let length = self.read_scalar(count)?;
                    let least = if self.encoding == Encoding::Ascii {
                        2
                    } else {
                        item.size()
                    };
                    let remaining = self.source.remaining();
                    // One more, as the last number of an ASCII file may end the file.
                    if !(length >= 0.0
                        && length * least as f64 <= remaining as f64 + 1.0
                        && length.fract() == 0.0)
                    {
                        return Err(self.source.error(format!(
                            "a list {:?} cannot have {length} items, as {remaining} bytes follow",
                            property.name
                        )));
                    }
                    let length = length as u64;
                    match wanted.iter_mut().find(|list| list.place == i) {
                        Some(List { items, .. }) => {
                            items.clear();
                            let bytes = length.saturating_mul(2 * size_of::<f64>() as u64);
                            self.source.account.cover(&mut self.widest, bytes)?;
                            for _ in 0..length {
                                let value = self.read_scalar(item)?;
                                items.push(value);
                            }
                        }
                        _ if self.encoding == Encoding::Ascii => {
                            for _ in 0..length {
                                self.read_scalar(item)?;
                            }
                        }
                        _ => self.source.skip(length * item.size() as u64)?,
                    }
                }
            }
        }
        Ok(())
    }

    fn read_scalar(&mut self, scalar: Scalar) -> Result<f64> {
        if self.encoding == Encoding::Ascii {
            return self.source.number();
        }
        let size = scalar.size();
        let shown = self.source.peek(size)?;
        if shown.len() < size {
            return Err(self.source.error("the file ends too early"));
        }
        let value = scalar.decode(shown, self.encoding);
        self.source.consume(size);
        Ok(value)
    }

    fn skip(&mut self, element: &Element) -> Result<()> {
        match element.stride() {
            // Rows of nothing take no time, however many.
            Some(0) => Ok(()),
            Some(stride) if self.encoding != Encoding::Ascii => self
                .source
                .skip(element.count.saturating_mul(stride as u64)),
            _ => {
                let mut scalars = Vec::new();
                (0..element.count).try_for_each(|_| self.read_row(element, &mut scalars, &mut []))
            }
        }
    }

    /// Asks for memory.
    fn take(&self, rows: usize, size: usize) -> Result<()> {
        self.source.account.take_rows(rows as u64, size)
    }

    fn ends_early(&self, element: &Element, left: u64) -> crate::error::Error {
        let Element { name, count, .. } = element;
        self.source.error(format!(
            "the file ends early: {left} of {count} rows of element {name:?} are missing"
        ))
    }

    fn out_of_range(&self, face: u64, index: f64) -> crate::error::Error {
        let n = self.vertices;
        let range = if n == 0 {
            "has no vertices".to_owned()
        } else {
            format!("has vertices 0 to {}", n - 1)
        };
        self.source.error(format!(
            "face {face}: vertex index {index} is out of range; the file {range}"
        ))
    }
}

/// A list that is read.
struct List {
    /// Of its property.
    place: usize,
    items: Vec<f64>,
}

impl List {
    fn at(place: usize) -> Self {
        Self {
            place,
            items: Vec::new(),
        }
    }
}

/// Whether a list is that of a face's corners.
fn is_corners(property: &header::Property) -> bool {
    let mut names = ["vertex_indices", "vertex_index"].into_iter();
    names.any(|name| property.name.eq_ignore_ascii_case(name))
}

/// Attributes that have no values yet.
fn start(plans: Vec<Plan>, per: Per, rows: usize) -> Vec<Attribute> {
    let attribute = |plan: Plan| {
        let channels = plan.properties.len();
        Attribute {
            name: plan.name,
            channels,
            per,
            values: Vec::with_capacity(rows * channels),
        }
    };
    plans.into_iter().map(attribute).collect()
}

fn triple(columns: &[Column]) -> [Column; 3] {
    columns.try_into().expect("three names were looked for")
}

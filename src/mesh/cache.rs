//! Vertex normals on disk, 12 bytes a vertex: those of a large mesh are sooner read than computed. A file is named
//! after a hash of the vertices and triangles, in the world, that they were computed from. Its length and its checksum
//! are held against it; normals that were forged are of odd lengths at worst, and shading makes every one unit.

use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::path::Path;

use glam::Vec3;
use rayon::prelude::*;

use super::{GRAIN, Mesh, zeros};
use crate::error::Error;
use crate::file;

/// What every file begins with. The number changes whenever normals are computed otherwise.
const MAGIC: &[u8; 16] = b"etendue normals1";
/// Bytes before the normals: the above, and a number that tells the order of bytes.
const HEAD: usize = 24;
/// Triangles of a mesh whose normals are kept.
const LARGE: usize = 1 << 16;

impl Mesh {
    /// Whether normals are sooner read than computed.
    pub fn is_large(&self) -> bool {
        self.triangles.len() >= LARGE
    }

    /// [`Mesh::compute_normals`], unless the `folder` has them from an earlier time; there they are left. `hash` is
    /// [`Mesh::triangles_hash`]. What goes wrong with files is returned, and does no harm.
    pub fn compute_normals_once(&mut self, hash: &blake3::Hash, folder: &Path) -> Option<Error> {
        let path = folder.join(format!("{}.normals", hash.to_hex()));
        let mut problem = None;
        match read(&path, hash, self.positions.len()) {
            Ok(normals) => {
                self.normals = normals;
                return None;
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => {
                let message = format!(
                    "the normals in {} are computed anew: {error}",
                    path.display()
                );
                problem = Some(Error::input(message));
            }
        }
        self.compute_normals();
        let written = file::leave(&path, |file| write(file, hash, &self.normals));
        problem.or_else(|| {
            written
                .err()
                .map(|error| Error::system("write", &path, &error))
        })
    }
}

fn head() -> [u8; HEAD] {
    let mut head = [0; HEAD];
    head[..16].copy_from_slice(MAGIC);
    head[16..].copy_from_slice(&1_u64.to_ne_bytes());
    head
}

fn read(path: &Path, key: &blake3::Hash, count: usize) -> io::Result<Vec<Vec3>> {
    const NORMAL: usize = size_of::<Vec3>();
    let file = File::open(path)?;
    let end = (HEAD + NORMAL * count) as u64;
    if file.metadata()?.len() != end + blake3::OUT_LEN as u64 {
        return Err(io::Error::other("the file's length is wrong"));
    }
    let (mut found, mut sealed) = ([0; HEAD], [0; blake3::OUT_LEN]);
    file::read_at(&file, 0, &mut found)?;
    file::read_at(&file, end, &mut sealed)?;
    if found != head() {
        return Err(io::Error::other("the file is none of this version"));
    }
    let mut normals = zeros(count);
    let parts = normals.par_chunks_mut(GRAIN).enumerate();
    let sums: io::Result<Vec<u32>> = parts
        .map(|(part, normals)| {
            let mut bytes = vec![[0; NORMAL]; normals.len()];
            let at = HEAD + part * GRAIN * NORMAL;
            file::read_at(&file, at as u64, bytes.as_flattened_mut())?;
            for (normal, bytes) in normals.iter_mut().zip(&bytes) {
                let (numbers, _) = bytes.as_chunks();
                *normal = Vec3::from_array(std::array::from_fn(|i| f32::from_ne_bytes(numbers[i])));
            }
            Ok(crc32fast::hash(bytes.as_flattened()))
        })
        .collect();
    if file::seal(key, &sums?) != blake3::Hash::from_bytes(sealed) {
        return Err(io::Error::other("the file is damaged"));
    }
    Ok(normals)
}

fn write(out: &mut dyn Write, key: &blake3::Hash, normals: &[Vec3]) -> io::Result<()> {
    out.write_all(&head())?;
    let mut sums = Vec::new();
    for normals in normals.chunks(GRAIN) {
        let bytes: Vec<_> = (normals.iter())
            .flat_map(|normal| normal.to_array().map(f32::to_ne_bytes))
            .collect();
        sums.push(crc32fast::hash(bytes.as_flattened()));
        out.write_all(bytes.as_flattened())?;
    }
    out.write_all(file::seal(key, &sums).as_bytes())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::mesh::sphere;

    fn large() -> Mesh {
        let mut mesh = sphere(400, 200);
        mesh.drop_normals();
        assert!(mesh.is_large());
        mesh
    }

    fn once(mesh: &mut Mesh, folder: &Path) -> Option<Error> {
        let hash = mesh.triangles_hash();
        mesh.compute_normals_once(&hash, folder)
    }

    fn files(folder: &Path) -> Vec<std::path::PathBuf> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().path()).collect()
    }

    #[test]
    fn normals_come_from_the_folder_as_they_were_computed() {
        let folder = tempfile::tempdir().unwrap();
        let kept = folder.path().join("new");
        let mut computed = large();
        computed.compute_normals();
        for _ in 0..2 {
            let mut mesh = large();
            assert!(once(&mut mesh, &kept).is_none());
            assert_eq!(mesh, computed);
        }
        assert_eq!(files(&kept).len(), 1);
        // That they are read is seen where they are others, properly sealed.
        let other = vec![Vec3::Y; computed.positions.len()];
        let key = large().triangles_hash();
        file::leave(&files(&kept)[0], |file| write(file, &key, &other)).unwrap();
        let mut mesh = large();
        assert!(once(&mut mesh, &kept).is_none());
        assert_eq!(mesh.normals, other);
        let mut moved = large();
        moved.positions[7].x += 1e-3;
        assert!(once(&mut moved, &kept).is_none());
        assert_eq!(files(&kept).len(), 2);
    }

    #[test]
    fn a_damaged_file_is_told_and_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let mut good = large();
        assert!(once(&mut good, folder.path()).is_none());
        let path = &files(folder.path())[0];
        let bytes = fs::read(path).unwrap();
        let damages: [(usize, &str); 5] = [
            (3, "none of this version"),
            (20, "none of this version"),
            (HEAD + 5, "damaged"),
            (bytes.len() / 2, "damaged"),
            (bytes.len() - 1, "damaged"),
        ];
        for (place, what) in damages {
            let mut damaged = bytes.clone();
            damaged[place] ^= 4;
            fs::write(path, damaged).unwrap();
            let mut mesh = large();
            let problem = once(&mut mesh, folder.path()).unwrap().to_string();
            assert!(problem.contains(what), "{problem}");
            assert_eq!(mesh, good);
            assert_eq!(fs::read(path).unwrap(), bytes);
        }
        for length in [0, HEAD, bytes.len() - 1] {
            fs::write(path, &bytes[..length]).unwrap();
            let problem = once(&mut large(), folder.path()).unwrap();
            assert!(problem.to_string().contains("length"), "{problem}");
        }
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        let mut mesh = large();
        assert!(once(&mut mesh, &file.join("folder")).is_some());
        assert_eq!(mesh.normals.len(), mesh.positions.len());
    }
}

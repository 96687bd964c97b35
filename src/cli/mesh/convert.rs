//! `etendue mesh convert`: any mesh file as a binary PLY.

use std::path::{Path, PathBuf};

use clap::Args;
use etendue::error::{Error, Location, Result};
use etendue::mesh::{self, Mesh, Parts};
use serde_json::json;

use super::super::memory::MemoryArguments;
use super::super::stop::Stop;
use super::super::{output, report, status};

/// Write a mesh as a binary PLY file
///
/// The file looks the same in Étendue and in Mitsuba as the mesh that it is made from: vertices in their order, normals,
/// texture coordinates and attributes (colours too, as vertex_color and face_color) are kept, and normals
/// that are missing stay missing, to be computed by who reads it. The primitives of a glTF scene are placed, and flat
/// where they have no normals; the colours of OBJ and glTF materials become face_color.
///
/// Several meshes in one file (glTF primitives, OBJ objects, or groups where there are none, serialized shapes) are
/// merged into one, or with --split written to files of their own.
#[derive(Args, Debug)]
#[command(after_long_help = HELP)]
pub(in crate::cli) struct Arguments {
    /// Mesh (.ply, .obj, .stl, .serialized, .gltf, .glb)
    input: PathBuf,
    /// Where it goes: .ply
    #[arg(value_name = "OUT.ply")]
    output: PathBuf,
    /// Write each mesh of the file to a file of its own, OUT-0.ply, OUT-1-NAME.ply and so on
    #[arg(long)]
    split: bool,
    /// Print a JSON object for each file that is written
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    memory: MemoryArguments,
    /// No word on what was written, no warnings
    #[arg(short, long)]
    quiet: bool,
}

const HELP: &str = "\
Examples:
  etendue mesh convert dragon.obj dragon.ply
  etendue mesh convert scene.glb scene.ply --split
  etendue mesh convert scan.stl scan.ply && etendue render scan.ply -o scan.png

Exit status: 0 done; 1 the input is wrong; 2 the command line is wrong; 3 the system refused.";

/// Runs the command; the answer is the exit status.
pub(in crate::cli) fn run(arguments: &Arguments) -> Result<u8> {
    Stop::without_a_trace(vec![arguments.output.clone()])?;
    check_output(&arguments.output)?;
    let mut read = mesh::read_parts(&arguments.input, &arguments.memory.budget())?;
    if !arguments.quiet {
        report::warnings(&read.warnings);
    }
    if arguments.split {
        let count = read.parts.len();
        for (number, part) in read.parts.iter().enumerate() {
            let output = part_path(&arguments.output, number, count, &part.name);
            write(arguments, &output, &part.name, &part.mesh)?;
        }
    } else {
        merge(arguments, &mut read);
        write(arguments, &arguments.output, "", &read.merged())?;
    }
    Ok(status::DONE)
}

/// That a PLY file could be written there.
pub(super) fn check_output(output: &Path) -> Result<()> {
    let extension = output.extension().unwrap_or_default();
    if !extension.eq_ignore_ascii_case("ply") {
        let message = format!(
            "meshes are written as .ply, and {} is none",
            output.display()
        );
        return Err(Error::input(message));
    }
    mesh::check_writable(output)
}

/// Says what merging does.
fn merge(arguments: &Arguments, read: &mut Parts) {
    let count = read.parts.len();
    if arguments.quiet || count < 2 {
        return;
    }
    let with = |has: fn(&Mesh) -> bool| read.parts.iter().filter(|p| has(&p.mesh)).count();
    let mut lost = Vec::new();
    for (what, with) in [
        ("texture coordinates", with(|m| !m.uvs.is_empty())),
        ("attributes", with(|m| !m.attributes.is_empty())),
    ] {
        if with > 0 && with < count {
            lost.push(format!("{what} are lost, which only {with} of them have"));
        }
    }
    let message = format!("{count} meshes are merged into one");
    let message = [vec![message], lost].concat().join("; ");
    let note = Error::input(message)
        .at(&Location::of_file(&arguments.input))
        .help("--split writes each to a file of its own");
    report::warnings(note.problems());
}

fn write(arguments: &Arguments, output: &Path, name: &str, mesh: &Mesh) -> Result<()> {
    mesh::write_ply(output, mesh)?;
    let (triangles, vertices) = (mesh.triangles.len(), mesh.positions.len());
    if arguments.json {
        let object = json!({
            "file": output.display().to_string(),
            "name": name,
            "triangles": triangles,
            "vertices": vertices,
        });
        output::object(object);
    } else if !arguments.quiet {
        output::line(&told(output, triangles, vertices));
    }
    Ok(())
}

/// A line on a file that was written.
pub(super) fn told(output: &Path, triangles: usize, vertices: usize) -> String {
    format!(
        "{}: {triangles} triangles, {vertices} vertices",
        output.display()
    )
}

/// The name of a part's file, of `count`.
fn part_path(output: &Path, number: usize, count: usize, name: &str) -> PathBuf {
    /// Of a part's name.
    const LONGEST: usize = 64;
    let digits = count.saturating_sub(1).to_string().len();
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    let mut file = format!("{stem}-{number:0digits$}");
    let plain = |c: char| c.is_alphanumeric() || c == '_' || c == '-' || c == '.';
    let words = name.split(|c| !plain(c)).filter(|word| !word.is_empty());
    let name = words.collect::<Vec<_>>().join("-");
    if !name.is_empty() {
        file.push('-');
        file.extend(name.chars().take(LONGEST));
    }
    output.with_file_name(file + ".ply")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_of_parts_sort_as_the_parts_do_and_have_names_that_every_system_takes() {
        let path = |number, count, name| part_path(Path::new("out/a.b.ply"), number, count, name);
        assert_eq!(
            path(3, 12, "Left / door.001"),
            Path::new("out/a.b-03-Left-door.001.ply")
        );
        assert_eq!(path(0, 1, " ../ "), Path::new("out/a.b-0-...ply"));
        assert_eq!(path(7, 8, ""), Path::new("out/a.b-7.ply"));
        let long = path(0, 2, &"x".repeat(1000));
        assert!(long.as_os_str().len() < 90);
    }
}

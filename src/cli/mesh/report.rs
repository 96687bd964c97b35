//! `etendue mesh report`: the measures of meshes and what is wrong with them.

use std::path::{Path, PathBuf};

use clap::Args;
use etendue::error::{Location, Result};
use etendue::mesh::{self, Report};
use serde_json::{Value, json};

use super::super::memory::MemoryArguments;
use super::super::{info, output, report, status};

/// Measure meshes, and count what is wrong with them
///
/// Vertices at one place count as one, so that seams of normals and texture coordinates are no holes. A mesh is closed
/// where each edge has as many triangles that run along it as against it; its volume is negative where its outside is
/// in. Of a file with several meshes (glTF primitives, OBJ objects, or groups where there are none, serialized
/// shapes), the parts' counts follow the whole's.
#[derive(Args, Debug)]
#[command(after_long_help = HELP)]
pub(in crate::cli) struct Arguments {
    /// Meshes (.ply, .obj, .stl, .serialized, .gltf, .glb)
    #[arg(required = true, value_name = "FILE")]
    inputs: Vec<PathBuf>,
    /// Print a JSON object for each file
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    memory: MemoryArguments,
    /// No warnings
    #[arg(short, long)]
    quiet: bool,
}

const HELP: &str = "\
Examples:
  etendue mesh report bunny.ply
  etendue mesh report *.stl --json | jq -r 'select(.closed | not) | .file'

Exit status: 0 done, whatever is wrong with the meshes; 1 a file cannot be understood; 2 the command line is wrong; \
3 the system refused.";

/// Runs the command; the answer is the exit status.
pub(in crate::cli) fn run(arguments: &Arguments) -> Result<u8> {
    let mut worst = status::DONE;
    for input in &arguments.inputs {
        match examine(arguments, input) {
            Ok(object) if arguments.json => output::object(object),
            Ok(object) => {
                output::line(&input.display().to_string());
                info::print(&object, 1);
            }
            Err(error) => {
                report::error(&error);
                worst = worst.max(status::of(&error));
            }
        }
    }
    Ok(worst)
}

fn examine(arguments: &Arguments, input: &Path) -> Result<Value> {
    let budget = arguments.memory.budget();
    let read = mesh::read_parts(input, &budget)?;
    if !arguments.quiet {
        report::warnings(&read.warnings);
    }
    let parts = (read.parts.iter()).map(|part| {
        json!({
            "name": part.name,
            "vertices": part.mesh.positions.len(),
            "triangles": part.mesh.triangles.len(),
        })
    });
    let parts: Vec<Value> = parts.collect();
    let dropped = read.dropped_triangles;
    // Its edges, and the places of its vertices.
    const BYTES: u64 = 56;
    let whole = read.merged();
    let taken = budget.take(BYTES * whole.triangles.len() as u64);
    taken.map_err(|e| e.at(&Location::of_file(input)))?;
    let whole = Report::of(&whole);
    let mut object = serde_json::to_value(&whole).expect("it has only names and numbers");
    object["dropped_triangles"] = dropped.into();
    if parts.len() > 1 {
        object["parts"] = parts.into();
    }
    if arguments.json {
        object["file"] = input.display().to_string().into();
    }
    Ok(object)
}

//! `etendue mesh generate`: meshes of any size, for tests, benches and pictures.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use etendue::budget::{Budget, human_bytes};
use etendue::error::{Error, Result};
use etendue::mesh::{self, Bumps, Mesh};
use serde_json::json;

use super::super::stop::Stop;
use super::super::{memory, output, parse, report, status};
use super::convert;

/// Make a mesh of any size
///
/// The same options give the same file, to the bit, on every machine and with any number of threads. What would take more
/// memory than there is is refused before any is taken.
#[derive(Args, Debug)]
#[command(after_long_help = HELP)]
pub(in crate::cli) struct Arguments {
    #[command(subcommand)]
    kind: Kind,
    /// Refuse to take more memory, such as 8G; "none" for no limit. By default 90 % of what is free
    #[arg(long, value_name = "SIZE", value_parser = parse::bytes, global = true)]
    memory_limit: Option<u64>,
    /// Print a JSON object: file, triangles, vertices
    #[arg(long, global = true)]
    json: bool,
    /// No word on what was written, no warnings
    #[arg(short, long, global = true)]
    quiet: bool,
}

#[derive(Debug, Subcommand)]
enum Kind {
    /// Hills over the square [-1, 1]^2, seen from +z
    Terrain {
        /// Where it goes: .ply
        #[arg(value_name = "OUT.ply")]
        output: PathBuf,
        #[command(flatten)]
        size: Size,
    },
    /// Long, thin, curled strands that stand on the unit sphere, a hard test for any tree
    Hair {
        /// Where it goes: .ply
        #[arg(value_name = "OUT.ply")]
        output: PathBuf,
        #[command(flatten)]
        size: Size,
    },
    /// Haines's sphere flake: nine balls on each ball
    Flake {
        /// Where it goes: .ply (triangles), or .xml, a scene of spheres and instances that Mitsuba reads too
        #[arg(value_name = "OUT")]
        output: PathBuf,
        /// Levels of balls on balls: 4 has 7381 balls, 8 has 48 million
        #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(..=10))]
        levels: u32,
        /// Of triangles, cut each ball of 20 triangles so many times in four
        #[arg(long, value_name = "N", default_value_t = 2)]
        subdivisions: u32,
    },
    /// Menger's sponge in [-1, 1]^3
    Menger {
        /// Where it goes: .ply
        #[arg(value_name = "OUT.ply")]
        output: PathBuf,
        /// Levels of holes in what is between holes: 3 has 36096 triangles, 5 has 13 million
        #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(..=6))]
        levels: u32,
    },
    /// A ball, a box or any mesh with finer triangles, and with bumps if you like
    Shape {
        /// Where it goes: .ply
        #[arg(value_name = "OUT.ply")]
        output: PathBuf,
        /// What is made finer: ball, box or a mesh file
        #[arg(long, value_name = "WHAT", default_value = "ball")]
        of: String,
        /// Cut each triangle so many times in four
        #[arg(long, value_name = "N", default_value_t = 0)]
        subdivisions: u32,
        /// Cut triangles until no edge is longer, in the mesh's units
        #[arg(long, value_name = "LENGTH", value_parser = parse::positive)]
        edge: Option<f64>,
        /// Height of the bumps, as a part of the diagonal of the mesh's box
        #[arg(long, value_name = "PART", allow_negative_numbers = true)]
        bumps: Option<f64>,
        /// Width of the largest bumps, as a part of that diagonal
        #[arg(long, value_name = "PART", default_value_t = 0.15, value_parser = parse::positive)]
        bump_width: f64,
        /// Sizes of bumps, each half as large as the one before
        #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=30))]
        octaves: u32,
        /// Chooses the bumps
        #[arg(long, value_name = "N", default_value_t = 0)]
        seed: u64,
    },
}

/// How large a mesh of chance is, and which one.
#[derive(Args, Clone, Copy, Debug)]
struct Size {
    /// About so many triangles: 5000, 250k, 10M
    #[arg(long, value_name = "N", default_value = "100k", value_parser = parse::count)]
    triangles: u32,
    /// Another seed, another mesh
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

const HELP: &str = "\
Examples:
  etendue mesh generate terrain hills.ply --triangles 10M --seed 7
  etendue mesh generate flake flake.xml --levels 8 && etendue render flake.xml -o flake.png
  etendue mesh generate menger sponge.ply --levels 4
  etendue mesh generate shape asteroid.ply --subdivisions 7 --bumps 0.1 --seed 3
  etendue mesh generate shape rough.ply --of bunny.ply --edge 0.002 --bumps 0.003 --bump-width 0.02

Exit status: 0 done; 1 the mesh would be too large, or its base is wrong; 2 the command line is wrong; \
3 the system refused.";

/// Runs the command; the answer is the exit status.
pub(in crate::cli) fn run(arguments: &Arguments) -> Result<u8> {
    Stop::without_a_trace(vec![arguments.kind.output().to_owned()])?;
    let Kind::Flake { output, levels, .. } = &arguments.kind else {
        return write(arguments);
    };
    if !output
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("xml"))
    {
        return write(arguments);
    }
    mesh::write_text(output, &mesh::flake_scene(*levels))?;
    let spheres = mesh::flake_balls(*levels).expect("there are not so many levels");
    if arguments.json {
        let object = json!({ "file": output.display().to_string(), "spheres": spheres });
        output::object(object);
    } else if !arguments.quiet {
        output::line(&format!("{}: {spheres} spheres", output.display()));
    }
    Ok(status::DONE)
}

fn write(arguments: &Arguments) -> Result<u8> {
    let output = arguments.kind.output();
    convert::check_output(output)?;
    let mesh = arguments.make()?;
    mesh::write_ply(output, &mesh)?;
    let (triangles, vertices) = (mesh.triangles.len(), mesh.positions.len());
    if arguments.json {
        let file = output.display().to_string();
        let object = json!({ "file": file, "triangles": triangles, "vertices": vertices });
        output::object(object);
    } else if !arguments.quiet {
        output::line(&convert::told(output, triangles, vertices));
    }
    Ok(status::DONE)
}

impl Kind {
    fn output(&self) -> &Path {
        match self {
            Self::Terrain { output, .. }
            | Self::Hair { output, .. }
            | Self::Flake { output, .. }
            | Self::Menger { output, .. }
            | Self::Shape { output, .. } => output,
        }
    }
}

/// No mesh has more triangles: twice as many as vertices that 32 bits number.
const MOST: u64 = 1 << 33;

impl Arguments {
    fn make(&self) -> Result<Mesh> {
        match &self.kind {
            Kind::Terrain { size, .. } => {
                self.check(u64::from(size.triangles), 18)?;
                Ok(mesh::terrain(size.triangles, size.seed))
            }
            Kind::Hair { size, .. } => {
                self.check(u64::from(size.triangles), 25)?;
                Ok(mesh::hair(size.triangles, size.seed))
            }
            Kind::Flake {
                levels,
                subdivisions,
                ..
            } => {
                let balls = mesh::flake_balls(*levels).unwrap_or(u64::MAX);
                let triangles = balls.saturating_mul(cut(20, *subdivisions));
                self.check(triangles, 25)?;
                if triangles / 2 + 2 * balls > u64::from(u32::MAX) {
                    return Err(too_many(triangles));
                }
                Ok(mesh::flake(*levels, *subdivisions))
            }
            Kind::Menger { levels, .. } => {
                let triangles = mesh::menger_triangles(*levels).unwrap_or(u64::MAX);
                self.check(triangles, 30)?;
                Ok(mesh::menger(*levels))
            }
            Kind::Shape { .. } => self.shape(),
        }
    }

    fn shape(&self) -> Result<Mesh> {
        let Kind::Shape {
            of,
            subdivisions,
            edge,
            bumps,
            bump_width,
            octaves,
            seed,
            ..
        } = &self.kind
        else {
            unreachable!("asked for no other kind");
        };
        // Positions, normals and, while edges are cut, the coarser mesh and the cuts.
        const BYTES: u64 = 70;
        let mut base = match of.as_str() {
            "ball" => {
                self.check(cut(20, *subdivisions), BYTES)?;
                mesh::ball(*subdivisions)
            }
            "box" => {
                self.check(cut(12, *subdivisions), BYTES)?;
                mesh::block(*subdivisions)
            }
            file => {
                let read = mesh::read_parts(Path::new(file), &Budget::new(self.limit()))?;
                if !self.quiet {
                    report::warnings(&read.warnings);
                }
                let mut mesh = read.merged();
                let after = cut(mesh.triangles.len() as u64, *subdivisions);
                self.check(after, BYTES)?;
                let cut = mesh.subdivide(*subdivisions, usize::MAX);
                cut.map_err(|many| too_many(many.0 as u64))?;
                mesh
            }
        };
        if let Some(edge) = edge {
            let most = self.limit().map_or(MOST, |limit| limit / BYTES);
            let cut = base.tessellate(*edge as f32, usize::try_from(most).unwrap_or(usize::MAX));
            cut.map_err(|many| {
                self.check(many.0 as u64, BYTES)
                    .err()
                    .unwrap_or_else(|| too_many(many.0 as u64))
            })?;
        }
        if let Some(height) = *bumps {
            let bumps = Bumps {
                height,
                width: *bump_width,
                octaves: *octaves,
                seed: *seed,
            };
            mesh::add_bumps(&mut base, &bumps);
        }
        Ok(base)
    }

    fn limit(&self) -> Option<u64> {
        memory::limit(self.memory_limit)
    }

    /// Refuses what takes more memory than is allowed, at so many bytes a triangle.
    fn check(&self, triangles: u64, bytes: u64) -> Result<()> {
        if triangles > MOST {
            return Err(too_many(triangles));
        }
        let wanted = triangles.saturating_mul(bytes);
        match self.limit() {
            Some(limit) if wanted > limit => {
                let (wanted, limit) = (human_bytes(wanted), human_bytes(limit));
                let message = format!(
                    "a mesh of {triangles} triangles would take about {wanted}, more than the limit of {limit}"
                );
                Err(Error::input(message)
                    .help("make it smaller, or raise the limit (--memory-limit)"))
            }
            _ => Ok(()),
        }
    }
}

fn too_many(triangles: u64) -> Error {
    let count = match triangles {
        u64::MAX => "so many".to_owned(),
        n => n.to_string(),
    };
    Error::input(format!("{count} triangles are more than a mesh can have"))
}

/// Triangles after each was cut in four so many times.
fn cut(triangles: u64, times: u32) -> u64 {
    let factor = 4_u64.checked_pow(times).unwrap_or(u64::MAX);
    triangles.saturating_mul(factor)
}

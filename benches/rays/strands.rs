//! A head of hair as round B-splines, which Embree has too: each of a few thousandths of the head's radius, with curls.
//! Embree is told of the same control points and radii. It meets a tube from inside as well, and Étendue does not.

use std::f32::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use etendue::description::{Description, Kind, Options};
use etendue::interaction::{Hit, Ray};
use etendue::lanes::warp;
use etendue::math::{Frame, random};
use etendue::shape::{self, Geometry};
use glam::{Vec2, Vec3, Vec4};

use crate::arguments::Arguments;
use crate::embree::{self, Embree};
use crate::measure::{median, race, thread_counts};
use crate::ours;
use crate::peer::{Built, Peer, on_threads};
use crate::rays::{Stage, sets};
use crate::report::{BuildRow, BuildTime, MeshReport};

/// Segments in all, and of a strand.
const SEGMENTS: u32 = 2_000_000;
const OF_STRAND: u32 = 20;
/// In radii of the head.
const LENGTH: f32 = 0.6;
const THICKNESS: f32 = 6e-4;

/// Control points with their radii, and the first of each segment.
pub(crate) struct Strands {
    pub(crate) points: Vec<Vec4>,
    pub(crate) segments: Vec<u32>,
}

impl Strands {
    fn grown(segments: u32) -> Self {
        let (mut points, mut starts) = (Vec::new(), Vec::new());
        for strand in 0..segments / OF_STRAND {
            let unit = |dimension| {
                random::unit(random::bits(random::key(1, u64::from(strand)), dimension))
            };
            let root = warp::uniform_sphere::<f32>(Vec2::new(unit(0), unit(1)).into());
            let root = Vec3::from(root);
            let frame = Frame::around(root);
            let (turn, curl) = (TAU * unit(2), 0.02 + 0.04 * unit(3));
            starts.extend((0..OF_STRAND).map(|i| points.len() as u32 + i));
            for i in 0..OF_STRAND + 3 {
                let along = i as f32 / (OF_STRAND + 2) as f32;
                let (sin, cos) = (turn + 9.0 * along).sin_cos();
                let sideways = curl * along * (cos * frame.s + sin * frame.t);
                // The ends fall.
                let fall = Vec3::new(0.0, 0.0, -0.4 * along * along);
                let place = root * (1.0 + LENGTH * along) + sideways + fall;
                points.push(place.extend(THICKNESS * (1.0 - 0.8 * along)));
            }
        }
        Self {
            points,
            segments: starts,
        }
    }

    /// By way of the plugin's file.
    fn geometry(&self) -> Result<Geometry, String> {
        let per_strand = OF_STRAND as usize + 3;
        let mut text = String::new();
        for strand in self.points.chunks(per_strand) {
            for point in strand {
                let [x, y, z, w] = point.to_array();
                writeln!(text, "{x} {y} {z} {w}").expect("a string takes all");
            }
            text.push('\n');
        }
        let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
        let path = folder.path().join("strands.txt");
        std::fs::write(&path, text).map_err(|e| e.to_string())?;
        let scene = format!(
            "<scene version='3.0.0'><shape type='bsplinecurve'><string name='filename' value='{}'/></shape></scene>",
            path.display()
        );
        let scene = Description::parse(&scene, Path::new("strands.xml"), &Options::default());
        let scene = scene.map_err(|e| e.to_string())?;
        let shape = shape::build(&scene.root().children(Kind::Shape)[0]);
        Ok(shape.map_err(|e| e.to_string())?.geometry)
    }
}

/// Builds once with all threads, traces and compares.
pub(crate) fn measure(
    embree: Option<&Arc<Embree>>,
    arguments: &Arguments,
) -> Result<MeshReport, String> {
    let strands = Arc::new(Strands::grown(SEGMENTS));
    let geometry = Arc::new(strands.geometry()?);
    let threads = thread_counts().len();
    let start = Instant::now();
    let tracer = on_threads(threads, || ours::tracer(&geometry));
    let seconds = start.elapsed().as_secs_f64();
    let row = |name, seconds, bytes| BuildRow {
        name,
        seconds: vec![BuildTime {
            threads,
            median: seconds,
        }],
        bytes,
    };
    let mut builds = vec![row(ours::NAME, seconds, tracer.tree_bytes())];
    let mut peers: Vec<Box<dyn Peer>> = vec![ours::peer(tracer)];
    if let Some(embree) = embree.filter(|_| arguments.wants("Embree")) {
        let Built {
            peers: theirs,
            seconds,
            bytes,
        } = embree::strands(embree, &strands, threads)?;
        builds.push(row("Embree", seconds, bytes));
        peers.extend(theirs);
    }
    let normal = |ray: &Ray, hit: &Hit| geometry.interaction(ray, hit).normal;
    let stage = Stage {
        bounds: (Vec3::splat(-1.6), Vec3::splat(1.6)),
        normal: &normal,
    };
    let (mut reports, mut gains) = (Vec::new(), Vec::new());
    for set in &sets(&stage, &*peers[0], arguments.rays()) {
        let answering = peers.iter().filter(|p| p.answers(set.question));
        let answering: Vec<&dyn Peer> = answering.map(|p| &**p).collect();
        reports.push(race(set, &answering, arguments.repeat, &mut gains));
    }
    Ok(MeshReport {
        name: "strands",
        primitives: "segments",
        triangles: strands.segments.len(),
        rays: arguments.rays(),
        rounds: arguments.repeat,
        builds,
        sets: reports,
        arithmetic_gain: median(&gains),
    })
}

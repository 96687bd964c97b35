//! What all commands that read scenes have in common: the options for them, and from a file to a
//! description.

use std::path::Path;

use clap::{Args, ValueEnum};
use etendue::budget::Budget;
use etendue::description::{Description, Options};
use etendue::error::{Error, Result};
use etendue::render::{self, BareMesh, Framing, Session, Staging, UpAxis};

use super::output::with_frame;
use super::parse;

/// What images are called.
const IMAGES: [&str; 12] = [
    "exr", "hdr", "pfm", "tif", "tiff", "png", "jpg", "jpeg", "bmp", "tga", "ppm", "pgm",
];

/// Whether the file is an image, by its name.
pub(super) fn is_image(input: &Path) -> bool {
    let extension = input.extension().unwrap_or_default().to_ascii_lowercase();
    IMAGES.iter().any(|image| extension == *image)
}

/// How scenes are read.
#[derive(Args, Clone, Debug)]
pub(super) struct ReadArguments {
    /// Value of a $name parameter of the scene; {frame} stands for the frame's number, where there are frames
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse::define)]
    define: Vec<(String, String)>,
    /// Refuse what Mitsuba 3 would not read
    #[arg(long)]
    strict: bool,
}

/// How scenes and bare meshes are read.
#[derive(Args, Clone, Debug)]
pub(super) struct SceneArguments {
    #[command(flatten)]
    read: ReadArguments,
    /// Which way is up in a bare mesh
    #[arg(long, value_enum, default_value_t = Up::Auto)]
    up: Up,
}

/// Which way is up.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Up {
    /// As the format has it, unless the mesh would stand far better on its other side
    Auto,
    /// +y
    Y,
    /// +z
    Z,
}

/// Whether the file is a scene, by its name.
pub(super) fn is_scene(input: &Path) -> bool {
    input
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("xml"))
}

impl ReadArguments {
    /// The options for a frame of a scene.
    pub(super) fn options(&self, frame: Option<i64>) -> Options {
        let Some(frame) = frame else {
            return Options {
                defines: self.define.clone(),
                strict: self.strict,
                ..Options::default()
            };
        };
        let define = |(name, value): &(String, String)| (name.clone(), with_frame(value, frame));
        Options {
            defines: self.define.iter().map(define).collect(),
            offers: vec![("frame".to_owned(), frame.to_string())],
            strict: self.strict,
        }
    }
}

impl SceneArguments {
    /// The options for a frame of a scene.
    pub(super) fn options(&self, frame: Option<i64>) -> Options {
        self.read.options(frame)
    }

    /// The scene in the file, or around the mesh in it, which may take that much memory; the session has that mesh then.
    pub(super) fn describe(
        &self,
        input: &Path,
        options: &Options,
        budget: &Budget,
        session: &mut Session,
    ) -> Result<Description> {
        let staging = Staging {
            up: self.up_axis(),
            ..Staging::default()
        };
        Ok(describe(input, &staging, options, budget, session)?.description)
    }

    /// Which way is up in a bare mesh.
    pub(super) fn up_axis(&self) -> UpAxis {
        match self.up {
            Up::Auto => UpAxis::Auto,
            Up::Y => UpAxis::Y,
            Up::Z => UpAxis::Z,
        }
    }
}

/// A scene as it is read.
pub(super) struct Described {
    pub(super) description: Description,
    /// As text, where it is one around a mesh.
    pub(super) text: Option<String>,
    /// What was framed of an animated mesh.
    pub(super) framing: Option<Framing>,
}

/// The scene in the file, or around the mesh in it, which is shown as asked for. What is read may take that much memory; the
/// session has the mesh then.
pub(super) fn describe(
    input: &Path,
    staging: &Staging,
    options: &Options,
    budget: &Budget,
    session: &mut Session,
) -> Result<Described> {
    check(input)?;
    if render::is_mesh(input) {
        render::check_mesh(input, budget.limit())?;
        let BareMesh {
            description,
            text,
            mesh,
            framing,
        } = render::describe_mesh(input, staging, options, budget)?;
        session.give(mesh);
        return Ok(Described {
            description,
            text: Some(text),
            framing,
        });
    }
    Ok(Described {
        description: Description::read(input, options, budget)?,
        text: None,
        framing: None,
    })
}

/// Refuses what is neither a scene nor a mesh by its name.
pub(super) fn check(input: &Path) -> Result<()> {
    if render::is_mesh(input) || is_scene(input) {
        return Ok(());
    }
    let message = format!("{}: neither a scene nor a mesh", input.display());
    Err(Error::input(message).help(if is_image(input) {
        "it is an image: `etendue info` tells what it holds, `etendue convert` makes another of it"
    } else {
        "a scene is an .xml file, a mesh a .ply, .obj, .stl, .serialized, .gltf or .glb"
    }))
}

//! Étendue's own side: a worker that loads the scene and renders it once for each seed that it is told. It
//! is a process of its own so that it is measured as the other side is.

use std::io::{self, BufRead, Write};
use std::num::NonZeroUsize;

use super::cost::Clock;
use super::order::{Loaded, Order, Rendered, Reply};
use crate::budget::Budget;
use crate::description::{self, Description, Kind, NodeId, Properties, Value};
use crate::error::{Error, Result};
use crate::image::{self, Metadata};
use crate::render::{Colors, Options, Session, Silent, find_sensor};

/// Answers the order and the seeds on `input` until it ends.
///
/// # Errors
/// Where the input is not an order and seeds, an image cannot be rendered or written, or nobody listens.
/// A scene that Étendue cannot render is no error: the answer says so.
pub fn serve(mut input: impl BufRead, mut output: impl Write) -> Result<()> {
    let mut answer = |reply: &Reply| -> Result<()> {
        let text = serde_json::to_string(reply).expect("a reply has only names and numbers");
        writeln!(output, "{text}")
            .and_then(|()| output.flush())
            .map_err(|e| told(&e))
    };
    let mut order = String::new();
    input.read_line(&mut order).map_err(|e| told(&e))?;
    let order: Order = serde_json::from_str(&order)
        .map_err(|e| Error::input(format!("the order is not understood: {e}")))?;
    let (mut scene, loaded) = match Scene::load(order) {
        Ok(both) => both,
        Err(error) => {
            return answer(&Reply::Refused(format!(
                "Étendue refuses the scene: {error}"
            )));
        }
    };
    answer(&Reply::Loaded(loaded))?;
    for line in input.lines() {
        let line = line.map_err(|e| told(&e))?;
        let seed = line
            .trim()
            .parse()
            .map_err(|e| Error::input(format!("{line:?} is not a seed: {e}")))?;
        answer(&Reply::Rendered(scene.render(seed)?))?;
    }
    Ok(())
}

fn told(error: &io::Error) -> Error {
    Error::input(format!(
        "the line to the program that asked is broken: {error}"
    ))
}

/// Mitsuba 3.9.1 crashes in scalar variants where `path` looks through emitters and a camera ray meets an instance; its
/// side does the same as this one (`worker.py`). The notes say so.
fn show_emitters(description: &mut Description, variant: &str) -> Vec<String> {
    let hides = |node: &Properties<'_>| {
        let hidden = description.get(node.node_id(), "hide_emitters");
        node.plugin() == "path" && hidden == Some(&Value::Boolean(true))
    };
    let instances = description
        .nodes_of(Kind::Shape)
        .any(|shape| shape.plugin() == "instance");
    if !instances || !variant.starts_with("scalar") {
        return Vec::new();
    }
    let integrators = description.nodes_of(Kind::Integrator);
    let hiding: Vec<NodeId> = integrators.filter(hides).map(|i| i.node_id()).collect();
    for id in &hiding {
        description.set(*id, "hide_emitters", Value::Boolean(false));
    }
    let note = "emitters are shown: Mitsuba crashes where path hides them and there are instances";
    vec![note.to_owned(); hiding.len().min(1)]
}

/// A scene in memory.
struct Scene {
    order: Order,
    description: Description,
    options: Options,
    session: Session,
}

impl Scene {
    fn load(order: Order) -> Result<(Self, Loaded)> {
        let clock = Clock::start();
        let read = description::Options {
            defines: order.defines.clone(),
            strict: order.strict,
            ..description::Options::default()
        };
        let mut description = Description::read(&order.scene, &read, &Budget::default())?;
        let sensor = match &order.sensor {
            Some(name) => find_sensor(&description, name)?,
            None => 0,
        };
        order.overrides().apply(&mut description);
        let notes = show_emitters(&mut description, &order.variant);
        let options = Options {
            threads: order.threads.and_then(|n| NonZeroUsize::new(n as usize)),
            colors: order.bands.map_or(Colors::Rgb, |n| Colors::bands(n.into())),
            sensor,
            ..Options::default()
        };
        let mut session = Session::default();
        session.bounds(&description, &options, &Silent)?;
        let loaded = Loaded {
            renderer: format!("Étendue {}", env!("CARGO_PKG_VERSION")),
            time: clock.time(),
            notes,
        };
        let scene = Self {
            order,
            description,
            options,
            session,
        };
        Ok((scene, loaded))
    }

    fn render(&mut self, seed: u64) -> Result<Rendered> {
        let options = Options {
            seed,
            ..self.options.clone()
        };
        let clock = Clock::start();
        let rendered = self.session.render(&self.description, &options, &Silent)?;
        let time = clock.time();
        let image = self.order.folder.join(format!("etendue-{seed}.exr"));
        image::write(&image, &rendered.image, &Metadata::default())?;
        let spp = rendered.report.spp;
        Ok(Rendered { image, spp, time })
    }
}

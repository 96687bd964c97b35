//! Pictures that the z-buffer draws: of the integrator `raster`, and before the image of another. The whole film is drawn at
//! once, then shaded by bands of rows. A pixel is the mean of its samples, each triangle in it shaded once: the film's filter
//! and sampler have no part in it.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec2;

use super::options::Options;
use super::origin::Outcome;
use super::plan::Completed;
use super::prepare::View;
use super::progress::{Phase, Progress};
use crate::color::{ColorModel, Spectral as _};
use crate::description::{Description, Kind};
use crate::error::{Error, Problem, Result};
use crate::film::{Layout, Rows, Sums};
use crate::filter::Filter;
use crate::image::Image;
use crate::integrator::Raster;
use crate::interaction::Ray;
use crate::lanes::{self, Lanes, MAX_LANES, Task};
use crate::material::Material;
use crate::raster::{Batch, Canvas, Drawn, Fragments, Look, Projection, Seen, Shader, Visibility};
use crate::scene::Scene;
use crate::sensor::{Film, Sensor, Window};

/// The integrator whose pictures these are.
pub(super) const NAME: &str = "raster";

/// Rows of pixels of a unit of work.
const ROWS: u32 = 16;

/// Whether a render's image is drawn by the z-buffer, so that no ray is traced.
pub(super) fn draws(description: &Description, options: &Options) -> bool {
    let integrator = description.root().children(Kind::Integrator);
    let draws = integrator.first().is_some_and(|i| i.plugin() == NAME);
    draws && !options.by_blocks()
}

/// What is said where samples come one by one.
pub(super) fn by_rays() -> Problem {
    let message =
        "the z-buffer draws whole images: here rays find what is seen and what is in shadow";
    let error = Error::unsupported(message);
    let help =
        "the image differs from a whole one at edges, by its shadows, and where something moves";
    error.help(help).problems()[0].clone()
}

/// What was drawn.
pub(super) struct Rastered {
    pub(super) sums: Sums,
    pub(super) completed: Completed,
    /// What is not seen as it is.
    pub(super) notes: Vec<Problem>,
}

/// What is the same for all pixels.
struct Picture<'a, C: ColorModel> {
    scene: &'a Scene<C>,
    view: &'a View<C>,
    raster: &'a Raster,
    film: Film,
    layout: Layout,
    projection: Projection,
    drawn: Drawn<'a>,
    seen: Visibility,
    /// One a pass over the bands.
    shaders: Vec<Shader<'a, C>>,
    time: f32,
}

/// Draws the view of a scene.
pub(super) fn draw<C: ColorModel>(
    scene: &Scene<C>,
    view: &View<C>,
    raster: &Raster,
    progress: &dyn Progress,
) -> Result<Rastered> {
    let film = film(&view.film);
    let crop = film.crop;
    let (time, closes) = view.sensor.shutter();
    let projection = Projection::of_sensor(&view.sensor, &film, time)?;
    let tracer = scene.tracer();
    let is_clear = |shape: u32| {
        matches!(
            scene.material_at(scene.made_of(shape).index()),
            Material::Null(_)
        )
    };
    let hidden = |shape: u32| raster.shade.hide_emitters && scene.shines(shape);
    let drawn = Drawn::new(tracer, &projection, time, |shape| {
        !is_clear(shape) && !hidden(shape)
    })?;
    let canvas = Canvas {
        picture: [film.width, film.height],
        window: crop,
        pattern: raster.pattern,
        depth: raster.depth,
        cull: raster.cull,
    };
    let seen = Visibility::draw(&drawn, &projection, &canvas)?;
    let shader = |pass| {
        let wavelengths = scene.color().wavelengths_of(pass, || 0.5);
        Shader::new(scene, raster.shade, wavelengths, time).with_maps(&drawn)
    };
    let picture = Picture {
        shaders: (0..scene.color().passes())
            .map(shader)
            .collect::<Result<_>>()?,
        layout: Layout::new(scene.color().channels(), Vec::new()),
        scene,
        view,
        raster,
        film,
        projection,
        drawn,
        seen,
        time,
    };
    let mut notes = picture.drawn.warnings().to_vec();
    let mut note = |message: &str| {
        notes.extend_from_slice(Error::unsupported(message).problems());
    };
    if view.sensor.has_lens() {
        note("the z-buffer sees through a pinhole: all is sharp");
    }
    let camera = |time: f32| view.sensor.world_to_camera(time);
    let turns = || [0.5 * (time + closes), closes].map(camera) != [camera(time); 2];
    if time < closes && (tracer.moves() || turns()) {
        note("the z-buffer sees the moment when the shutter opens: nothing is blurred by motion");
    }
    let masks =
        (0..scene.material_count()).any(|i| matches!(scene.material_at(i), Material::Mask(_)));
    if masks {
        note("the z-buffer sees no holes: what has a mask is whole");
    }
    let mut sums = Sums::new(picture.film.shown(), picture.layout.clone())?;
    let bands = crop.height.div_ceil(ROWS) as usize;
    let pixels = u64::from(crop.width) * u64::from(crop.height);
    progress.begin(Phase::Render, pixels);
    let done = AtomicUsize::new(0);
    sums.fill(ROWS, |rows| {
        if !progress.stop() {
            picture.draw(rows);
            progress.advance(u64::from(rows.window().height) * u64::from(crop.width), 0);
            done.fetch_add(1, Ordering::Relaxed);
        }
    });
    let done = done.into_inner();
    Ok(Rastered {
        sums,
        completed: Completed {
            samples: if done == bands {
                raster.pattern.count() as u32
            } else {
                0
            },
            passes: [u32::from(done == bands), 1],
            units: [done, bands],
        },
        notes,
    })
}

/// Tells of no steps, which are not those of the image.
struct Unseen<'a>(&'a dyn Progress);

impl Progress for Unseen<'_> {
    fn begin(&self, _phase: Phase, _total: u64) {}
    fn advance(&self, _steps: u64, _rays: u64) {}
    fn stop(&self) -> bool {
        self.0.stop()
    }
}

/// A picture as it stands, for whoever waits for another.
pub(super) fn preview<C: ColorModel>(
    scene: &Scene<C>,
    view: &View<C>,
    progress: &dyn Progress,
) -> Result<Option<Image>> {
    let rastered = draw(scene, view, &Raster::preview(), &Unseen(progress))?;
    let is_whole = rastered.completed.is_whole();
    let image = is_whole.then(|| rastered.sums.develop(&film(&view.film)));
    image.transpose()
}

/// Of the preview.
pub(super) fn preview_outcome() -> Outcome<'static> {
    let spp = Raster::preview().pattern.count() as u32;
    Outcome {
        spp,
        samples_complete: spp,
        adaptive: None,
        foveated: None,
    }
}

/// The film with pixels by themselves.
fn film(film: &Film) -> Film {
    Film {
        filter: Filter::pixel(),
        sample_border: false,
        ..film.clone()
    }
}

/// What is seen in a row of pixels.
#[derive(Default)]
struct Row {
    /// Points, with their weights.
    batch: Batch,
    weights: Vec<f32>,
    /// Of the pixels from left to right.
    parts: Vec<Part>,
    /// To each of these.
    rays: Vec<Ray>,
    /// At those where a triangle is seen.
    looks: Vec<Look>,
    seen: Vec<Seen>,
}

/// What is seen at some of a pixel's samples.
struct Part {
    column: u32,
    /// Which part of the samples these are.
    share: f32,
    /// Where it is looked at, in pixels of the film.
    place: DVec2,
    /// Of the triangle that is seen.
    number: Option<u32>,
    /// The points whose colours make it up; none where nothing is there.
    points: Range<usize>,
}

impl Row {
    fn clear(&mut self) {
        self.batch.clear();
        self.weights.clear();
        self.parts.clear();
        self.rays.clear();
        self.looks.clear();
        self.seen.clear();
    }
}

impl Part {
    /// Its colour and opacity, by the weights and colours of all points.
    fn color<C: ColorModel>(
        &self,
        shader: &Shader<'_, C>,
        ray: &Ray,
        weights: &[f32],
        colors: &[C::Sample],
    ) -> (C::Sample, f32) {
        if self.points.is_empty() {
            return shader.background(ray);
        }
        let mut sum = C::Sample::zero();
        for point in self.points.clone() {
            sum += colors[point] * weights[point];
        }
        (sum, 1.0)
    }
}

impl<C: ColorModel> Picture<'_, C> {
    /// Some rows.
    fn draw(&self, rows: &mut Rows<'_>) {
        let crop = self.film.crop;
        let window = *rows.window();
        let [mut values, mut pixel] = [(); 2].map(|()| vec![0.0; self.layout.count()]);
        let mut row = Row::default();
        let mut colors = vec![Vec::new(); self.shaders.len()];
        for y in window.y - crop.y..window.y - crop.y + window.height {
            self.look(y, &mut row);
            for (shader, colors) in self.shaders.iter().zip(&mut colors) {
                shader.shade(&row.batch, None, colors);
            }
            let mut rays = &row.rays[..];
            for parts in row.parts.chunk_by(|a, b| a.column == b.column) {
                let (of_pixel, others) = rays.split_at(parts.len());
                rays = others;
                for (pass, (shader, colors)) in (0..).zip(self.shaders.iter().zip(&colors)) {
                    let (mut sum, mut alpha) = (C::Sample::zero(), 0.0);
                    for (part, ray) in parts.iter().zip(of_pixel) {
                        let (color, opaque) = part.color(shader, ray, &row.weights, colors);
                        sum += color * part.share;
                        alpha += opaque * part.share;
                    }
                    let color = self.scene.color();
                    color.develop(pass, &sum, shader.wavelengths(), &mut values);
                    if let Some(last) = values.last_mut() {
                        *last = alpha;
                    }
                    self.layout.take(pass, &values, &mut pixel);
                }
                rows.put([crop.x + parts[0].column, crop.y + y], &pixel);
            }
        }
    }

    /// What is seen in the pixels of a row: each triangle in one is shaded where the first of its samples lies, or in the pixel's
    /// centre where all samples are its own.
    fn look(&self, y: u32, row: &mut Row) {
        row.clear();
        let Window {
            x: left,
            y: top,
            width,
            ..
        } = self.film.crop;
        let pattern = &self.raster.pattern;
        let count = pattern.count();
        for x in 0..width {
            let pixel = y as usize * width as usize + x as usize;
            let mut part = |number, samples: usize, [dx, dy]: [f64; 2]| {
                row.parts.push(Part {
                    column: x,
                    share: samples as f32 / count as f32,
                    place: DVec2::new(f64::from(left + x) + dx, f64::from(top + y) + dy),
                    number,
                    points: 0..0,
                });
            };
            let first = self.seen.number(pixel, 0);
            if (1..count).all(|sample| self.seen.number(pixel, sample) == first) {
                part(first, count, [0.5; 2]);
                continue;
            }
            let mut numbers = [None; 16];
            for (sample, number) in numbers.iter_mut().take(count).enumerate() {
                *number = self.seen.number(pixel, sample);
            }
            let numbers = &numbers[..count];
            for (sample, number) in numbers.iter().enumerate() {
                if !numbers[..sample].contains(number) {
                    let samples = numbers.iter().filter(|other| *other == number).count();
                    part(*number, samples, pattern.place(sample));
                }
            }
        }
        self.scene.tracer().kernel().run(RaysThrough {
            sensor: &self.view.sensor,
            size: DVec2::new(self.film.width.into(), self.film.height.into()),
            time: self.time,
            parts: &row.parts,
            rays: &mut row.rays,
        });
        let (drawn, projection) = (&self.drawn, &self.projection);
        let looks = row.parts.iter().zip(&row.rays).filter_map(|(part, ray)| {
            Some(Look {
                place: part.place,
                number: part.number?,
                ray: *ray,
            })
        });
        row.looks.extend(looks);
        self.scene.tracer().kernel().run(Fragments {
            drawn,
            projection,
            looks: &row.looks,
            to: &mut row.seen,
        });
        let mut found = row.looks.iter().zip(&row.seen);
        for part in &mut row.parts {
            let first = row.weights.len();
            if part.number.is_some() {
                let (look, seen) = found.next().expect("it was looked at");
                // All shaders want the same points.
                let to = (&mut row.batch, &mut row.weights);
                self.shaders[0].add_points(to, (drawn, projection), look, seen);
            }
            part.points = first..row.weights.len();
        }
    }
}

/// Adds the sensor's rays through places of the film.
struct RaysThrough<'a> {
    sensor: &'a Sensor,
    /// Of the film, in pixels.
    size: DVec2,
    time: f32,
    parts: &'a [Part],
    rays: &'a mut Vec<Ray>,
}

impl Task for RaysThrough<'_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(self) {
        let times = [self.time; MAX_LANES];
        for parts in self.parts.chunks(F::WIDTH) {
            let mut rows = [F::ROW; 2];
            for (lane, part) in parts.iter().enumerate() {
                let place = (part.place / self.size).as_vec2();
                (rows[0][lane], rows[1][lane]) = (place.x, place.y);
            }
            let film = lanes::Vec2::<F>::load(&rows);
            let lens = lanes::Vec2::splat(0.5);
            let times = &times[..parts.len()];
            self.sensor
                .rays(film, lens, times, |ray| self.rays.push(ray));
        }
    }
}

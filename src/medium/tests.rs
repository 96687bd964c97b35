use std::path::Path;

use super::*;
use crate::color::Rgb;
use crate::description::{Description, Options, Value};
use crate::lanes::{Kernel, MAX_LANES, Task};
use crate::sampler::{Stream, Streams};

/// Every member, with a volume that is in the checkout.
const EXAMPLES: &[(&str, &str)] = &[
    (
        "homogeneous",
        "<rgb name='sigma_t' value='0.5, 1, 2'/><rgb name='albedo' value='0.9, 0.5, 0.2'/>",
    ),
    (
        "heterogeneous",
        "<rgb name='sigma_t' value='0.5, 1, 2'/><float name='scale' value='3'/>",
    ),
    (
        "heterogeneous",
        "<volume name='sigma_t' type='gridvolume'><string name='filename' value='scenes/smoke.vol'/></volume>
         <float name='scale' value='20'/>",
    ),
];

fn medium(name: &str, inside: &str) -> Medium<Rgb> {
    let text = format!("<scene version='3.0.0'><medium type='{name}'>{inside}</medium></scene>");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("test.xml");
    let scene = Description::parse(&text, &path, &Options::default()).unwrap();
    let Value::Object(node) = scene.root().all()[0].value else {
        panic!("the scene holds a medium");
    };
    let palettes = Palettes::new(Rgb);
    Medium::build(&scene.node(node), &palettes).unwrap_or_else(|e| panic!("{e}"))
}

/// Rays through the unit cube, or past it.
fn ray(i: usize) -> (glam::Vec3, glam::Vec3) {
    let number = |d: usize| crate::math::random::unit(crate::math::random::mix((8 * i + d) as u64));
    let place = |d: usize| glam::Vec3::new(number(d), number(d + 1), number(d + 2));
    let from = place(0) * 3.0 - 1.0;
    let along = match i % 5 {
        0 => glam::Vec3::Z,
        _ => (place(3) - from).normalize(),
    };
    (from, along)
}

const RAYS: usize = 4000;

/// What flights and transmittances of all rays are, as bits.
struct All<'a>(&'a Medium<Rgb>);

impl Task for All<'_> {
    type Output = Vec<[u32; 10]>;

    #[inline(always)]
    fn run<F: Lanes>(self) -> Self::Output {
        let mut answers = Vec::new();
        for start in (0..RAYS).step_by(F::WIDTH) {
            let (mut origins, mut directions) = ([F::ROW; 3], [F::ROW; 3]);
            let mut heroes = <F::Int as crate::lanes::Ints>::ROW;
            let mut streams = [Stream::new(1, 0, 0, 0); MAX_LANES];
            for lane in 0..F::WIDTH {
                let (from, along) = ray(start + lane);
                for axis in 0..3 {
                    origins[axis][lane] = from[axis];
                    directions[axis][lane] = along[axis];
                }
                heroes[lane] = ((start + lane) % 3) as u32;
                streams[lane] = Stream::new(1, (start + lane) as u32, 0, 0);
            }
            let way = Way {
                active: F::Mask::splat(true),
                origin: Vec3::<F>::load(&origins),
                direction: Vec3::<F>::load(&directions),
                end: F::splat(1.5),
                hero: F::Int::load(&heroes),
                wavelengths: &[(); MAX_LANES],
            };
            let draws = Streams::<F>::of(&streams).draws(3);
            let flight = self.0.fly(&way, draws.part(1).number(0), draws);
            let through = self.0.transmit(&way, draws);
            for lane in 0..F::WIDTH {
                let mut answer = [0; 10];
                answer[0] = flight.distance.lane(lane).to_bits();
                let samples = [flight.throughput, flight.density, through];
                for (i, sample) in samples.into_iter().enumerate() {
                    for channel in 0..3 {
                        answer[1 + 3 * i + channel] = sample[channel].lane(lane).to_bits();
                    }
                }
                answers.push(answer);
            }
        }
        answers
    }
}

#[test]
fn every_medium_gives_the_same_bits_with_every_kernel() {
    for name in Medium::<Rgb>::NAMES {
        assert!(
            EXAMPLES.iter().any(|(example, _)| example == name),
            "{name}"
        );
    }
    for (name, inside) in EXAMPLES {
        let medium = medium(name, inside);
        let mut kernels = Kernel::all().into_iter();
        let expected = kernels.next().unwrap().run(All(&medium));
        for kernel in kernels {
            assert!(kernel.run(All(&medium)) == expected, "{name} {kernel:?}");
        }
    }
}

/// Of the flights the share that comes through is what the transmittance says, channel by channel and hero by hero.
#[test]
fn as_much_comes_through_as_the_transmittance_says() {
    for (name, inside) in EXAMPLES {
        let medium = medium(name, inside);
        let origin = glam::Vec3::new(0.45, 0.55, -0.2);
        let direction = glam::Vec3::new(0.1, -0.05, 1.0).normalize();
        let (mut asked, mut flown) = ([0.0; 3], [0.0; 3]);
        let mut balanced = [0.0; 3];
        const COUNT: u32 = 40_000;
        for i in 0..COUNT {
            let streams = Streams::<f32>::of(&[Stream::new(7, i, 0, 0)]);
            let way = Way {
                active: true,
                origin: origin.into(),
                direction: direction.into(),
                end: 1.1,
                hero: std::num::Wrapping(i % 3),
                wavelengths: &[()],
            };
            let draws = streams.draws(1);
            let through: crate::color::Samples<3> = medium.transmit(&way, draws).sample(0);
            let flight = medium.fly(&way, draws.part(3).number(0), draws.part(2));
            let throughput: crate::color::Samples<3> = flight.throughput.sample(0);
            let density: crate::color::Samples<3> = flight.density.sample(0);
            let mean = (density[0] + density[1] + density[2]) / 3.0;
            for channel in 0..3 {
                asked[channel] += f64::from(through[channel]);
                if !flight.scattered {
                    flown[channel] += f64::from(throughput[channel]);
                    balanced[channel] += f64::from(throughput[channel] / mean);
                }
            }
        }
        for channel in 0..3 {
            let n = f64::from(COUNT);
            let [asked, flown, balanced] = [asked, flown, balanced].map(|sums| sums[channel] / n);
            for other in [flown, balanced] {
                assert!(
                    (asked - other).abs() < 0.02 * asked + 0.01,
                    "{name} {channel}: {asked} {other}"
                );
            }
        }
    }
}

#[test]
fn a_medium_that_would_be_tracked_for_ever_is_refused() {
    let inside = EXAMPLES[2].1.replace("'20'", "'1e9'");
    let text =
        format!("<scene version='3.0.0'><medium type='heterogeneous'>{inside}</medium></scene>");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("test.xml");
    let scene = Description::parse(&text, &path, &Options::default()).unwrap();
    let Value::Object(node) = scene.root().all()[0].value else {
        panic!("the scene holds a medium");
    };
    let error = Medium::build(&scene.node(node), &Palettes::new(Rgb)).unwrap_err();
    assert!(error.to_string().contains("optical thickness"), "{error}");
}

//! Relighting: the layers that the integrator `phong` has taken an image apart into, added up again with
//! other weights. Light adds up, so that the result is the image which lights and reflectances scaled by
//! those weights would have made, without tracing a ray.

use std::collections::BTreeSet;

use crate::error::{Error, Result};
use crate::image::Image;

/// A part of an image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layer {
    /// Such as `diffuse` or `light.lamp.specular`, without the channel.
    pub name: String,
    /// The indices of its red, green and blue channel.
    pub channels: [usize; 3],
}

/// What layers are multiplied by.
#[derive(Clone, Debug, PartialEq)]
pub struct Weight {
    /// A layer's name, or whole words of it: `diffuse` and `lamp` both mean `light.lamp.diffuse` too.
    pub name: String,
    /// For red, green and blue; finite and not negative.
    pub factors: [f32; 3],
}

/// What layers' names begin with.
const KINDS: [&str; 5] = ["ambient", "diffuse", "emission", "light", "specular"];
/// How far the layers' sum may lie from the image, in parts of it: what half floats lose in each layer.
const TOLERANCE: f32 = 5e-3;

impl Layer {
    /// Whether `name` is a run of whole words in the layer's name.
    fn is_meant_by(&self, name: &str) -> bool {
        !name.is_empty() && format!(".{}.", self.name).contains(&format!(".{name}."))
    }

    fn of(&self, pixel: &[f32]) -> [f32; 3] {
        self.channels.map(|c| pixel[c])
    }
}

/// The layers of an image in the order of its channels; none where it was not taken apart.
pub fn layers(image: &Image) -> Vec<Layer> {
    let is_layer = |name: &str| {
        let kind = name.split('.').next().unwrap_or_default();
        KINDS.contains(&kind) && (name.contains('.') == (kind == "light"))
    };
    let names = image.channels().iter().filter_map(|channel| {
        let name = ["R", "G", "B"].map(|c| channel.strip_suffix(c));
        let name = name.into_iter().flatten().next()?.strip_suffix('.')?;
        is_layer(name).then_some(name)
    });
    let mut known = BTreeSet::new();
    names
        .filter(|name| known.insert(*name))
        .filter_map(|name| {
            let [r, g, b] = ["R", "G", "B"].map(|c| image.channel(&format!("{name}.{c}")));
            Some(Layer {
                name: name.to_owned(),
                channels: [r?, g?, b?],
            })
        })
        .collect()
}

/// The mean of each channel of a layer.
pub fn mean(image: &Image, layer: &Layer) -> [f64; 3] {
    let stride = image.channels().len();
    let mut sum = [0.0; 3];
    for pixel in image.data().chunks_exact(stride) {
        for (sum, value) in sum.iter_mut().zip(layer.of(pixel)) {
            *sum += f64::from(value);
        }
    }
    let pixels = (image.data().len() / stride).max(1);
    sum.map(|s| s / pixels as f64)
}

/// The image with its layers weighted: `R`, `G`, `B`, and `A` where the image has it. A layer that several
/// weights mean is multiplied by all of them, and one that none means stays as it is.
///
/// # Errors
/// Where the image has no layers, or they do not add up to it; where a weight is no number from 0, or means
/// no layer.
pub fn relight(image: &Image, weights: &[Weight]) -> Result<Image> {
    let layers = layers(image);
    check_sum(image, &layers)?;
    let mut factors = vec![[1.0_f32; 3]; layers.len()];
    for weight in weights {
        let possible = |f: &f32| f.is_finite() && *f >= 0.0;
        if !weight.factors.iter().all(possible) {
            let message = format!(
                "the weight of {} must be finite and not negative",
                weight.name
            );
            return Err(Error::input(message));
        }
        let mut meant = false;
        for (layer, factors) in layers.iter().zip(&mut factors) {
            if layer.is_meant_by(&weight.name) {
                meant = true;
                for (factor, weight) in factors.iter_mut().zip(weight.factors) {
                    *factor *= weight;
                }
            }
        }
        if !meant {
            return Err(unknown(&weight.name, &layers));
        }
    }
    let alpha = image.alpha();
    let names = ["R", "G", "B", "A"].map(String::from);
    let names = names[..3 + usize::from(alpha.is_some())].to_vec();
    let mut relit = Image::try_new(image.width(), image.height(), names)?;
    let stride = relit.channels().len();
    let pixels = image.data().chunks_exact(image.channels().len());
    for (pixel, out) in pixels.zip(relit.data_mut().chunks_exact_mut(stride)) {
        for (layer, factors) in layers.iter().zip(&factors) {
            for (c, value) in layer.of(pixel).into_iter().enumerate() {
                out[c] += value * factors[c];
            }
        }
        if let Some(alpha) = alpha {
            out[3] = pixel[alpha];
        }
    }
    Ok(relit)
}

/// That the layers are the image, and all of it.
fn check_sum(image: &Image, layers: &[Layer]) -> Result<()> {
    let help =
        "render with the integrator phong and <string name=\"layers\" value=\"terms, lights\"/>";
    if layers.is_empty() {
        return Err(Error::input("the image has no layers").help(help));
    }
    let main = ["R", "G", "B"].map(|c| image.channel(c));
    let [Some(r), Some(g), Some(b)] = main else {
        return Err(Error::input("the image has layers, and no channels R, G and B").help(help));
    };
    for (i, pixel) in image
        .data()
        .chunks_exact(image.channels().len())
        .enumerate()
    {
        for (c, whole) in [r, g, b].into_iter().map(|c| pixel[c]).enumerate() {
            let values = layers.iter().map(|layer| pixel[layer.channels[c]]);
            let (sum, size) = values.fold((0.0, 0.0), |(sum, size), v| (sum + v, size + v.abs()));
            // Half floats have no numbers below 6e-8.
            let near = (sum - whole).abs() <= TOLERANCE * size.max(whole.abs()) + 1e-6;
            if !near {
                let [x, y] = [i % image.width() as usize, i / image.width() as usize];
                let message = format!(
                    "the layers do not add up to the image: at pixel ({x}, {y}) they come to {sum}, not {whole}"
                );
                return Err(Error::input(message).help(help));
            }
        }
    }
    Ok(())
}

/// The error for a name that means no layer.
fn unknown(name: &str, layers: &[Layer]) -> Error {
    let words = layers.iter().flat_map(|l| l.name.split('.'));
    let all = layers.iter().map(|l| l.name.as_str());
    let candidates: BTreeSet<&str> = words.chain(all.clone()).collect();
    let error = Error::input(format!("no layer is called {name:?}")).suggest(name, candidates);
    error.help(format!("there are {}", all.collect::<Vec<_>>().join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One pixel of R, G, B and opacity, and layers with these greys that make it up.
    fn image(layers: &[(&str, f32)]) -> Image {
        let sum = layers.iter().map(|l| l.1).sum();
        let mut channels = ["R", "G", "B", "A"].map(String::from).to_vec();
        let mut data = vec![sum, sum, sum, 0.75];
        for (name, grey) in layers {
            channels.extend(["B", "G", "R"].map(|c| format!("{name}.{c}")));
            data.extend([*grey; 3]);
        }
        Image::from_data(1, 1, channels, data).unwrap()
    }

    fn weights(of: &[(&str, [f32; 3])]) -> Vec<Weight> {
        let weight = |&(name, factors): &(&str, [f32; 3])| Weight {
            name: name.to_owned(),
            factors,
        };
        of.iter().map(weight).collect()
    }

    const BOTH: &[(&str, f32)] = &[
        ("ambient", 1.0),
        ("light.a.diffuse", 2.0),
        ("light.a.specular", 4.0),
        ("light.b.c.diffuse", 8.0),
    ];

    #[test]
    fn weights_multiply_what_their_words_mean() {
        for (of, expected) in [
            (&[][..], [15.0; 3]),
            (&[("ambient", [0.0; 3])], [14.0; 3]),
            (&[("diffuse", [2.0, 1.0, 0.5])], [25.0, 15.0, 10.0]),
            (&[("light", [0.0; 3])], [1.0; 3]),
            (&[("a", [0.0; 3]), ("b.c", [2.0; 3])], [17.0; 3]),
            (&[("light.a", [3.0; 3]), ("diffuse", [0.5; 3])], [20.0; 3]),
            (&[("light.a.specular", [0.5; 3])], [13.0; 3]),
        ] {
            let relit = relight(&image(BOTH), &weights(of)).unwrap();
            assert_eq!(relit.channels(), ["R", "G", "B", "A"]);
            assert_eq!(relit.data()[..3], expected, "{of:?}");
            assert_eq!(relit.data()[3], 0.75);
        }
    }

    #[test]
    fn what_cannot_be_relit_is_said() {
        let image = image(BOTH);
        for (of, message) in [
            (("difuse", [1.0; 3]), "did you mean \"diffuse\"?"),
            (("ligh", [1.0; 3]), "did you mean \"light\"?"),
            (("velvet", [1.0; 3]), "there are ambient, light.a.diffuse"),
            (("a", [1.0, -1.0, 1.0]), "must be finite and not negative"),
            (("a", [f32::NAN; 3]), "must be finite and not negative"),
        ] {
            let error = relight(&image, &weights(&[of])).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
        let mut changed = image.clone();
        changed.set(0, 0, 1, 15.5);
        let error = relight(&changed, &[]).unwrap_err().to_string();
        assert!(
            error.contains("at pixel (0, 0) they come to 15, not 15.5"),
            "{error}"
        );
    }

    #[test]
    fn channels_of_other_kinds_are_no_layers() {
        for other in ["albedo", "diffuse.x", "light", "img"] {
            let image = image(&[(other, 1.0)]);
            assert!(layers(&image).is_empty(), "{other}");
            let error = relight(&image, &[]).unwrap_err().to_string();
            assert!(error.contains("has no layers; render with"), "{error}");
        }
    }
}

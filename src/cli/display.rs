//! Arguments on how linear values become codes for a screen.

use std::path::Path;

use clap::{Args, ValueEnum};
use etendue::display::{
    Ambient, AmbientMode, Depth, DisplayTransform, Exposure, Gamut, Transfer, View,
};
use etendue::error::Error;
use etendue::image::Format;

use super::{parse, report};

/// How pictures for a screen are made of linear values.
#[derive(Args, Debug)]
pub(super) struct DisplayArguments {
    /// Make the picture brighter by this many stops, or "auto": the geometric mean of luminance becomes middle
    /// grey
    #[arg(long, default_value = "0", value_name = "STOPS|auto", value_parser = exposure, allow_hyphen_values = true, help_heading = DISPLAY)]
    exposure: Exposure,
    /// How light beyond the display's range is brought into it
    #[arg(long, value_enum, default_value_t = Views::Standard, value_name = "NAME", help_heading = DISPLAY)]
    view: Views,
    /// How much of the light that is beyond the display's maximum spreads over its neighbourhood, 0 to 1
    #[arg(long, default_value_t = 0.0, value_name = "PART", value_parser = parse::part, help_heading = DISPLAY)]
    glare: f32,
    /// The display's primaries
    #[arg(long, value_enum, default_value_t = Gamuts::Bt709, value_name = "NAME", help_heading = DISPLAY)]
    gamut: Gamuts,
    /// The illuminance of the room that the display stands in, in lux: it sends LUX · reflectance / π back, or lets it
    /// through where it is see-through, which is seen beside what it shows
    #[arg(long, value_name = "LUX", value_parser = lux, help_heading = DISPLAY)]
    ambient: Option<f32>,
    /// What to do about that light
    #[arg(long, value_enum, default_value_t = Modes::Compensate, value_name = "MODE", requires = "ambient", help_heading = DISPLAY)]
    ambient_mode: Modes,
    /// How much of that light the display sends back, 0 to 1; of a see-through one what it lets through times the reflectance
    /// of what is behind
    #[arg(long, default_value_t = Ambient::default().reflectance, value_name = "PART", value_parser = parse::part, requires = "ambient", help_heading = DISPLAY)]
    ambient_reflectance: f32,
    /// The luminance of the display's white in the dark, in cd/m²
    #[arg(long, default_value_t = Ambient::default().white, value_name = "NITS", value_parser = nits, requires = "ambient", help_heading = DISPLAY)]
    ambient_white: f32,
    /// The display's curve: "srgb", "gamma:2.2" or another exponent, "pq" or "hlg" (HDR, as a rule with --gamut
    /// bt2020 and --bits 16)
    #[arg(long, default_value = "srgb", value_name = "CURVE", value_parser = transfer, help_heading = DISPLAY)]
    encode: Transfer,
    /// Bits of a code; 32 leaves linear values as they are, as floats, which of .tif, .png and .jpg only .tif has
    #[arg(long, default_value = "8", value_name = "8|16|32", value_parser = depth, help_heading = DISPLAY)]
    bits: Depth,
    /// Hide the bands of smooth gradients by blue noise of less than a code
    #[arg(long, help_heading = DISPLAY)]
    dither: bool,
}

const DISPLAY: &str = "From linear values to TIFF, PNG and JPEG";

impl DisplayArguments {
    /// What they ask for.
    pub(super) fn transform(&self) -> DisplayTransform {
        DisplayTransform {
            exposure: self.exposure,
            view: match self.view {
                Views::Standard => View::Standard,
                Views::Sigmoid => View::Sigmoid,
                Views::Local => View::Local,
                Views::Agx => View::Agx,
                Views::Aces => View::Aces,
            },
            glare: self.glare,
            gamut: match self.gamut {
                Gamuts::Bt709 => Gamut::Bt709,
                Gamuts::P3 => Gamut::P3,
                Gamuts::Bt2020 => Gamut::Bt2020,
            },
            ambient: self.ambient.map(|illuminance| Ambient {
                illuminance,
                reflectance: self.ambient_reflectance,
                white: self.ambient_white,
                mode: match self.ambient_mode {
                    Modes::Compensate => AmbientMode::Compensate,
                    Modes::Simulate => AmbientMode::Simulate,
                },
            }),
            transfer: self.encode,
            depth: self.bits,
            dither: self.dither,
        }
    }

    /// Warns where they are given, and none of the outputs is a picture for a screen; unless `quiet`.
    pub(super) fn warn_unused<'a>(&self, outputs: impl IntoIterator<Item = &'a Path>, quiet: bool) {
        if let Some(unused) = self.unused(outputs)
            && !quiet
        {
            report::warnings(unused.problems());
        }
    }

    /// What to say where they are given, and none of the outputs is a picture for a screen.
    pub(super) fn unused<'a>(&self, outputs: impl IntoIterator<Item = &'a Path>) -> Option<Error> {
        let asked = DisplayTransform {
            depth: Depth::Eight,
            ..self.transform()
        };
        let given = asked != DisplayTransform::default() || self.bits == Depth::Sixteen;
        let is_linear = |output: &&Path| match Format::of_output(output) {
            Ok(Format::Exr | Format::Hdr | Format::Pfm) => true,
            Ok(Format::Tiff) => self.bits == Depth::Float,
            _ => false,
        };
        let mut outputs = outputs.into_iter().peekable();
        let first = outputs.peek()?.display().to_string();
        if !given || !outputs.all(|output| is_linear(&output)) {
            return None;
        }
        let message =
            format!("{first} keeps linear values, and display options change nothing in it");
        Some(
            Error::input(message).help(
                "write .png, .jpg, or .tif with --bits 8 or 16, now or by \"etendue convert\"",
            ),
        )
    }
}

/// See [`View`].
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Views {
    /// Values above 1 are cut off
    Standard,
    /// A sigmoid about the image's mean: all becomes visible, with less contrast
    Sigmoid,
    /// By each place's neighbourhood, as dodging and burning: detail stays in light and shadow
    Local,
    /// AgX: bright colours go to white as on film
    Agx,
    /// ACES 1, the Academy's
    Aces,
}

/// See [`Gamut`].
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Gamuts {
    /// ITU-R BT.709, as sRGB has them
    Bt709,
    /// P3 with white D65
    P3,
    /// ITU-R BT.2020
    Bt2020,
}

/// See [`AmbientMode`].
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Modes {
    /// Show less, so that with that light the picture is seen as it was meant, where it is not darker than the light itself
    Compensate,
    /// Show what is seen in that light, for eyes that take the display's white for white
    Simulate,
}

/// An illuminance.
fn lux(text: &str) -> Result<f32, String> {
    light(text, 0.0)
        .ok_or_else(|| format!("write lux from 0 to {BRIGHTEST}, such as 500 for an office"))
}

/// A display's luminance.
fn nits(text: &str) -> Result<f32, String> {
    light(text, 0.1).ok_or_else(|| format!("write cd/m² from 0.1 to {BRIGHTEST}"))
}

/// More than the sun's illuminance in lux, and than any display's luminance in cd/m².
const BRIGHTEST: f32 = 1e6;

/// A number from the least to [`BRIGHTEST`].
fn light(text: &str, least: f32) -> Option<f32> {
    let light = text.parse().ok()?;
    (least..=BRIGHTEST).contains(&light).then_some(light)
}

/// A number of stops, or `auto`.
fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    match text.parse() {
        Ok(stops) if (-64.0..=64.0).contains(&stops) => Ok(Exposure::Stops(stops)),
        _ => Err("write a number of stops from -64 to 64, or \"auto\"".to_owned()),
    }
}

/// A curve by its name.
fn transfer(text: &str) -> Result<Transfer, String> {
    let exponent = text.strip_prefix("gamma:").map(str::parse);
    match (text, exponent) {
        ("srgb", _) => Ok(Transfer::Srgb),
        ("pq", _) => Ok(Transfer::Pq),
        ("hlg", _) => Ok(Transfer::Hlg),
        (_, Some(Ok(exponent))) if (0.1..=10.0).contains(&exponent) => {
            Ok(Transfer::Gamma(exponent))
        }
        _ => Err("there are srgb, gamma:2.2 (0.1 to 10), pq and hlg".to_owned()),
    }
}

/// A number of bits.
fn depth(text: &str) -> Result<Depth, String> {
    match text {
        "8" => Ok(Depth::Eight),
        "16" => Ok(Depth::Sixteen),
        "32" => Ok(Depth::Float),
        _ => Err("there are 8, 16 and 32".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn display_options_are_said_to_be_unused_where_no_output_is_for_a_screen() {
        #[derive(clap::Parser)]
        struct Command {
            #[command(flatten)]
            display: DisplayArguments,
        }
        let unused = |options: &str, outputs: &[&str]| {
            let words = std::iter::once("command").chain(options.split_whitespace());
            let Command { display } = clap::Parser::parse_from(words);
            display.unused(outputs.iter().map(Path::new)).is_some()
        };
        for options in [
            "--view agx",
            "--exposure -1",
            "--bits 16",
            "--dither",
            "--encode pq",
        ] {
            assert!(unused(options, &["a.exr", "b.hdr"]), "{options}");
            assert!(!unused(options, &["a.exr", "b.png"]), "{options}");
            assert!(!unused(options, &["a.part"]), "{options}");
        }
        assert!(!unused("", &["a.exr"]) && !unused("--bits 32", &["a.exr"]));
        assert!(unused("--bits 32 --view agx", &["a.tif"]) && !unused("--view agx", &["a.tif"]));
        assert!(!unused("--bits 32", &["a.tif"]));
    }

    #[test]
    fn curves_and_exposures_are_read_and_bounded() {
        assert_eq!(transfer("gamma:1.8"), Ok(Transfer::Gamma(1.8)));
        for wrong in ["gamma:", "gamma:0", "gamma:nan", "gamma:1e9", "sRGB", ""] {
            assert!(transfer(wrong).is_err(), "{wrong}");
        }
        assert_eq!(exposure("-1.5"), Ok(Exposure::Stops(-1.5)));
        for wrong in ["", "inf", "nan", "1e9", "Auto"] {
            assert!(exposure(wrong).is_err(), "{wrong}");
        }
    }
}

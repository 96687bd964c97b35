//! The values of options: from text to numbers, windows, sizes and frames.

use std::num::NonZeroUsize;
use std::thread;

use clap::builder::RangedI64ValueParser;
use etendue::color::Space;
use etendue::relight::Weight;
use etendue::render::Passes;
use etendue::sampler::MAX_SAMPLES;
use etendue::sensor::Window;
use glam::DVec3;

type Parsed<T> = Result<T, String>;

fn numbers<const N: usize>(text: &str, separator: char) -> Option<[u32; N]> {
    let numbers: Vec<u32> = text
        .split(separator)
        .map(|t| t.trim().parse().ok())
        .collect::<Option<_>>()?;
    numbers.try_into().ok()
}

/// Samples a pixel.
pub(super) fn spp() -> RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=MAX_SAMPLES.into())
}

/// How many threads: up to eight a processor, and up to 256 on any machine; 0 is one a processor.
pub(super) fn threads(text: &str) -> Parsed<NonZeroUsize> {
    const ANYWHERE: usize = 256;
    let processors = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let most = ANYWHERE.max(8 * processors);
    let number: usize = text.parse().map_err(|_| "write a number such as 8")?;
    let number = if number == 0 { processors } else { number };
    (NonZeroUsize::new(number).filter(|n| n.get() <= most)).ok_or_else(|| {
        format!("{text} is not between 0 and {most}; this machine has {processors} processors")
    })
}

/// `640x480`
pub(super) fn size(text: &str) -> Parsed<(u32, u32)> {
    let [width, height] = numbers(text, 'x').ok_or("write it as WIDTHxHEIGHT, such as 640x480")?;
    Ok((width, height))
}

/// `10,20,64,64`
pub(super) fn crop(text: &str) -> Parsed<Window> {
    let [x, y, width, height] =
        numbers(text, ',').ok_or("write it as X,Y,WIDTH,HEIGHT, such as 10,20,64,64")?;
    Ok(Window {
        x,
        y,
        width,
        height,
    })
}

/// A part of the whole, from 0 to 1.
pub(super) fn part(text: &str) -> Parsed<f32> {
    let part: Option<f32> = text.parse().ok();
    part.filter(|part| (0.0..=1.0).contains(part))
        .ok_or_else(|| "write a number from 0 to 1".to_owned())
}

/// `2:4`, `2:`, `:4`
pub(super) fn passes(text: &str) -> Parsed<Passes> {
    const HOW: &str = "write it as FIRST:END, such as 0:2 or 2:";
    let (first, end) = text.split_once(':').ok_or(HOW)?;
    let number = |text: &str| match text.trim() {
        "" => Ok(None),
        text => text.parse::<u32>().map(Some).map_err(|_| HOW),
    };
    let (first, end) = (number(first)?.unwrap_or(0), number(end)?);
    if end.is_some_and(|end| end <= first) {
        return Err("there is no pass in it: END is the first that is left out".to_owned());
    }
    Ok(Passes { first, end })
}

/// `320,180.5`
pub(super) fn place(text: &str) -> Parsed<[f64; 2]> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|t| t.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y]) if x.is_finite() && y.is_finite() && x >= 0.0 && y >= 0.0 => Ok([x, y]),
        _ => Err("write it as X,Y in pixels, such as 320,180".to_owned()),
    }
}

/// `1,-2,0.5`
pub(super) fn point(text: &str) -> Parsed<DVec3> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|t| t.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) if x.is_finite() && y.is_finite() && z.is_finite() => {
            Ok(DVec3::new(x, y, z))
        }
        _ => Err("write it as X,Y,Z, such as 0,1.5,0".to_owned()),
    }
}

/// `name=value`
pub(super) fn define(text: &str) -> Parsed<(String, String)> {
    let (name, value) = text.split_once('=').ok_or("write it as name=value")?;
    Ok((name.to_owned(), value.to_owned()))
}

/// `diffuse=0.5` or `light.lamp=2,1,0.5`
pub(super) fn weight(text: &str) -> Parsed<Weight> {
    const HOW: &str = "write it as name=0.5 or name=2,1,0.5";
    // Names may hold an equals sign, numbers do not.
    let (name, numbers) = text.rsplit_once('=').ok_or(HOW)?;
    let numbers: Option<Vec<f32>> = numbers.split(',').map(|t| t.trim().parse().ok()).collect();
    let factors = match numbers.as_deref() {
        Some([grey]) => [*grey; 3],
        Some([r, g, b]) => [*r, *g, *b],
        _ => return Err(HOW.to_owned()),
    };
    if !factors.iter().all(|f| f.is_finite() && *f >= 0.0) {
        return Err("weights are finite and not negative".to_owned());
    }
    Ok(Weight {
        name: name.to_owned(),
        factors,
    })
}

/// A positive number of seconds.
pub(super) fn seconds(text: &str) -> Parsed<std::time::Duration> {
    /// About thirty years: nothing overflows.
    const LONGEST: f64 = 1e9;
    let seconds: f64 = text.parse().map_err(|_| "write a number of seconds")?;
    if !(0.0..=LONGEST).contains(&seconds) {
        return Err(format!("{text} is not between 0 and {LONGEST}"));
    }
    Ok(std::time::Duration::from_secs_f64(seconds))
}

/// Seconds between two times that something is done.
pub(super) fn interval(text: &str) -> Parsed<std::time::Duration> {
    /// More often nothing else would be done.
    const SHORTEST: f64 = 0.01;
    let seconds = seconds(text)?;
    match seconds.as_secs_f64() < SHORTEST {
        true => Err(format!("write {SHORTEST} seconds or more")),
        false => Ok(seconds),
    }
}

/// `127.0.0.1:14158`, `[::1]:14158`, `host:14158`
pub(super) fn address(text: &str) -> Parsed<String> {
    const HOW: &str = "write it as HOST:PORT, such as 127.0.0.1:14158";
    let (host, port) = text.rsplit_once(':').ok_or(HOW)?;
    match port.parse::<u16>() {
        Ok(1..) if !host.is_empty() => Ok(text.to_owned()),
        _ => Err(HOW.to_owned()),
    }
}

/// A positive number.
pub(super) fn positive(text: &str) -> Parsed<f64> {
    let number: f64 = text.parse().map_err(|_| "write a number such as 0.005")?;
    if !(number > 0.0 && number.is_finite()) {
        return Err(format!("{text} is not positive"));
    }
    Ok(number)
}

/// A number of things: `1000`, `250k`, `10M`.
pub(super) fn count(text: &str) -> Parsed<u32> {
    const HOW: &str = "write it as 5000, 250k or 10M";
    /// Of what 32 bits number, with room for what goes with it.
    const MOST: f64 = 4e9;
    let end = text.find(|c: char| !(c.is_ascii_digit() || c == '.'));
    let (number, unit) = text.split_at(end.unwrap_or(text.len()));
    let factor = match unit {
        "" => 1.0,
        "k" => 1e3,
        "M" => 1e6,
        "G" => 1e9,
        _ => return Err(HOW.to_owned()),
    };
    let number: f64 = number.parse().map_err(|_| HOW)?;
    let count = (number * factor).round();
    if !(1.0..=MOST).contains(&count) {
        return Err(format!("{text} is not between 1 and {MOST}"));
    }
    Ok(count as u32)
}

/// A number of bytes: `500M`, `8G`, `7.5GiB`; `none` is without limit.
pub(super) fn bytes(text: &str) -> Parsed<u64> {
    if text == "none" {
        return Ok(u64::MAX);
    }
    let end = text
        .find(|c: char| !(c.is_ascii_digit() || c == '.'))
        .unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    let unit_in_small = unit.trim().to_lowercase();
    let factor = match unit_in_small.strip_suffix('b').unwrap_or(&unit_in_small) {
        "" => 1.0,
        "k" => 1e3,
        "m" => 1e6,
        "g" => 1e9,
        "t" => 1e12,
        "ki" => f64::from(1 << 10),
        "mi" => f64::from(1 << 20),
        "gi" => f64::from(1 << 30),
        "ti" => 1024.0 * f64::from(1 << 30),
        _ => {
            return Err(format!(
                "unknown unit {unit:?}; write it as 500M, 8G or 8GiB"
            ));
        }
    };
    let number: f64 = number
        .parse()
        .map_err(|_| "write it as 500M, 8G, 8GiB or none")?;
    Ok((number * factor) as u64)
}

/// When the shutter is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shutter {
    /// From and to; of a frame, after its time.
    Times(f64, f64),
    /// For so much of a frame, which is 360 degrees.
    Degrees(f64),
}

impl Shutter {
    /// From when to when of frame `frame`, whose time is its number over `fps`.
    pub(super) fn times(self, frame: i64, fps: f64) -> (f64, f64) {
        let begin = frame as f64 / fps;
        match self {
            Self::Times(open, close) => (begin + open, begin + close),
            Self::Degrees(degrees) => (begin, (frame as f64 + degrees / 360.0) / fps),
        }
    }
}

/// `lab`
pub(super) fn space(text: &str) -> Parsed<Space> {
    Space::named(text).ok_or_else(|| {
        let names = Space::ALL.map(|(name, _)| name).join(", ");
        format!("there are {names}")
    })
}

/// The name of a space that has primaries.
pub(super) fn gamut(text: &str) -> Parsed<String> {
    match space(text)?.primaries() {
        Some(_) => Ok(text.to_owned()),
        None => Err(format!("{text} has no primaries, as bt709 has")),
    }
}

/// `0.2,0.5,0.8`
pub(super) fn color(text: &str) -> Parsed<[f64; 3]> {
    point(text).map(|color| color.to_array())
}

/// `380,780`
pub(super) fn band_range(text: &str) -> Parsed<[f32; 2]> {
    const HOW: &str = "write it as A,B in nm, such as 380,780";
    let numbers: Option<Vec<f32>> = text.split(',').map(|t| t.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([a, b]) if !(1.0..=1e6).contains(a) || !(1.0..=1e6).contains(b) => {
            Err(format!("{text} is not between 1 and 1e6 nm"))
        }
        Some([a, b]) if a >= b => Err(format!("{b} nm is not above {a} nm; {HOW}")),
        Some([a, b]) => Ok([*a, *b]),
        _ => Err(HOW.to_owned()),
    }
}

/// `0,0.5` or `180`
pub(super) fn shutter(text: &str) -> Parsed<Shutter> {
    const HOW: &str = "write it as OPEN,CLOSE, such as 0,0.5, or in degrees, such as 180";
    let numbers: Option<Vec<f64>> = text.split(',').map(|t| t.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([degrees]) if (0.0..=360.0).contains(degrees) => Ok(Shutter::Degrees(*degrees)),
        Some([degrees]) => Err(format!(
            "{degrees} degrees are not between 0 and 360; {HOW}"
        )),
        Some([open, close])
            if open.abs().max(close.abs()) > 1e9 || open.is_nan() || close.is_nan() =>
        {
            Err(format!("{text} is not between -1e9 and 1e9"))
        }
        Some([open, close]) if close < open => {
            Err(format!("it closes at {close}, before it opens at {open}"))
        }
        Some([open, close]) => Ok(Shutter::Times(*open, *close)),
        _ => Err(HOW.to_owned()),
    }
}

/// Numbers of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Frames {
    start: i64,
    count: i64,
    step: i64,
}

impl Frames {
    /// The first `count` frames from 0.
    pub(super) fn first(count: u32) -> Self {
        Self {
            start: 0,
            count: count.into(),
            step: 1,
        }
    }

    /// The numbers in order.
    pub(super) fn iter(self) -> impl Iterator<Item = i64> {
        (0..self.count).map(move |i| self.start + i * self.step)
    }
}

/// `start:end` without the end, `start:end:step`, or a single number.
pub(super) fn frames(text: &str) -> Parsed<Frames> {
    /// Both of frames and of their numbers.
    const MOST: i64 = 1_000_000;
    let numbers: Option<Vec<i64>> = text.split(':').map(|t| t.trim().parse().ok()).collect();
    let (start, end, step) = match numbers.as_deref() {
        Some([frame]) => (*frame, frame.saturating_add(1), 1),
        Some([start, end]) => (*start, *end, 1),
        Some([start, end, step]) => (*start, *end, *step),
        _ => return Err("write it as START:END or START:END:STEP, such as 0:36".to_owned()),
    };
    let possible = -MOST..=MOST;
    if ![start, end - 1, step].iter().all(|n| possible.contains(n)) {
        return Err(format!("frames and steps lie between -{MOST} and {MOST}"));
    }
    if step < 1 {
        return Err("the step must be at least 1".to_owned());
    }
    if end <= start {
        return Err(format!(
            "no frame lies from {start} up to, and without, {end}"
        ));
    }
    Ok(Frames {
        start,
        count: (end - start + step - 1) / step,
        step,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_go_up_to_their_end_and_leave_it_out() {
        let list = |text: &str| frames(text).map(|f| f.iter().collect::<Vec<_>>());
        assert_eq!(list("0:3").unwrap(), [0, 1, 2]);
        assert_eq!(list("-2:5:3").unwrap(), [-2, 1, 4]);
        assert_eq!(list("7").unwrap(), [7]);
        for wrong in [
            "",
            "a",
            "3:3",
            "0:5:0",
            "0:5:-1",
            "0:99999999999",
            "1:2:3:4",
            "9223372036854775807",
            "-9223372036854775808:0",
        ] {
            assert!(list(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn a_shutter_is_open_between_two_times_or_for_a_part_of_a_frame() {
        let times = |text: &str| shutter(text).map(|shutter| shutter.times(6, 24.0));
        assert_eq!(times("180"), Ok((0.25, 6.5 / 24.0)));
        assert_eq!(times("0"), Ok((0.25, 0.25)));
        assert_eq!(times("-1, 0.5"), Ok((-0.75, 0.75)));
        assert_eq!(times("0.5,0.5"), Ok((0.75, 0.75)));
        for wrong in [
            "", "a", "361", "-1", "NaN", "1,0", "0,inf", "NaN,1", "0,1,2",
        ] {
            assert!(times(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn weights_are_one_number_or_three() {
        let parsed = |text| weight(text).map(|w| (w.name, w.factors));
        assert_eq!(parsed("a.b=2"), Ok(("a.b".to_owned(), [2.0; 3])));
        assert_eq!(
            parsed("a=b=1, 0,.5"),
            Ok(("a=b".to_owned(), [1.0, 0.0, 0.5]))
        );
        for wrong in [
            "",
            "a",
            "a=",
            "a=1,2",
            "a=1,2,3,4",
            "a=-1",
            "a=inf",
            "a=NaN",
            "a=x",
        ] {
            assert!(weight(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn sizes_of_memory_have_units() {
        assert_eq!(bytes("8G"), Ok(8_000_000_000));
        assert_eq!(bytes("1.5 GiB"), Ok(3 << 29));
        assert_eq!(bytes("512"), Ok(512));
        assert_eq!(bytes("none"), Ok(u64::MAX));
        for wrong in ["", "G", "8X", "1.2.3M", "-1", "2GBB", "8bb"] {
            assert!(bytes(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn counts_have_units_and_bounds() {
        assert_eq!(count("7"), Ok(7));
        assert_eq!(count("250k"), Ok(250_000));
        assert_eq!(count("1.5M"), Ok(1_500_000));
        for wrong in ["", "M", "0", "-1", "5G", "1m", "1.2.3k", "1e6"] {
            assert!(count(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn durations_are_finite_and_not_negative() {
        assert_eq!(seconds("0.5").unwrap().as_millis(), 500);
        for wrong in ["-1", "inf", "NaN", "1e30", "1 min"] {
            assert!(seconds(wrong).is_err(), "{wrong:?}");
        }
    }
}

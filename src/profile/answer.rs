//! A profile's answer in one sentence: what ten times as much of something costs. Counts say it where the machine was too
//! noisy for times.

use super::{Axis, Point, Profile, Quantity, Series, Way, median};

/// Axes in the order of how much one wants to know of them, and what is ten times as much.
const AXES: [(Axis, &str); 6] = [
    (Axis::Objects, "triangles"),
    (Axis::Pixels, "pixels"),
    (Axis::Lights, "lights"),
    (Axis::Samples, "samples"),
    (Axis::Bands, "bands"),
    (Axis::Depth, "bounces"),
];

impl Profile {
    /// Such as `ten times the triangles: a ray takes 20 % longer, the tree 11 times as long to build, …`; nothing where
    /// no axis has two sizes.
    pub fn answer(&self) -> Option<String> {
        let calm = self.noise.warning().is_none();
        let parts = AXES.iter().filter_map(|&(axis, what)| {
            let series = self.series(axis, Way::Tree)?;
            let growth = Tenfold::of(series)?;
            let told = growth.told(axis, calm)?;
            Some(format!("ten times the {what}: {told}"))
        });
        let mut parts = parts.take(2).collect::<Vec<_>>();
        if let Some(scaling) = self.scaling.iter().find(|s| s.phase == Quantity::Render)
            && calm
        {
            let (threads, times) = (scaling.threads, scaling.speedup);
            parts.push(format!(
                "{threads} threads render {times:.1} times as fast as one"
            ));
        }
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

/// Two sizes of a series, and the exponent that makes of their ratio ten.
struct Tenfold<'a> {
    small: &'a Point,
    large: &'a Point,
    exponent: f64,
}

impl<'a> Tenfold<'a> {
    /// Of the largest size and the one that is nearest to a tenth of it.
    fn of(series: &'a Series) -> Option<Self> {
        let large = series.points.last()?;
        let off = |point: &Point| (point.x * 10.0 / large.x).ln().abs();
        let smaller = series
            .points
            .iter()
            .filter(|point| point.x > 0.0 && point.x < large.x);
        let small = smaller.min_by(|a, b| off(a).total_cmp(&off(b)))?;
        let exponent = 10_f64.ln() / (large.x / small.x).ln();
        Some(Self {
            small,
            large,
            exponent,
        })
    }

    /// How many times as much, for ten times the size.
    fn times(&self, of: impl Fn(&Point) -> f64) -> f64 {
        (of(self.large) / of(self.small).max(f64::MIN_POSITIVE)).powf(self.exponent)
    }

    fn time(&self, quantity: Quantity) -> f64 {
        self.times(|point| median(&quantity.of(point)))
    }

    /// What it costs; nothing where only times would tell and the machine is not calm.
    fn told(&self, axis: Axis, calm: bool) -> Option<String> {
        let rays = |point: &Point| point.stats.rays() as f64;
        Some(match (axis, calm) {
            (Axis::Objects, true) => format!(
                "a ray takes {}, the tree {} to build, and memory is {}",
                longer(self.time(Quantity::TracePerRay)),
                as_long(self.time(Quantity::Build)),
                as_much(self.memory())
            ),
            (Axis::Objects, false) => format!(
                "a ray takes {} through the tree, and memory is {}",
                more(self.time(Quantity::StepsPerRay), "steps"),
                as_much(self.memory())
            ),
            (_, true) => format!("rendering takes {}", as_long(self.time(Quantity::Render))),
            (Axis::Lights | Axis::Depth, false) => {
                format!("there are {} rays", as_many(self.times(rays)))
            }
            _ => return None,
        })
    }

    /// Of geometry and trees.
    fn memory(&self) -> f64 {
        self.times(|point| point.bytes.iter().sum::<usize>() as f64)
    }
}

/// A number of times that a person would say.
fn figure(times: f64) -> String {
    match times {
        t if t < 9.95 => format!("{t:.1}"),
        t => format!("{t:.0}"),
    }
}

/// `20 % longer`, `12 % less time` or `2.1 times as long`.
pub(super) fn longer(times: f64) -> String {
    match 100.0 * (times - 1.0) {
        percent if percent.abs() < 0.5 => "as long".to_owned(),
        percent if (-75.0..0.0).contains(&percent) => format!("{:.0} % less time", -percent),
        percent if (0.0..75.0).contains(&percent) => format!("{percent:.0} % longer"),
        _ => as_long(times),
    }
}

fn more(times: f64, what: &str) -> String {
    match 100.0 * (times - 1.0) {
        percent if percent.abs() < 0.5 => format!("as many {what}"),
        percent if (-75.0..0.0).contains(&percent) => format!("{:.0} % fewer {what}", -percent),
        percent if (0.0..75.0).contains(&percent) => format!("{percent:.0} % more {what}"),
        _ => format!("{} {what}", as_many(times)),
    }
}

fn as_long(times: f64) -> String {
    format!("{} times as long", figure(times))
}

fn as_much(times: f64) -> String {
    format!("{} times as much", figure(times))
}

fn as_many(times: f64) -> String {
    format!("{} times as many", figure(times))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_said_as_people_say_them() {
        for (times, said) in [
            (1.0, "as long"),
            (1.2, "20 % longer"),
            (0.9, "10 % less time"),
            (2.14, "2.1 times as long"),
            (0.1, "0.1 times as long"),
            (11.3, "11 times as long"),
        ] {
            assert_eq!(longer(times), said);
        }
        assert_eq!(more(1.31, "steps"), "31 % more steps");
        assert_eq!(more(0.7, "steps"), "30 % fewer steps");
        assert_eq!(more(3.0, "steps"), "3.0 times as many steps");
    }
}

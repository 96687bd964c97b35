//! Which charts a profile makes: along each axis the quantity that the cost model speaks of.

use super::chart::{Chart, Curve, Scale, Spot};
use super::fit::{median, median_interval};
use super::{Axis, Fit, Model, Profile, Quantity, Series, Way};

/// A chart by its name.
#[derive(Clone, Debug)]
pub struct Plot {
    /// For its file, such as `O-steps`.
    pub name: String,
    /// The chart as a document of its own.
    pub svg: String,
}

/// What is drawn along an axis.
struct Plan {
    name: &'static str,
    title: &'static str,
    axis: Axis,
    quantity: Quantity,
    unit: &'static str,
    /// Whether x and y are logarithmic.
    logarithmic: [bool; 2],
    models: &'static [Model],
}

const fn plan(
    (name, axis): (&'static str, Axis),
    title: &'static str,
    (quantity, unit): (Quantity, &'static str),
    logarithmic: [bool; 2],
    models: &'static [Model],
) -> Plan {
    Plan {
        name,
        title,
        axis,
        quantity,
        unit,
        logarithmic,
        models,
    }
}

use Model::{Line, Logarithm, Power};

/// All that there are.
const PLANS: [Plan; 9] = [
    plan(
        ("P-render", Axis::Pixels),
        "Rendering by pixels",
        (Quantity::Render, "s"),
        [true; 2],
        &[Power],
    ),
    plan(
        ("O-trace", Axis::Objects),
        "Tracing a ray: brute force and tree",
        (Quantity::TracePerRay, "ns"),
        [true; 2],
        &[Logarithm, Power],
    ),
    plan(
        ("O-steps", Axis::Objects),
        "Node steps a ray: logarithm or power law?",
        (Quantity::StepsPerRay, ""),
        [true, false],
        &[Logarithm, Power],
    ),
    plan(
        ("O-build", Axis::Objects),
        "Building the tree",
        (Quantity::Build, "s"),
        [true; 2],
        &[Power],
    ),
    plan(
        ("L-shadows", Axis::Lights),
        "Shadow rays by lights: all of them, or one",
        (Quantity::Shadows, "s"),
        [true; 2],
        &[Power],
    ),
    plan(
        ("N-render", Axis::Bands),
        "Rendering by bands, one ray for all",
        (Quantity::Render, "s"),
        [false; 2],
        &[Line, Power],
    ),
    plan(
        ("samples-render", Axis::Samples),
        "Rendering by samples",
        (Quantity::Render, "s"),
        [true; 2],
        &[Power],
    ),
    plan(
        ("depth-render", Axis::Depth),
        "Rendering by the longest path, within walls",
        (Quantity::Render, "s"),
        [false; 2],
        &[Line],
    ),
    plan(
        ("threads-render", Axis::Threads),
        "Rendering by threads",
        (Quantity::Render, "s"),
        [true, false],
        &[],
    ),
];

impl Profile {
    /// The charts of all axes that were swept.
    pub fn plots(&self) -> Vec<Plot> {
        PLANS.iter().filter_map(|plan| self.plot(plan)).collect()
    }

    fn plot(&self, plan: &Plan) -> Option<Plot> {
        let along = self.series.iter().filter(|series| series.axis == plan.axis);
        let curves: Vec<Curve> = along.filter_map(|series| curve(series, plan)).collect();
        if curves.is_empty() {
            return None;
        }
        let chart = Chart {
            title: plan.title.to_owned(),
            x: Scale {
                label: plan.axis.label().to_owned(),
                unit: "",
                logarithmic: plan.logarithmic[0],
            },
            y: Scale {
                label: plan.quantity.bare_name().to_owned(),
                unit: plan.unit,
                logarithmic: plan.logarithmic[1],
            },
            curves,
        };
        Some(Plot {
            name: plan.name.to_owned(),
            svg: chart.svg(),
        })
    }
}

fn curve(series: &Series, plan: &Plan) -> Option<Curve> {
    if plan.quantity == Quantity::Build && series.way == Way::Brute {
        return None; // there is nothing to build
    }
    let observed = series.observed(plan.quantity, 0.0);
    let spots = observed.iter().map(|o| Spot {
        x: o.x,
        y: median(&o.values),
        interval: median_interval(&o.values),
    });
    let points: Vec<Spot> = spots.filter(|spot| spot.y > 0.0).collect();
    let fit = |model: &Model| {
        let growth = series.growth(plan.quantity, *model)?;
        Some((law(series.axis, &growth.fit), growth.fit, growth.from))
    };
    let fits = plan.models.iter().filter_map(fit).collect();
    (points.len() >= 2).then(|| Curve {
        label: series.way.name().to_owned(),
        color: match series.way {
            Way::Brute => 0,
            Way::Tree => 1,
            Way::One => 2,
        },
        points,
        fits,
    })
}

/// A fit as formulas are written.
pub(super) fn law(axis: Axis, fit: &Fit) -> String {
    let Fit {
        model,
        a,
        b,
        interval: [low, high],
        held_out,
    } = fit;
    let law = match model {
        Model::Power => format!("∝ {axis}^{b:.3}  [{low:.3}, {high:.3}]"),
        Model::Logarithm => format!("{a:.2} + {b:.3}·log₂ {axis}"),
        Model::Line => format!("{} + {}·{axis}", scientific(*a), scientific(*b)),
    };
    match held_out {
        Some(off) => format!("{law}; largest predicted to {:+.1} %", 100.0 * off),
        None => law,
    }
}

/// Three digits.
fn scientific(value: f64) -> String {
    if (0.01..1000.0).contains(&value.abs()) {
        format!("{value:.3}")
    } else {
        format!("{value:.2e}")
    }
}

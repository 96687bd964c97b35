//! A profile as comma-separated values: a row a render, with its counts and the median, low and high of its times.

use std::fmt::Write as _;

use super::fit::{median, median_interval};
use super::{Profile, Quantity};

/// Columns of counts.
const COUNTS: &str = "axis,way,x,pixels,samples,primitives,lights,threads,geometry_bytes,tree_bytes,\
    camera_rays,bounce_rays,shadow_rays,shaded,node_steps,primitive_tests,shadow_node_steps,shadow_primitive_tests";

/// Times, each with its interval.
const TIMES: [(&str, Quantity); 7] = [
    ("load", Quantity::Load),
    ("build", Quantity::Build),
    ("render", Quantity::Render),
    ("trace", Quantity::Trace),
    ("shadow", Quantity::Shadows),
    ("shade", Quantity::Shade),
    ("film", Quantity::Film),
];

impl Profile {
    /// As comma-separated values with a line of names.
    pub fn to_csv(&self) -> String {
        let mut out = COUNTS.to_owned();
        for (name, _) in TIMES {
            let _ = write!(out, ",{name}_seconds,{name}_low,{name}_high");
        }
        out.push('\n');
        for series in &self.series {
            let (axis, way) = (series.axis, series.way.name().replace(',', ""));
            for p in &series.points {
                let s = &p.stats;
                let numbers = [
                    p.pixels,
                    p.samples.into(),
                    p.primitives,
                    p.lights as u64,
                    p.threads as u64,
                    p.bytes[0] as u64,
                    p.bytes[1] as u64,
                    s.camera_rays,
                    s.bounce_rays,
                    s.shadow_rays,
                    s.shaded,
                    s.tracing.node_steps,
                    s.tracing.primitive_tests,
                    s.shadow_tracing.node_steps,
                    s.shadow_tracing.primitive_tests,
                ];
                let _ = write!(out, "{axis},{way},{}", p.x);
                for number in numbers {
                    let _ = write!(out, ",{number}");
                }
                for (_, quantity) in TIMES {
                    let values = quantity.of(p);
                    let [low, high] = median_interval(&values);
                    let _ = write!(out, ",{:.9},{low:.9},{high:.9}", median(&values));
                }
                out.push('\n');
            }
        }
        out
    }
}

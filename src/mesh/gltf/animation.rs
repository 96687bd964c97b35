//! The first animation of a glTF file at one time: where its nodes stand then, and the weights of their morph targets.
//! Before the first and after the last keyframe these hold, says the specification (appendix C has the formulas).

use glam::DQuat;

use super::OrWhy;
use super::accessor::Accessors;
use super::json::{Channel, Root, Sampler, at};

/// What an animation says of a node.
pub(super) struct Change {
    node: usize,
    to: To,
}

enum To {
    Translation([f64; 3]),
    Rotation([f64; 4]),
    Scale([f64; 3]),
    Weights(Vec<f32>),
}

/// How values lie between keyframes.
#[derive(Clone, Copy, PartialEq)]
enum Between {
    Step,
    Linear,
    /// On the shorter arc.
    Turning,
    Cubic,
}

/// Values at keyframes.
struct Keys {
    times: Vec<f32>,
    /// For each keyframe one row of values, or three where there are tangents.
    values: Vec<f32>,
    /// Numbers of a row.
    width: usize,
    between: Between,
}

/// What the first animation says of the nodes at `time`, in seconds.
pub(super) fn changes(accessors: &Accessors<'_>, time: f32) -> OrWhy<Vec<Change>> {
    let Some(animation) = accessors.root.animations.first() else {
        return Ok(Vec::new());
    };
    let mut changes = Vec::new();
    for (i, channel) in animation.channels.iter().enumerate() {
        let sampler = at(&animation.samplers, channel.sampler, "sampler")?;
        let change = change(accessors, channel, sampler, time);
        changes.extend(change.map_err(|why| format!("animation 0, channel {i}: {why}"))?);
    }
    Ok(changes)
}

fn change(
    accessors: &Accessors<'_>,
    channel: &Channel,
    sampler: &Sampler,
    time: f32,
) -> OrWhy<Option<Change>> {
    let Some(node) = channel.target.node else {
        return Ok(None);
    };
    at(&accessors.root.nodes, node, "node")?;
    let path = channel.target.path.as_str();
    let (values, width) = match path {
        "translation" | "scale" => (accessors.rows::<3>(sampler.output)?.into_flattened(), 3),
        "rotation" => (accessors.rows::<4>(sampler.output)?.into_flattened(), 4),
        "weights" => (accessors.rows::<1>(sampler.output)?.into_flattened(), 0),
        _ => return Ok(None),
    };
    let between = match (sampler.interpolation.as_deref(), path) {
        (Some("STEP"), _) => Between::Step,
        (Some("CUBICSPLINE"), _) => Between::Cubic,
        (None | Some("LINEAR"), "rotation") => Between::Turning,
        (None | Some("LINEAR"), _) => Between::Linear,
        (Some(other), _) => return Err(format!("its interpolation {other:?} is unknown")),
    };
    let times = accessors.rows::<1>(sampler.input)?.into_flattened();
    let rows = times.len() * if between == Between::Cubic { 3 } else { 1 };
    let width = match width {
        0 if rows > 0 => values.len() / rows,
        width => width,
    };
    if times.is_empty() || width == 0 || values.len() != rows * width {
        let (keys, found) = (times.len(), values.len());
        return Err(format!(
            "{found} numbers at {keys} keyframes are no animation"
        ));
    }
    let keys = Keys {
        times,
        values,
        width,
        between,
    };
    let value = keys.at(time);
    let three = || std::array::from_fn(|i| f64::from(value[i]));
    let to = match path {
        "translation" => To::Translation(three()),
        "scale" => To::Scale(three()),
        "rotation" => To::Rotation(std::array::from_fn(|i| f64::from(value[i]))),
        _ => To::Weights(value),
    };
    Ok(Some(Change { node, to }))
}

impl Keys {
    fn row(&self, row: usize) -> &[f32] {
        &self.values[row * self.width..][..self.width]
    }

    /// The value of a keyframe.
    fn value(&self, key: usize) -> &[f32] {
        match self.between {
            Between::Cubic => self.row(3 * key + 1),
            _ => self.row(key),
        }
    }

    fn at(&self, time: f32) -> Vec<f32> {
        let after = self.times.partition_point(|t| *t <= time);
        if after == 0 || after == self.times.len() {
            return self.value(after.saturating_sub(1)).to_vec();
        }
        let key = after - 1;
        let step = self.times[after] - self.times[key];
        let s = (time - self.times[key]) / step;
        let (a, b) = (self.value(key), self.value(after));
        let pairs = a.iter().zip(b);
        match self.between {
            Between::Step => a.to_vec(),
            Between::Linear => pairs.map(|(a, b)| a + (b - a) * s).collect(),
            Between::Turning => {
                let turn = |q: &[f32]| {
                    let [x, y, z, w] = [0, 1, 2, 3].map(|i| f64::from(q[i]));
                    let q = DQuat::from_xyzw(x, y, z, w);
                    let length = q.length();
                    if length > 0.0 && length.is_finite() {
                        q / length
                    } else {
                        DQuat::IDENTITY
                    }
                };
                turn(a)
                    .slerp(turn(b), s.into())
                    .to_array()
                    .map(|x| x as f32)
                    .to_vec()
            }
            Between::Cubic => {
                let (leaving, coming) = (self.row(3 * key + 2), self.row(3 * after));
                let (s2, s3) = (s * s, s * s * s);
                let of = |i: usize| {
                    (2.0 * s3 - 3.0 * s2 + 1.0) * a[i]
                        + step * (s3 - 2.0 * s2 + s) * leaving[i]
                        + (3.0 * s2 - 2.0 * s3) * b[i]
                        + step * (s3 - s2) * coming[i]
                };
                (0..self.width).map(of).collect()
            }
        }
    }
}

impl Root<'_> {
    /// Puts nodes where an animation has them.
    pub(super) fn apply(&mut self, changes: Vec<Change>) {
        for Change { node, to } in changes {
            let node = &mut self.nodes[node];
            match to {
                To::Translation(v) => node.translation = Some(v),
                To::Rotation(q) => node.rotation = Some(q),
                To::Scale(v) => node.scale = Some(v),
                To::Weights(w) => node.weights = Some(w),
            }
        }
    }
}

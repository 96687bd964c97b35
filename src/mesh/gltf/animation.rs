//! The first animation of a glTF file at one time: where its nodes stand then, and the weights of their morph targets.
//! Before the first and after the last keyframe these hold, says the specification (appendix C has the formulas). And the
//! times at which to look, so that what goes straight in between is near enough.

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
    let channels = channels(accessors)?.into_iter();
    let changes = channels.map(|moving| {
        let value = moving.keys.at(time);
        match value.iter().all(|number| number.abs() <= LARGEST) {
            true => Ok(moving.change(value)),
            false => Err(format!(
                "animation 0, channel {}: its spline goes beyond ±{LARGEST:e} at {time} s",
                moving.number
            )),
        }
    });
    changes.collect()
}

/// Values are no larger: their squares are numbers of single precision.
const LARGEST: f32 = 1e18;

/// When the first animation is looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfAnimation {
    /// Its first and its last keyframe, in seconds.
    pub span: [f32; 2],
    /// Times from when a shutter opens to when it closes, ascending: between any two what moves goes nearly straight. One
    /// where the shutter is open for no time.
    pub moments: Vec<f32>,
    /// How many more of them there would be, if that were not too many.
    pub passed_over: usize,
    /// Nodes whose scale goes through 0 between two moments, in words: their meshes turn inside out.
    pub turned_over: Vec<String>,
}

/// How far a node may turn between two moments, in radians: the middle of an arc is off by 1 − cos of half of it, 0.9 %.
const TURN: f64 = std::f64::consts::PI / 12.0;
/// Moments between two keyframes of a cubic spline.
const PIECES: u32 = 8;
/// Moments are no more: each is a set of vertices.
const MOST: usize = 256;

/// When the first animation is looked at while a shutter is open; `None` where nothing moves.
pub(super) fn moments(
    accessors: &Accessors<'_>,
    [open, close]: [f32; 2],
) -> OrWhy<Option<GltfAnimation>> {
    let channels = channels(accessors)?;
    if channels.is_empty() {
        return Ok(None);
    }
    let keys = || channels.iter().flat_map(|moving| &moving.keys.times);
    let span = [
        keys().copied().fold(f32::INFINITY, f32::min),
        keys().copied().fold(f32::NEG_INFINITY, f32::max),
    ];
    let mut moments = vec![open];
    let mut add = |time: f32| moments.extend((open < time && time < close).then_some(time));
    for Moving { keys, .. } in &channels {
        for &time in &keys.times {
            if keys.between == Between::Step {
                add(time.next_down());
            }
            add(time);
        }
        for (key, pair) in keys.times.windows(2).enumerate() {
            let pieces = keys.pieces(key);
            for piece in 1..pieces {
                add(pair[0] + (pair[1] - pair[0]) * (piece as f32 / pieces as f32));
            }
        }
    }
    if close > open {
        moments.push(close);
    }
    moments.sort_by(f32::total_cmp);
    moments.dedup();
    let all = moments.len();
    if all > MOST {
        moments = (0..MOST)
            .map(|i| moments[i * (all - 1) / (MOST - 1)])
            .collect();
    }
    let turned_over = (channels.iter())
        .filter(|moving| matches!(moving.path, Path::Scale) && moving.turns_over(&moments))
        .map(|moving| match &accessors.root.nodes[moving.node].name {
            Some(name) => format!("node {} ({name:?})", moving.node),
            None => format!("node {}", moving.node),
        });
    Ok(Some(GltfAnimation {
        span,
        turned_over: turned_over.collect(),
        passed_over: all - moments.len(),
        moments,
    }))
}

/// What of a node moves.
struct Moving {
    /// Of its channel.
    number: usize,
    node: usize,
    path: Path,
    keys: Keys,
}

#[derive(Clone, Copy)]
enum Path {
    Translation,
    Rotation,
    Scale,
    Weights,
}

impl Path {
    fn of(name: &str) -> Option<Self> {
        match name {
            "translation" => Some(Self::Translation),
            "rotation" => Some(Self::Rotation),
            "scale" => Some(Self::Scale),
            "weights" => Some(Self::Weights),
            _ => None,
        }
    }
}

impl Moving {
    /// Whether a scale mirrors at some of the moments, and at others does not.
    fn turns_over(&self, moments: &[f32]) -> bool {
        let sides = moments.iter().map(|time| {
            let scale = self.keys.at(*time).into_iter();
            scale.map(f64::from).product::<f64>()
        });
        let (mut mirrors, mut stays) = (false, false);
        for side in sides {
            mirrors |= side < 0.0;
            stays |= side > 0.0;
        }
        mirrors && stays
    }

    fn change(&self, value: Vec<f32>) -> Change {
        let three = || std::array::from_fn(|i| f64::from(value[i]));
        let to = match self.path {
            Path::Translation => To::Translation(three()),
            Path::Scale => To::Scale(three()),
            Path::Rotation => To::Rotation(std::array::from_fn(|i| f64::from(value[i]))),
            Path::Weights => To::Weights(value),
        };
        let node = self.node;
        Change { node, to }
    }
}

/// What is not shown of a file's animations, in words.
pub(super) fn left_out(root: &Root<'_>) -> Vec<&'static str> {
    let Some((first, others)) = root.animations.split_first() else {
        return Vec::new();
    };
    let is_unknown = |channel: &&Channel| {
        channel.target.node.is_none() || Path::of(&channel.target.path).is_none()
    };
    let unknown = first.channels.iter().filter(is_unknown);
    let unknown =
        unknown.map(|_| "channels of the animation that move no node, or move it in an unknown way, are left out");
    let others = others
        .iter()
        .map(|_| "animations after the first are left out");
    unknown.chain(others).collect()
}

/// All that moves in the first animation.
fn channels(accessors: &Accessors<'_>) -> OrWhy<Vec<Moving>> {
    let Some(animation) = accessors.root.animations.first() else {
        return Ok(Vec::new());
    };
    let mut channels = Vec::new();
    for (i, channel) in animation.channels.iter().enumerate() {
        let sampler = at(&animation.samplers, channel.sampler, "sampler")?;
        let moving = moving(accessors, i, channel, sampler);
        channels.extend(moving.map_err(|why| format!("animation 0, channel {i}: {why}"))?);
    }
    Ok(channels)
}

fn moving(
    accessors: &Accessors<'_>,
    number: usize,
    channel: &Channel,
    sampler: &Sampler,
) -> OrWhy<Option<Moving>> {
    let Some(node) = channel.target.node else {
        return Ok(None);
    };
    at(&accessors.root.nodes, node, "node")?;
    let Some(path) = Path::of(&channel.target.path) else {
        return Ok(None);
    };
    let (values, width) = match path {
        Path::Translation | Path::Scale => {
            (accessors.rows::<3>(sampler.output)?.into_flattened(), 3)
        }
        Path::Rotation => (accessors.rows::<4>(sampler.output)?.into_flattened(), 4),
        Path::Weights => (accessors.rows::<1>(sampler.output)?.into_flattened(), 0),
    };
    let between = match (sampler.interpolation.as_deref(), path) {
        (Some("STEP"), _) => Between::Step,
        (Some("CUBICSPLINE"), _) => Between::Cubic,
        (None | Some("LINEAR"), Path::Rotation) => Between::Turning,
        (None | Some("LINEAR"), _) => Between::Linear,
        (Some(other), _) => return Err(format!("its interpolation {other:?} is unknown")),
    };
    let times = accessors.rows::<1>(sampler.input)?.into_flattened();
    let rows = times.len() * if between == Between::Cubic { 3 } else { 1 };
    let width = match width {
        0 if rows > 0 => values.len() / rows,
        width => width,
    };
    let ascend = times.windows(2).all(|pair| pair[0] <= pair[1]);
    if !ascend || !times.iter().all(|time| time.is_finite()) {
        return Err(
            "the times of its keyframes must be finite, each after the one before".to_owned(),
        );
    }
    if times.is_empty() || width == 0 || values.len() != rows * width {
        let (keys, found) = (times.len(), values.len());
        return Err(format!(
            "{found} numbers at {keys} keyframes are no animation"
        ));
    }
    if let Some(place) = (values.iter()).position(|value| value.is_nan() || value.abs() > LARGEST) {
        let keyframe = place / (values.len() / times.len());
        return Err(format!(
            "the {} of node {node} has the number {:e} at keyframe {keyframe}: it must be within ±{LARGEST:e}",
            channel.target.path, values[place]
        ));
    }
    let keys = Keys {
        times,
        values,
        width,
        between,
    };
    Ok(Some(Moving {
        number,
        node,
        path,
        keys,
    }))
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

    /// Into how many nearly straight ones the way from one keyframe to the next is cut.
    fn pieces(&self, key: usize) -> u32 {
        match self.between {
            Between::Step | Between::Linear => 1,
            Between::Cubic => PIECES,
            Between::Turning => {
                let [a, b] = [key, key + 1].map(|key| turn(self.value(key)));
                let angle = 2.0 * a.dot(b).abs().min(1.0).acos();
                // A quarter turn of single precision may be a little more.
                ((angle / TURN - 1e-3).ceil() as u32).max(1)
            }
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
            Between::Turning => turn(a)
                .slerp(turn(b), s.into())
                .to_array()
                .map(|x| x as f32)
                .to_vec(),
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

/// The rotation of a row.
fn turn(q: &[f32]) -> DQuat {
    let [x, y, z, w] = [0, 1, 2, 3].map(|i| f64::from(q[i]));
    let q = DQuat::from_xyzw(x, y, z, w);
    let length = q.length();
    if length > 0.0 && length.is_finite() {
        q / length
    } else {
        DQuat::IDENTITY
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

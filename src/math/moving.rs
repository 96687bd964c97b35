//! Transforms that change over time. A keyframe is taken apart into scale, rotation and translation, M = T·R·S; between
//! two keyframes scale and translation go straight, and the rotation takes the shorter arc at constant speed (Shoemake,
//! *Animating rotation with quaternion curves*, 1985). Before the first and after the last keyframe these hold. Where
//! what moves stands in what moves, the product of all is taken at one time.

use std::f64::consts::PI;
use std::fmt;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::sync::Arc;

use glam::{Affine3, DAffine3, DMat3, DMat4, DQuat, DVec3, Vec3};

use super::Transform;

/// Numbers of double precision: one, or one for each of many times.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// As many answers.
    type Mask: Copy;

    /// The same number everywhere.
    fn splat(value: f64) -> Self;
    /// Where it is less.
    fn lt(self, other: Self) -> Self::Mask;
    /// Whether any is `first` or more, and less than `end`.
    fn any_within(self, first: f64, end: f64) -> bool;
    /// `yes` where the mask is set, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
}

/// An affine map: its linear part's columns, and its translation.
#[derive(Clone, Copy, Debug)]
pub struct Affine<D> {
    /// Where the axes go.
    pub axes: [[D; 3]; 3],
    /// Where the origin goes.
    pub translation: [D; 3],
}

/// A transform at every time.
#[derive(Clone, Debug)]
pub enum Moving {
    /// The same at all times.
    Still(Transform),
    /// Keyframes, or a product of such and of others that stand still.
    Keyed(Arc<Chain>),
}

/// A product of transforms, of which one moves at least.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// The outermost first.
    links: Vec<Link>,
}

#[derive(Clone, Debug, PartialEq)]
enum Link {
    Fixed {
        forward: DAffine3,
        inverse: DAffine3,
    },
    Track(Track),
}

/// Keyframes in time.
#[derive(Clone, Debug, PartialEq)]
struct Track {
    /// Strictly increasing; two at least.
    times: Vec<f64>,
    /// From each keyframe to the next.
    segments: Vec<Segment>,
}

/// From a keyframe to the next. Of each pair of values the first is at the beginning, and the second is what is added up
/// to the end.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Segment {
    turn: Turn,
    scale: [DVec3; 2],
    /// The inverse of the scale, where that stays.
    shrink: Option<DVec3>,
    translation: [DVec3; 2],
    /// When it begins, and one over the time that it takes.
    start: f64,
    rate: f64,
}

/// A motion in two factors, so that what is put into the first can be built as if it stood: its scale may mean more than space.
/// The radii of curves are not scaled, and mirrored triangles have their sides swapped.
#[derive(Clone, Debug)]
pub struct Unscaled {
    /// The scale with which the motion begins, or all but its translation where it begins with a shear.
    pub scale: DMat4,
    /// The motion around that: what is left of it at its first keyframe is a rotation and a translation.
    pub moving: Moving,
}

/// Parts of a transform at a time.
#[derive(Clone, Copy, Debug)]
struct Placed<D> {
    /// The inverse rotation, which is the transpose, column by column.
    unturned: [[D; 3]; 3],
    scale: [D; 3],
    shrink: [D; 3],
    translation: [D; 3],
}

/// A transform that neither shears nor flattens, in parts: x ↦ rotation·(scale·x) + translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// No component is 0; all are negative where it mirrors, else positive.
    scale: DVec3,
    rotation: DQuat,
    translation: DVec3,
}

/// The shorter arc from one rotation to another. With m half way and n at right angles to it, of unit length, quaternions on
/// it are m·cos(x/2) + n·sin(x/2). A rotation's matrix R(q) is quadratic in q, with a bilinear form B: so it is
/// (R(m) + R(n))/2 + (R(m) − R(n))/2·cos x + B(m, n)·sin x, and a ray pays for no quaternion.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Turn {
    /// The inverse rotation: what stays, and what goes with the cosine and with the sine.
    parts: [DMat3; 3],
    /// Half of that by which space turns, in radians: x goes from -`half` to `half`, which is in [0, π/2].
    half: f64,
}

/// Why keyframes make no motion. Keyframes are counted from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unmovable {
    /// There is none.
    Nothing,
    /// The time is no number, does not follow the one before, or is too far from it.
    Time(usize),
    /// The transform is not affine, not finite or singular.
    Flat(usize),
    /// The transform has numbers that single precision has not.
    Huge(usize),
    /// The transform shears, so that it is no product of scale, rotation and translation.
    Sheared(usize),
    /// It mirrors and the one before does not, or the other way round: between them space would be flat.
    Mirrored(usize),
}

impl fmt::Display for Unmovable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Nothing => "there is no keyframe",
            Self::Time(_) => "the times of keyframes must be finite and follow each other",
            Self::Flat(_) => "the transform of a keyframe must be affine and invertible",
            Self::Huge(_) => "the transform of a keyframe must be of numbers within ±3.4e38",
            Self::Sheared(_) => "the transform of a keyframe cannot shear",
            Self::Mirrored(_) => "of two keyframes one mirrors and the other does not",
        })
    }
}

/// The largest cosine between two images of axes that are taken to be at right angles: matrices in files are rounded.
const SHEAR: f64 = 1e-3;
/// The cosine between quaternions below which their rotations are half a turn apart, as far as can be told.
const HALF_TURN: f64 = 1e-7;
/// Space turns by no more than that between two boxes whose union bounds a motion, in radians.
const STEP: f64 = PI / 16.0;
/// The part of coordinates that rounding to single precision may change them by.
const ROUNDING: f64 = 8.0 * f32::EPSILON as f64;

impl Pose {
    /// Takes a matrix apart.
    ///
    /// # Errors
    /// [`Unmovable::Flat`], [`Unmovable::Huge`] or [`Unmovable::Sheared`], with number 0.
    pub fn new(matrix: &DMat4) -> Result<Self, Unmovable> {
        let is_huge = matrix.is_finite() && !matrix.as_mat4().is_finite();
        Transform::new(matrix).ok_or(match is_huge {
            true => Unmovable::Huge(0),
            false => Unmovable::Flat(0),
        })?;
        let m = DAffine3::from_mat4(*matrix);
        let linear = m.matrix3;
        let lengths = DVec3::new(
            linear.x_axis.length(),
            linear.y_axis.length(),
            linear.z_axis.length(),
        );
        let sign = linear.determinant().signum();
        let scale = lengths * sign;
        let [x, y, z] = [0, 1, 2].map(|i| linear.col(i) / scale[i]);
        let cosines = [x.dot(y), y.dot(z), z.dot(x)];
        if cosines.iter().any(|c| c.abs() > SHEAR) {
            return Err(Unmovable::Sheared(0));
        }
        let y = (y - x * x.dot(y)).normalize();
        let rotation = DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y))).normalize();
        Ok(Self {
            scale,
            rotation,
            translation: m.translation,
        })
    }

    /// Along the axes; no component is 0, and all are negative where it mirrors.
    pub fn scale(&self) -> DVec3 {
        self.scale
    }

    /// Whether it turns right hands into left ones.
    pub fn mirrors(&self) -> bool {
        self.scale.x < 0.0
    }

    /// Whether the other is half a turn away, so that neither arc to it is the shorter one.
    pub fn is_half_a_turn_from(&self, other: &Self) -> bool {
        self.rotation.dot(other.rotation).abs() < HALF_TURN
    }
}

/// The bilinear form of which R(q) = B(q, q) is the matrix of a rotation.
fn rotation(a: DQuat, b: DQuat) -> DMat3 {
    let (a, b) = (a.to_array(), b.to_array());
    let product = |i: usize, j: usize| a[i] * b[j] + a[j] * b[i];
    let [x, y, z, w] = [0, 1, 2, 3].map(|i| a[i] * b[i]);
    let [xy, yz, zx] = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| product(i, j));
    let [wx, wy, wz] = [0, 1, 2].map(|i| product(3, i));
    DMat3::from_cols(
        DVec3::new(w + x - y - z, xy + wz, zx - wy),
        DVec3::new(xy - wz, w - x + y - z, yz + wx),
        DVec3::new(zx + wy, yz - wx, w - x - y + z),
    )
}

/// The series of the cosine in x², up to x¹⁸.
const COSINE: [f64; 10] = series(0.0);
/// The series of the sine over x in x², up to x¹⁹.
const SINE: [f64; 10] = series(1.0);

const fn series(shift: f64) -> [f64; 10] {
    let mut series = [1.0; 10];
    let mut i = 1;
    while i < 10 {
        let n = (2 * i) as f64 + shift;
        series[i] = -series[i - 1] / ((n - 1.0) * n);
        i += 1;
    }
    series
}

/// The sum of a series, in parts that do not wait for each other.
#[inline(always)]
fn sum<D: Real>(c: &[f64; 10], y: D) -> D {
    let y2 = y * y;
    let y4 = y2 * y2;
    let first = pair(c, 0, y) + pair(c, 2, y) * y2;
    let next = pair(c, 4, y) + pair(c, 6, y) * y2;
    first + (next + pair(c, 8, y) * y4) * y4
}

#[inline(always)]
fn pair<D: Real>(c: &[f64; 10], i: usize, y: D) -> D {
    D::splat(c[i]) + D::splat(c[i + 1]) * y
}

/// Cosine and sine of x in [-π/2, π/2], to within 10⁻¹⁴: the same bits on every machine, and sooner than from its library.
#[inline(always)]
fn cos_sin<D: Real>(x: D) -> [D; 2] {
    let y = x * x;
    [sum(&COSINE, y), sum(&SINE, y) * x]
}

/// The same vector everywhere.
#[inline(always)]
fn all<D: Real>(v: DVec3) -> [D; 3] {
    [D::splat(v.x), D::splat(v.y), D::splat(v.z)]
}

/// a + b·s
#[inline(always)]
fn add_scaled<D: Real>(a: [D; 3], b: [D; 3], s: D) -> [D; 3] {
    [a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s]
}

#[inline(always)]
fn scaled<D: Real>(v: [D; 3], s: D) -> [D; 3] {
    [v[0] * s, v[1] * s, v[2] * s]
}

impl<D: Real> Affine<D> {
    /// The same map everywhere.
    #[inline(always)]
    fn all(map: &DAffine3) -> Self {
        let m = &map.matrix3;
        Self {
            axes: [all(m.x_axis), all(m.y_axis), all(m.z_axis)],
            translation: all(map.translation),
        }
    }

    /// A direction's image.
    #[inline(always)]
    fn vector(&self, v: [D; 3]) -> [D; 3] {
        let [x, y, z] = self.axes;
        add_scaled(add_scaled(scaled(x, v[0]), y, v[1]), z, v[2])
    }

    /// `self` after `first`.
    #[inline(always)]
    fn after(&self, first: &Self) -> Self {
        let ([x, y, z], o) = (first.axes, self.vector(first.translation));
        let t = self.translation;
        Self {
            axes: [self.vector(x), self.vector(y), self.vector(z)],
            translation: [o[0] + t[0], o[1] + t[1], o[2] + t[2]],
        }
    }

    /// `yes` where the mask is set, else `no`.
    #[inline(always)]
    fn select(mask: D::Mask, yes: &Self, no: &Self) -> Self {
        let mut map = *no;
        for i in 0..3 {
            map.translation[i] = D::select(mask, yes.translation[i], no.translation[i]);
            for j in 0..3 {
                map.axes[i][j] = D::select(mask, yes.axes[i][j], no.axes[i][j]);
            }
        }
        map
    }
}

impl From<Affine<f64>> for DAffine3 {
    fn from(map: Affine<f64>) -> Self {
        Self {
            matrix3: DMat3::from_cols_array_2d(&map.axes),
            translation: map.translation.into(),
        }
    }
}

impl Turn {
    fn between(from: DQuat, to: DQuat) -> Self {
        let cosine = from.dot(to);
        let (to, cosine) = if cosine < 0.0 {
            (-to, -cosine)
        } else {
            (to, cosine)
        };
        let side = to - from * cosine;
        let sine = side.length();
        // Between the quaternions, which is half of that by which space turns.
        let (side, half) = match sine < f64::EPSILON {
            true => (DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), 0.0),
            false => (side / sine, sine.atan2(cosine)),
        };
        let (sin, cos) = (0.5 * half).sin_cos();
        let (m, n) = (from * cos + side * sin, side * cos - from * sin);
        let (of_m, of_n) = (rotation(m, m), rotation(n, n));
        let parts = [(of_m + of_n) * 0.5, (of_m - of_n) * 0.5, rotation(m, n)];
        Self {
            parts: parts.map(|part| part.transpose()),
            half,
        }
    }

    /// The inverse rotation a part s of the way along.
    #[inline(always)]
    fn back<D: Real>(&self, s: D) -> [[D; 3]; 3] {
        let x = D::splat(self.half) * (D::splat(2.0) * s - D::splat(1.0));
        let [cos, sin] = cos_sin(x);
        let [stays, along, across] = &self.parts;
        let mut columns = [[s; 3]; 3];
        for (i, to) in columns.iter_mut().enumerate() {
            let goes = add_scaled(all(stays.col(i)), all(along.col(i)), cos);
            *to = add_scaled(goes, all(across.col(i)), sin);
        }
        columns
    }
}

impl Segment {
    fn between([from, to]: [&Pose; 2], times: [f64; 2]) -> Self {
        let scale = [from.scale, to.scale - from.scale];
        Self {
            turn: Turn::between(from.rotation, to.rotation),
            scale,
            shrink: (scale[1] == DVec3::ZERO).then(|| from.scale.recip()),
            translation: [from.translation, to.translation - from.translation],
            start: times[0],
            rate: (times[1] - times[0]).recip(),
        }
    }

    /// Of each axis the largest absolute value on the way.
    fn largest_scale(&self) -> DVec3 {
        let [from, growth] = self.scale;
        from.abs().max((from + growth).abs())
    }

    /// Of each axis the largest absolute value of the translation on the way.
    fn farthest(&self) -> DVec3 {
        let [from, course] = self.translation;
        from.abs().max((from + course).abs())
    }

    /// The part of its time that has passed, in [0, 1].
    #[inline(always)]
    fn part<D: Real>(&self, time: D) -> D {
        let s = (time - D::splat(self.start)) * D::splat(self.rate);
        let (zero, one) = (D::splat(0.0), D::splat(1.0));
        // What is no number, between times that are next to each other, becomes 0.
        D::select(zero.lt(s), D::select(s.lt(one), s, one), zero)
    }

    /// A part s of the way along.
    #[inline(always)]
    fn placed<D: Real>(&self, s: D) -> Placed<D> {
        let scale = add_scaled(all(self.scale[0]), all(self.scale[1]), s);
        let one = D::splat(1.0);
        Placed {
            unturned: self.turn.back(s),
            scale,
            shrink: match self.shrink {
                Some(shrink) => all(shrink),
                None => [one / scale[0], one / scale[1], one / scale[2]],
            },
            translation: add_scaled(all(self.translation[0]), all(self.translation[1]), s),
        }
    }

    /// The way back at times.
    #[inline(always)]
    fn back<D: Real>(&self, times: D) -> Affine<D> {
        self.placed(self.part(times)).inverse()
    }
}

impl Placed<f64> {
    fn forward(&self) -> DAffine3 {
        let turned = DMat3::from_cols_array_2d(&self.unturned).transpose();
        let s = self.scale;
        DAffine3 {
            matrix3: DMat3::from_cols(
                turned.x_axis * s[0],
                turned.y_axis * s[1],
                turned.z_axis * s[2],
            ),
            translation: self.translation.into(),
        }
    }
}

impl<D: Real> Placed<D> {
    /// The way back, without inverting a matrix.
    #[inline(always)]
    fn inverse(&self) -> Affine<D> {
        let ([x, y, z], [p, q, r]) = (self.unturned, self.shrink);
        let back = Affine {
            axes: [
                [x[0] * p, x[1] * q, x[2] * r],
                [y[0] * p, y[1] * q, y[2] * r],
                [z[0] * p, z[1] * q, z[2] * r],
            ],
            translation: self.translation,
        };
        let [x, y, z] = back.vector(self.translation);
        Affine {
            translation: [-x, -y, -z],
            ..back
        }
    }
}

impl Track {
    fn new(keyframes: &[(f64, DMat4)]) -> Result<Self, Unmovable> {
        let mut times: Vec<f64> = Vec::with_capacity(keyframes.len());
        let mut poses: Vec<Pose> = Vec::with_capacity(keyframes.len());
        for (number, (time, matrix)) in keyframes.iter().enumerate() {
            let pose = Pose::new(matrix).map_err(|why| match why {
                Unmovable::Sheared(_) => Unmovable::Sheared(number),
                Unmovable::Huge(_) => Unmovable::Huge(number),
                _ => Unmovable::Flat(number),
            })?;
            let step = times.last().map_or(1.0, |last| time - last);
            if !(time.is_finite() && step.is_finite() && step > 0.0) {
                return Err(Unmovable::Time(number));
            }
            if poses
                .last()
                .is_some_and(|last| last.mirrors() != pose.mirrors())
            {
                return Err(Unmovable::Mirrored(number));
            }
            times.push(*time);
            poses.push(pose);
        }
        let pairs = poses.windows(2).zip(times.windows(2));
        let segments =
            pairs.map(|(pose, time)| Segment::between([&pose[0], &pose[1]], [time[0], time[1]]));
        Ok(Self {
            segments: segments.collect(),
            times,
        })
    }

    /// The segment in which `time` lies.
    #[inline(always)]
    fn key(&self, time: f64) -> usize {
        self.segments[1..].partition_point(|next| next.start <= time)
    }

    /// The segment in which `time` lies, and the part of it that has passed, in [0, 1].
    fn place(&self, time: f64) -> (usize, f64) {
        let key = self.key(time);
        (key, self.segments[key].part(time))
    }

    fn placed(&self, (key, s): (usize, f64)) -> Placed<f64> {
        self.segments[key].placed(s)
    }

    /// The way back at times, of which `first` is the first and `last` the last.
    #[inline(always)]
    fn back<D: Real>(&self, times: D, [first, last]: [f64; 2]) -> Affine<D> {
        let (first, last) = (self.key(first), self.key(last));
        let mut found = self.segments[last].back(times);
        for key in (first..last).rev() {
            let (segment, end) = (&self.segments[key], self.segments[key + 1].start);
            // Before the first keyframe it is as there.
            if key == first || times.any_within(segment.start, end) {
                let before = times.lt(D::splat(end));
                found = Affine::select(before, &segment.back(times), &found);
            }
        }
        found
    }

    /// A box around a box's image at all times of an interval. Between two times that are a part h of an arc apart, a
    /// point strays from the straight line by at most h²/8·max|p″|, and p″ = R″Sx + 2R′S′x.
    fn swept(&self, [min, max]: [DVec3; 2], (open, close): (f64, f64)) -> [DVec3; 2] {
        let farthest = min.abs().max(max.abs());
        let [first, last] = [open, close].map(|time| self.place(time));
        let mut swept = image(&self.placed(first).forward(), [min, max]);
        for key in first.0..=last.0 {
            let from = if key == first.0 { first.1 } else { 0.0 };
            let to = if key == last.0 { last.1 } else { 1.0 };
            let segment = &self.segments[key];
            let speed = 2.0 * segment.turn.half;
            let steps = (speed * (to - from) / STEP).ceil().max(1.0);
            let h = (to - from) / steps;
            let reach = (segment.largest_scale() * farthest).length();
            let growth = (segment.scale[1].abs() * farthest).length();
            let bulge = h * h / 8.0 * (speed * speed * reach + 2.0 * speed * growth);
            for step in 0..=steps as u32 {
                let s = (from + h * f64::from(step)).min(1.0);
                let [low, high] = image(&segment.placed(s).forward(), [min, max]);
                swept = [swept[0].min(low - bulge), swept[1].max(high + bulge)];
            }
        }
        swept
    }
}

/// A box around a box's image.
fn image(transform: &DAffine3, [min, max]: [DVec3; 2]) -> [DVec3; 2] {
    let m = transform.matrix3;
    let (mut low, mut high) = (transform.translation, transform.translation);
    for axis in 0..3 {
        let (a, b) = (m.col(axis) * min[axis], m.col(axis) * max[axis]);
        low += a.min(b);
        high += a.max(b);
    }
    [low, high]
}

impl Link {
    /// With the scale of its first keyframe, if it has any.
    fn first(&self) -> DAffine3 {
        match self {
            Self::Fixed { forward, .. } => *forward,
            Self::Track(track) => track.placed((0, 0.0)).forward(),
        }
    }

    fn fixed(forward: DAffine3) -> Self {
        Self::Fixed {
            forward,
            inverse: forward.inverse(),
        }
    }

    /// The way back, as [`Track::back`].
    #[inline(always)]
    fn back<D: Real>(&self, times: D, range: [f64; 2]) -> Affine<D> {
        match self {
            Self::Fixed { inverse, .. } => Affine::all(inverse),
            Self::Track(track) => track.back(times, range),
        }
    }
}

impl Chain {
    /// Takes a scale away from what is innermost.
    fn unscale(&mut self, scale: DVec3) {
        match self.links.last_mut() {
            Some(Link::Track(track)) => {
                for segment in &mut track.segments {
                    segment.scale = segment.scale.map(|own| own / scale);
                    segment.shrink = segment.shrink.map(|_| segment.scale[0].recip());
                }
            }
            _ => {
                let away = DAffine3::from_scale(scale.recip());
                self.links.push(Link::fixed(away));
            }
        }
    }

    /// At `time`.
    pub fn at(&self, time: f32) -> Transform {
        let time = f64::from(time);
        let mut links = self.links.iter().map(|link| match link {
            Link::Fixed { forward, inverse } => (*forward, *inverse),
            Link::Track(track) => {
                let placed = track.placed(track.place(time));
                (placed.forward(), placed.inverse().into())
            }
        });
        let outermost = links
            .next()
            .unwrap_or((DAffine3::IDENTITY, DAffine3::IDENTITY));
        let (forward, inverse) = links.fold(outermost, |(forward, inverse), inner| {
            (forward * inner.0, inner.1 * inverse)
        });
        Transform::of_parts(&forward, &inverse)
    }

    /// [`Moving::back_at`].
    #[inline(always)]
    fn back_at<D: Real>(&self, times: D, range: [f64; 2]) -> Affine<D> {
        let mut found = self.links[0].back(times, range);
        for inner in &self.links[1..] {
            found = inner.back(times, range).after(&found);
        }
        found
    }

    /// [`Moving::back`].
    #[inline(never)]
    fn back(&self, time: f32) -> Affine3 {
        let time = f64::from(time);
        DAffine3::from(self.back_at(time, [time; 2])).as_affine3()
    }
}

impl Moving {
    /// Moves nothing.
    pub const IDENTITY: Self = Self::Still(Transform::IDENTITY);

    /// From keyframes: (time, transform).
    ///
    /// # Errors
    /// Where they make no motion.
    pub fn new(keyframes: &[(f64, DMat4)]) -> Result<Self, Unmovable> {
        let (_, first) = keyframes.first().ok_or(Unmovable::Nothing)?;
        let track = Track::new(keyframes)?;
        if keyframes.iter().all(|(_, matrix)| matrix == first) {
            let still = Transform::new(first).ok_or(Unmovable::Flat(0))?;
            return Ok(Self::Still(still));
        }
        let links = vec![Link::Track(track)];
        Ok(Self::Keyed(Arc::new(Chain { links })))
    }

    /// The product of `outer`, `between` and `inner`, of which the first and the last may be absent; `None` where
    /// `between` is not affine and invertible.
    pub fn product(outer: Option<&Self>, between: &DMat4, inner: Option<&Self>) -> Option<Self> {
        let still = Transform::new(between)?;
        let mut links: Vec<Link> = outer.map(Self::links).unwrap_or_default();
        if *between != DMat4::IDENTITY {
            links.push(Link::fixed(DAffine3::from_mat4(*between)));
        }
        links.extend(inner.map(Self::links).unwrap_or_default());
        if links.iter().any(|link| matches!(link, Link::Track(_))) {
            return Some(Self::Keyed(Arc::new(Chain { links })));
        }
        if outer.is_none() && inner.is_none() {
            return Some(Self::Still(still));
        }
        let chain = Chain { links };
        Some(Self::Still(chain.at(0.0)))
    }

    fn links(&self) -> Vec<Link> {
        match self {
            Self::Still(transform) => vec![Link::fixed(transform.forward())],
            Self::Keyed(chain) => chain.links.clone(),
        }
    }

    /// As [`Moving::product`], with the scale of `between` and of the first keyframe of `inner` apart. That of `outer` stays
    /// where it is.
    pub fn unscaled(outer: Option<&Self>, between: &DMat4, inner: &Self) -> Option<Unscaled> {
        let linear = |matrix: DMat3| DMat4::from_mat3(matrix);
        let mut first = DAffine3::from_mat4(*between);
        let inner_links = inner.links();
        for link in &inner_links {
            first *= link.first();
        }
        let scale = match (&inner_links[..], *between == DMat4::IDENTITY) {
            // To the last bit.
            ([Link::Track(track)], true) => Some(track.segments[0].scale[0]),
            _ => Pose::new(&linear(first.matrix3))
                .ok()
                .map(|pose| pose.scale()),
        };
        let mut chain = match Self::product(outer, between, Some(inner))? {
            Self::Keyed(chain) => Arc::unwrap_or_clone(chain),
            moving @ Self::Still(_) => {
                let scale = DMat4::IDENTITY;
                return Some(Unscaled { scale, moving });
            }
        };
        let scale = match scale {
            Some(scale) => {
                chain.unscale(scale);
                DMat4::from_scale(scale)
            }
            None => {
                let back = DAffine3::from_mat3(first.matrix3.inverse());
                chain.links.push(Link::fixed(back));
                linear(first.matrix3)
            }
        };
        let moving = Self::Keyed(Arc::new(chain));
        Some(Unscaled { scale, moving })
    }

    /// Whether it is the same at all times.
    pub fn is_still(&self) -> bool {
        matches!(self, Self::Still(_))
    }

    /// At `time`, in the units of `shutter_open`.
    #[inline]
    pub fn at(&self, time: f32) -> Transform {
        match self {
            Self::Still(transform) => *transform,
            Self::Keyed(chain) => chain.at(time),
        }
    }

    /// The inverse of the transform at `time`, which takes half as long where nobody asks for the other half.
    #[inline]
    pub fn back(&self, time: f32) -> Affine3 {
        match self {
            Self::Still(transform) => *transform.back(),
            Self::Keyed(chain) => chain.back(time),
        }
    }

    /// The same at many times, of which `first` is the first and `last` the last; to the bit, once it is rounded to single
    /// precision.
    #[inline(always)]
    pub fn back_at<D: Real>(&self, times: D, first: f32, last: f32) -> Affine<D> {
        match self {
            Self::Still(transform) => Affine::all(&transform.back().as_daffine3()),
            Self::Keyed(chain) => chain.back_at(times, [first, last].map(f64::from)),
        }
    }

    /// The times of its keyframes; at one of them any is as good as another where it is still.
    pub fn times(&self) -> Vec<f32> {
        let mut times = vec![];
        if let Self::Keyed(chain) = self {
            for link in &chain.links {
                if let Link::Track(track) = link {
                    times.extend(track.times.iter().map(|time| *time as f32));
                }
            }
        }
        if times.is_empty() {
            times.push(0.0);
        }
        times.sort_by(f32::total_cmp);
        times.dedup();
        times
    }

    /// A box (smallest and largest coordinates) around the images of a finite box at all times from `open` to `close`,
    /// with room for rounding.
    pub fn swept(&self, bounds: [Vec3; 2], (open, close): (f32, f32)) -> [Vec3; 2] {
        let interval = (f64::from(open), f64::from(close));
        let mut bounds = bounds.map(|corner| corner.as_dvec3());
        let mut room = DVec3::ZERO;
        let add_rounding = |room: DVec3, forward: &DAffine3, bounds: [DVec3; 2]| {
            let m = forward.matrix3;
            let spread = DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
            let farthest = bounds[0].abs().max(bounds[1].abs());
            spread * (room + ROUNDING * farthest) + ROUNDING * forward.translation.abs()
        };
        match self {
            Self::Still(transform) => {
                let forward = transform.forward();
                room = add_rounding(room, &forward, bounds);
                bounds = image(&forward, bounds);
            }
            Self::Keyed(chain) => {
                for link in chain.links.iter().rev() {
                    bounds = match link {
                        Link::Fixed { forward, .. } => {
                            room = add_rounding(room, forward, bounds);
                            image(forward, bounds)
                        }
                        Link::Track(track) => {
                            let largest = |of: fn(&Segment) -> DVec3| {
                                let segments = track.segments.iter().map(of);
                                segments.fold(DVec3::ZERO, DVec3::max)
                            };
                            let scale = largest(Segment::largest_scale).max_element();
                            let spread = DVec3::splat(scale * 3.0_f64.sqrt());
                            let farthest = bounds[0].abs().max(bounds[1].abs());
                            let turned = (room + ROUNDING * farthest).length();
                            let moved = largest(Segment::farthest);
                            room = spread * turned + ROUNDING * moved;
                            track.swept(bounds, interval)
                        }
                    };
                }
            }
        }
        [(bounds[0] - room).as_vec3(), (bounds[1] + room).as_vec3()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random;

    fn number(key: u64, i: u32) -> f64 {
        f64::from(random::unit(random::bits(key, i)))
    }

    fn vector(key: u64, i: u32) -> DVec3 {
        let c = |j| 2.0 * number(key, 3 * i + j) - 1.0;
        DVec3::new(c(0), c(1), c(2))
    }

    /// A pose of any kind.
    fn matrix(key: u64, i: u32) -> DMat4 {
        DMat4::from_translation(3.0 * vector(key, 4 * i))
            * DMat4::from_axis_angle(vector(key, 4 * i + 1).normalize(), 9.0 * number(key, 7 * i))
            * DMat4::from_scale(vector(key, 4 * i + 2).abs() + 0.2)
    }

    /// Motions of one track and of several, with uneven keyframes.
    fn motions() -> Vec<Moving> {
        let one = |key| {
            let keyframes =
                (0..4).map(|i| (f64::from(i) + 0.5 * number(key, 90 + i), matrix(key, i)));
            Moving::new(&keyframes.collect::<Vec<_>>()).unwrap()
        };
        let mut motions: Vec<Moving> = (1..12).map(one).collect();
        let mirrored = [(0.0, 1.0), (1.0, 3.0)].map(|(time, size)| {
            let mirror = DMat4::from_scale(DVec3::new(size, -0.5, 2.0));
            (time, DMat4::from_rotation_y(2.5 * time) * mirror)
        });
        motions.push(Moving::new(&mirrored).unwrap());
        let shear = DMat4::from_mat3(DMat3::from_cols(
            DVec3::X,
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::Z,
        ));
        motions.push(Moving::product(Some(&one(20)), &shear, Some(&one(21))).unwrap());
        motions.push(Moving::product(None, &shear, Some(&one(22))).unwrap());
        motions
    }

    #[test]
    fn keyframes_are_met_and_the_ends_hold() {
        for key in 1..20 {
            let keyframes: Vec<(f64, DMat4)> = [0.0, 0.25, 2.0]
                .into_iter()
                .zip((0..).map(|i| matrix(key, i)))
                .collect();
            let moving = Moving::new(&keyframes).unwrap();
            for (time, at) in [(-5.0, 0), (0.0, 0), (0.25, 1), (2.0, 2), (9.0, 2)] {
                let expected = Transform::new(&keyframes[at].1).unwrap();
                let found = moving.at(time);
                for (a, b) in [(expected, found), (expected.inverse(), found.inverse())] {
                    let size = a
                        .linear()
                        .to_cols_array()
                        .into_iter()
                        .fold(1.0, |m: f32, c| m.max(c.abs()));
                    assert!(
                        a.linear().abs_diff_eq(b.linear(), 1e-5 * size),
                        "{a:?} {b:?}"
                    );
                    assert!(a.translation().abs_diff_eq(b.translation(), 2e-5 * size));
                }
            }
        }
    }

    #[test]
    fn the_way_there_and_back_is_the_identity_at_every_time() {
        for moving in motions() {
            for i in 0..50 {
                let at = moving.at((5.0 * number(40, i)) as f32);
                let p = vector(41, i).as_vec3();
                assert!(at.inverse().point(at.point(p)).distance(p) < 2e-4);
                assert_eq!(moving.back((5.0 * number(40, i)) as f32), *at.back());
            }
        }
    }

    #[test]
    fn rotations_keep_their_speed_and_take_the_shorter_way() {
        let turned = |degrees: f64| DMat4::from_rotation_z(degrees.to_radians());
        for (to, middle) in [(90.0, 45.0), (170.0, 85.0), (-120.0, -60.0), (270.0, -45.0)] {
            let moving = Moving::new(&[(0.0, turned(0.0)), (1.0, turned(to))]).unwrap();
            let found = moving.at(0.5).point(Vec3::X);
            let expected = turned(middle).transform_point3(DVec3::X).as_vec3();
            assert!(found.distance(expected) < 1e-6, "{to}: {found}");
        }
    }

    #[test]
    fn what_stands_in_what_moves_goes_on_an_arc() {
        let half = |angle: f64| DMat4::from_rotation_z(angle);
        let outer = Moving::new(&[(0.0, half(0.0)), (1.0, half(1.0))]).unwrap();
        let inner = Moving::new(&[(0.0, half(0.0)), (1.0, half(-1.0))]).unwrap();
        let out = DMat4::from_translation(DVec3::new(2.0, 0.0, 0.0));
        let product = Moving::product(Some(&outer), &out, Some(&inner)).unwrap();
        for time in [0.0_f32, 0.3, 0.5, 1.0] {
            let expected = Vec3::new(2.0 * time.cos() + 1.0, 2.0 * time.sin(), 0.0);
            let found = product.at(time).point(Vec3::X);
            assert!(found.distance(expected) < 1e-6, "{time}: {found}");
        }
    }

    #[test]
    fn a_motion_s_first_scale_times_the_rest_is_the_motion() {
        let shear = DMat4::from_mat3(DMat3::from_cols(
            DVec3::X,
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::Z,
        ));
        let motions = motions();
        for between in [
            DMat4::IDENTITY,
            DMat4::from_scale(DVec3::new(-2.0, 3.0, 1.0)),
            shear,
        ] {
            for (outer, inner) in [
                (None, &motions[0]),
                (Some(&motions[1]), &motions[2]),
                (None, &motions[11]),
                (Some(&motions[2]), &motions[12]),
            ] {
                let whole = Moving::product(outer, &between, Some(inner)).unwrap();
                let Unscaled { scale, moving } = Moving::unscaled(outer, &between, inner).unwrap();
                for i in 0..20 {
                    let (time, p) = (4.0 * number(60, i), vector(61, i));
                    let expected = whole.at(time as f32).point(p.as_vec3());
                    let scaled = scale.transform_point3(p).as_vec3();
                    let found = moving.at(time as f32).point(scaled);
                    assert!(expected.distance(found) < 1e-4, "{expected} {found}");
                }
                if outer.is_none() {
                    let first = moving.at(-1.0).linear();
                    let round = first.transpose() * first;
                    assert!(round.abs_diff_eq(glam::Mat3::IDENTITY, 1e-5), "{first}");
                }
            }
        }
    }

    #[test]
    fn the_swept_box_holds_the_box_at_all_times_and_little_more() {
        for (i, moving) in (0..).zip(motions()) {
            let (a, b) = (vector(50, i), vector(51, i));
            let bounds = [a.min(b).as_vec3(), a.max(b).as_vec3()];
            let open = (4.0 * number(52, i)) as f32;
            for interval in [
                (open, open),
                (open, open + 0.3),
                (open, open + 9.0),
                (-1.0, 5.0),
            ] {
                let [min, max] = moving.swept(bounds, interval);
                let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
                for step in 0..=2000 {
                    let s = step as f32 / 2000.0;
                    let at = moving.at(interval.0 + s * (interval.1 - interval.0));
                    for corner in 0..8 {
                        let pick = |axis: usize| bounds[corner >> axis & 1][axis];
                        let p = at.point(Vec3::new(pick(0), pick(1), pick(2)));
                        (low, high) = (low.min(p), high.max(p));
                    }
                }
                assert!(
                    min.cmple(low).all() && max.cmpge(high).all(),
                    "{i} {interval:?}"
                );
                let slack = ((low - min).max(max - high)).max_element();
                // Of nested motions the box of a box is bounded.
                let most = if i < 12 { 0.02 } else { 2.0 } * (high - low).length();
                assert!(slack < most, "{i} {interval:?}: {slack} {most}");
            }
        }
    }

    #[test]
    fn keyframes_that_make_no_motion_are_told_with_their_number() {
        let id = DMat4::IDENTITY;
        let flat = DMat4::from_scale(DVec3::new(1.0, 1.0, 0.0));
        let mirror = DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0));
        let shear = DMat4::from_mat3(DMat3::from_cols(
            DVec3::X,
            DVec3::new(0.1, 1.0, 0.0),
            DVec3::Z,
        ));
        let why = |keyframes: &[(f64, DMat4)]| Moving::new(keyframes).unwrap_err();
        assert_eq!(why(&[]), Unmovable::Nothing);
        assert_eq!(why(&[(0.0, id), (0.0, id)]), Unmovable::Time(1));
        assert_eq!(why(&[(0.0, id), (-1.0, id)]), Unmovable::Time(1));
        assert_eq!(why(&[(f64::NAN, id)]), Unmovable::Time(0));
        assert_eq!(why(&[(-1e308, id), (1e308, id)]), Unmovable::Time(1));
        assert_eq!(why(&[(0.0, id), (1.0, flat)]), Unmovable::Flat(1));
        let far = DMat4::from_translation(DVec3::splat(1e300));
        assert_eq!(why(&[(0.0, id), (1.0, far)]), Unmovable::Huge(1));
        assert_eq!(why(&[(0.0, id), (1.0, shear)]), Unmovable::Sheared(1));
        assert_eq!(
            why(&[(0.0, id), (1.0, id), (2.0, mirror)]),
            Unmovable::Mirrored(2)
        );
        assert!(Moving::new(&[(7.0, mirror)]).unwrap().is_still());
        assert!(
            Moving::new(&[(0.0, mirror), (1.0, mirror)])
                .unwrap()
                .is_still()
        );
    }
}

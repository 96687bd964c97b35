//! `<transform>` and `<animation>`: operations apply in the order in which they are written, each new one
//! multiplying from the left; rotations are in degrees, right-handed. `<lookat>` makes camera-to-world
//! with the camera looking along +Z and +X to the image's left, as in Mitsuba.

use glam::{DMat3, DMat4, DVec3, DVec4};

use super::defines::Defines;
use super::element::{Element, File};
use super::values::{number, numbers, vector, xyz};
use crate::error::{Error, Result};
use crate::math::moving::{Pose, Unmovable};

/// How far from 0 times may be: single precision holds them, and what lies between.
pub(crate) const LATEST: f64 = 1e30;

const OPERATIONS: [&str; 5] = ["translate", "rotate", "scale", "lookat", "matrix"];

/// The longest that the axis of a rotation may differ from unit length without a word.
const UNIT_LENGTH: f64 = 1e-3;

/// What is needed to read transforms, and what is worth knowing about them.
#[derive(Debug)]
pub(super) struct Reading<'r, 'f> {
    pub(super) file: &'r File<'f>,
    pub(super) defines: &'r mut Defines,
    pub(super) strict: bool,
    pub(super) warnings: Vec<Error>,
    /// Where the last `<lookat>` looks, in the space that the transform leads to.
    pub(super) target: Option<DVec3>,
}

impl Reading<'_, '_> {
    /// The product of the operations inside `element`; affine and finite.
    pub(super) fn transform(&mut self, element: &Element<'_>) -> Result<DMat4> {
        let mut product = DMat4::IDENTITY;
        for child in element.children() {
            let child = Element::open(child, &self.file.lines, self.defines)?;
            let operation = self.operation(&child)?;
            product = operation * product;
            self.target = match child.tag {
                "lookat" | "lookAt" => Some(target(&child)?),
                _ => self.target.map(|point| operation.transform_point3(point)),
            };
            child.no_children(&self.file.lines)?;
        }
        if !product.is_finite() {
            return Err(element.error("the transform is not finite"));
        }
        Ok(product)
    }

    /// The keyframes inside `element`, which make a motion.
    pub(super) fn animation(&mut self, element: &Element<'_>) -> Result<Vec<(f64, DMat4)>> {
        if self.strict {
            return Err(element.error("Mitsuba 3.9 has no <animation>"));
        }
        let mut keyframes: Vec<(f64, DMat4)> = Vec::new();
        let mut last_pose: Option<Pose> = None;
        for child in element.children() {
            let child = Element::open(child, &self.file.lines, self.defines)?;
            if child.tag != "transform" {
                return Err(child.error(format!(
                    "<{}> cannot stand inside <animation>, which holds <transform time=\"…\">",
                    child.tag
                )));
            }
            child.only(&["time"])?;
            let time = number(child.required("time")?.trim())
                .map_err(|e| e.at(child.attribute_location("time")))?;
            if time.abs() > LATEST {
                let message = format!("the time {time} is not between {LATEST:e} and its opposite");
                return Err(child.attribute_error("time", message));
            }
            if let Some(&(last, _)) = keyframes.last()
                && time <= last
            {
                return Err(child.attribute_error(
                    "time",
                    format!("keyframes must follow each other in time: {time} follows {last}"),
                ));
            }
            let keyframe = self.transform(&child)?;
            let pose = Pose::new(&keyframe).map_err(|why| match why {
                Unmovable::Sheared(_) => child
                    .error("a keyframe cannot shear: what lies between two is not clear then")
                    .help("write a scale before the rotations"),
                Unmovable::Huge(_) => child
                    .error("the transform has numbers that are too large to render with")
                    .help("they must be within ±3.4e38, the range of single precision"),
                _ => child
                    .error("the transform is singular: it flattens space")
                    .help("no scale may be 0"),
            })?;
            if let Some(last) = last_pose {
                if last.mirrors() != pose.mirrors() {
                    return Err(child
                        .error("of two keyframes that follow each other one mirrors and the other does not")
                        .help("between them space would be flat; give both the sign of one"));
                }
                if last.is_half_a_turn_from(&pose) {
                    let warning =
                        child.error("half a turn between two keyframes: which way is not said");
                    self.warnings
                        .push(warning.help("add a keyframe between them"));
                }
            }
            last_pose = Some(pose);
            keyframes.push((time, keyframe));
        }
        if keyframes.is_empty() {
            return Err(element.error("<animation> needs at least one <transform time=\"…\">"));
        }
        Ok(keyframes)
    }

    fn operation(&mut self, element: &Element<'_>) -> Result<DMat4> {
        match element.tag {
            "translate" => {
                element.only(&["value", "x", "y", "z"])?;
                Ok(DMat4::from_translation(xyz(element, Some(0.0))?))
            }
            "scale" => {
                element.only(&["value", "x", "y", "z"])?;
                Ok(DMat4::from_scale(xyz(element, Some(1.0))?))
            }
            "rotate" => self.rotate(element),
            "lookat" => look_at(element),
            "lookAt" if !self.strict => look_at(element),
            "matrix" => matrix(element),
            tag => Err(element
                .error(format!("<{tag}> is no transform operation"))
                .suggest(tag, OPERATIONS)),
        }
    }

    fn rotate(&mut self, element: &Element<'_>) -> Result<DMat4> {
        element.only(&["angle", "value", "x", "y", "z"])?;
        let angle = number(element.required("angle")?.trim())
            .map_err(|e| e.at(element.attribute_location("angle")))?;
        let axis = xyz(element, Some(0.0))?;
        let unit = axis
            .try_normalize()
            .ok_or_else(|| element.error("the axis of a rotation must have a length"))?;
        let length = axis.length();
        // A turn by nothing is one in Mitsuba too.
        if (length - 1.0).abs() > UNIT_LENGTH && angle % 360.0 != 0.0 {
            let warning = element.error(format!(
                "the axis has length {:.4}, and is taken at unit length: Mitsuba does not do so, and renders another image",
                length
            ));
            self.warnings
                .push(warning.help("give an axis of unit length"));
        }
        Ok(DMat4::from_axis_angle(unit, angle.to_radians()))
    }
}

fn matrix(element: &Element<'_>) -> Result<DMat4> {
    element.only(&["value"])?;
    let wrong = |message| element.attribute_error("value", message);
    let m = numbers(element.required("value")?)
        .map_err(|e| e.at(element.attribute_location("value")))?;
    if let Ok(m) = <&[f64; 16]>::try_from(m.as_slice()) {
        let m = DMat4::from_cols_array(m).transpose();
        if m.row(3) != DVec4::W {
            return Err(wrong("the last row of a matrix must be 0 0 0 1".to_owned()));
        }
        return Ok(m);
    }
    if let Ok(m) = <&[f64; 9]>::try_from(m.as_slice()) {
        return Ok(DMat4::from_mat3(DMat3::from_cols_array(m).transpose()));
    }
    Err(wrong(format!(
        "a matrix has 9 or 16 numbers, found {}",
        m.len()
    )))
}

/// Where a `<lookat>` looks.
fn target(element: &Element<'_>) -> Result<DVec3> {
    vector(element.required("target")?, false)
        .map_err(|e: Error| e.at(element.attribute_location("target")))
}

fn look_at(element: &Element<'_>) -> Result<DMat4> {
    /// Sine of the angle between `up` and the direction below which the two count as parallel.
    const PARALLEL: f64 = 1e-10;
    element.only(&["origin", "target", "up"])?;
    let point = |name: &str, text: &str| {
        vector(text, false).map_err(|e: Error| e.at(element.attribute_location(name)))
    };
    let origin = point("origin", element.required("origin")?)?;
    let target = target(element)?;
    let direction = (target - origin)
        .try_normalize()
        .ok_or_else(|| element.error("<lookat> looks nowhere: origin and target coincide"))?;
    let up = match element.optional("up") {
        Some(text) => point("up", text)?,
        None => DVec3::ZERO,
    };
    // As in Mitsuba, without an up vector any will do.
    let up = up
        .try_normalize()
        .unwrap_or(direction.any_orthonormal_pair().0);
    let left = up.cross(direction);
    if left.length() < PARALLEL {
        let error = element.error("the up vector of <lookat> is parallel to its direction");
        return Err(error.help("give up another direction, such as 0, 0, 1"));
    }
    let left = left.normalize();
    let up = direction.cross(left);
    Ok(DMat4::from_cols(
        left.extend(0.0),
        up.extend(0.0),
        direction.extend(0.0),
        origin.extend(1.0),
    ))
}

/// Whether the linear part maps space onto a plane, a line or a point, as far as f64 can tell: its determinant against
/// that of an orthogonal one with columns as long.
pub(super) fn is_singular(m: DMat4) -> bool {
    const RATIO: f64 = 1e-14;
    let columns = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.truncate().try_normalize());
    match columns {
        [Some(x), Some(y), Some(z)] => DMat3::from_cols(x, y, z).determinant().abs() < RATIO,
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::description::{Description, Kind, Options};

    fn read(operations: &str, options: &Options) -> Result<DMat4> {
        let text = format!(
            "<scene version='3.0.0'><shape type='a'><transform name='t'>{operations}</transform></shape></scene>"
        );
        let scene = Description::parse(&text, Path::new("test.xml"), options)?;
        let m = scene.root().children(Kind::Shape)[0].given("t")?;
        Ok(m.expect("the shape has it"))
    }

    fn transform_of(operations: &str) -> Result<DMat4> {
        read(operations, &Options::default())
    }

    fn assert_close(m: DMat4, expected: DMat4) {
        assert!(m.abs_diff_eq(expected, 1e-6), "{m} is not {expected}");
    }

    #[test]
    fn operations_apply_in_written_order() {
        let m =
            transform_of("<translate x='1'/><scale value='2'/><rotate z='1' angle='90'/>").unwrap();
        let p = m.transform_point3(DVec3::new(1.0, 0.0, 0.0));
        assert!(p.abs_diff_eq(DVec3::new(0.0, 4.0, 0.0), 1e-12), "{p}");
    }

    #[test]
    fn a_matrix_is_written_row_by_row() {
        let m = transform_of("<matrix value='1 2 0 3, 0 1 0 4, 0 0 1 5, 0 0 0 1'/>").unwrap();
        assert_eq!(m.w_axis.truncate(), DVec3::new(3.0, 4.0, 5.0));
        assert_eq!(m.y_axis.x, 2.0);
        let m = transform_of("<matrix value='1 2 3 0 1 0 0 0 1'/>").unwrap();
        assert_eq!(m.z_axis.x, 3.0);
    }

    #[test]
    fn lookat_agrees_with_mitsuba() {
        let expected = DMat4::from_cols_array(&[
            -0.980581, -0.0716115, -0.182574, 1.0, //
            0.0, 0.930949, -0.365148, 2.0, //
            0.196116, -0.358057, -0.912871, 5.0, //
            0.0, 0.0, 0.0, 1.0,
        ])
        .transpose();
        for tag in ["lookat", "lookAt"] {
            let text = format!("<{tag} origin='1,2,5' target='0 0 0' up='0,1,0'/>");
            assert_close(transform_of(&text).unwrap(), expected);
        }
        let strict = Options {
            strict: true,
            ..Options::default()
        };
        assert!(
            read(
                "<lookAt origin='1,2,5' target='0 0 0' up='0,1,0'/>",
                &strict
            )
            .is_err()
        );
    }

    #[test]
    fn without_an_up_vector_lookat_still_makes_a_rotation() {
        let m = transform_of("<lookat origin='0 0 0' target='1 2 3'/>").unwrap();
        assert!((m.determinant() - 1.0).abs() < 1e-12);
        assert!(
            m.z_axis
                .truncate()
                .abs_diff_eq(DVec3::new(1.0, 2.0, 3.0).normalize(), 1e-12)
        );
    }

    #[test]
    fn very_flat_and_very_small_transforms_are_not_singular() {
        for operations in [
            "<scale value='1e-9'/>",
            "<rotate value='1 2 3' angle='40'/><scale z='1e-6'/>",
            "<scale x='1e-12'/><translate value='1e6'/>",
        ] {
            assert!(
                !is_singular(transform_of(operations).unwrap()),
                "{operations}"
            );
        }
        for operations in ["<scale z='0'/>", "<matrix value='1 2 3 2 4 6 0 0 1'/>"] {
            assert!(
                is_singular(transform_of(operations).unwrap()),
                "{operations}"
            );
        }
        assert!(transform_of("<scale value='1e200'/><scale value='1e200'/>").is_err());
    }
}

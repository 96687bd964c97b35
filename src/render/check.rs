//! Everything that is wrong with a scene, found without rendering: meshes and images are loaded, all
//! sensors, materials and lights are built, and no tree.

use super::options::Options;
use super::progress::Progress;
use super::session::{Task, start};
use super::{plugins, prepare};
use crate::accel::Method;
use crate::color::ColorModel;
use crate::description::{Description, Kind};
use crate::error::{Problem, Problems, Result};
use crate::scene;

/// Finds everything that is wrong with a scene; what is merely worth knowing is returned.
///
/// # Errors
/// All that would stop a render through any of the scene's sensors.
pub fn check(
    description: &Description,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Vec<Problem>> {
    let task = Check {
        description,
        options,
        progress,
    };
    start(options.threads, false)?.install(|| task.run_in(options.colors))
}

struct Check<'a> {
    description: &'a Description,
    options: &'a Options,
    progress: &'a dyn Progress,
}

impl Task for Check<'_> {
    type Output = Vec<Problem>;

    fn run<C: ColorModel>(self, color: C) -> Result<Vec<Problem>> {
        let description = self.description;
        let mut problems = Problems::default();
        problems.take(prepare::sensor(description, self.options));
        let mut warnings = description.warnings().to_vec();
        for sensor in description.root().children(Kind::Sensor) {
            let view = problems.take(prepare::view::<C>(description, sensor.node_id()));
            warnings.extend(view.into_iter().flat_map(|view| view.warnings));
        }
        let limit = self.options.memory_limit;
        match problems.take(prepare::load(description, None, None, limit, self.progress)) {
            Some(assets) => {
                warnings.extend_from_slice(assets.warnings());
                let scene = scene::build(description, &assets, color, Method::Brute);
                if let Some(scene) = problems.take(scene) {
                    warnings.extend_from_slice(scene.warnings());
                }
            }
            None => {
                problems.take(scene::check_materials(description, color));
            }
        }
        let findings = plugins::examine(description);
        problems.extend(findings.problems);
        warnings.extend(findings.notes);
        problems.finish()?;
        Ok(warnings)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::description;
    use crate::render::Silent;

    fn check_text(text: &str) -> Vec<String> {
        let text = format!("<scene version='3.0.0'>{text}</scene>");
        let scene = Description::parse(
            &text,
            Path::new("test.xml"),
            &description::Options::default(),
        )
        .unwrap();
        match check(&scene, &Options::default(), &Silent) {
            Ok(_) => Vec::new(),
            Err(error) => error.problems().iter().map(|p| p.message.clone()).collect(),
        }
    }

    #[test]
    fn everything_that_is_wrong_is_found_at_once() {
        let found = check_text(
            "<sensor type='perspective'><sampler type='stratyfied'/><film type='hdrfilm'/></sensor>
             <sensor type='perspektive'><sampler type='independent'/></sensor>
             <integrator type='pat'/>
             <shape type='ply'><string name='filename' value='missing.ply'/><bsdf type='difuse'/></shape>
             <shape type='sphere'><bsdf type='twosidet'/></shape>",
        );
        for part in [
            "stratyfied",
            "perspektive",
            "\"pat\"",
            "missing.ply",
            "difuse",
            "twosidet",
        ] {
            assert!(found.iter().any(|m| m.contains(part)), "{part}: {found:?}");
        }
        assert_eq!(found.len(), 6, "{found:?}");
    }

    #[test]
    fn what_a_second_sensor_does_not_read_is_found_and_a_good_scene_has_nothing() {
        let good = "<sensor type='perspective'><sampler type='independent'/></sensor><shape type='sphere'/>";
        assert_eq!(check_text(good), [""; 0]);
        let odd = "<sensor type='perspective'><float name='fow' value='3'/><sampler type='independent'/></sensor>";
        let found = check_text(&format!("{good}{odd}"));
        assert_eq!(found, ["sensor \"perspective\" has no property \"fow\""]);
    }
}

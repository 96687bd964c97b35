//! Everything that is wrong with a scene, found on the way that a render goes, up to where the tree would be built.

use super::options::Options;
use super::prepare::Ask;
use super::progress::Progress;
use super::session::{Measure, Session, Task};
use crate::description::Description;
use crate::error::{Problem, Result};

impl Session {
    /// Finds everything that is wrong with a scene, as [`Session::render`] would say it, without rendering: meshes
    /// and images are loaded, sensors, materials and lights are built, and no tree. What is merely worth knowing is
    /// returned.
    ///
    /// # Errors
    /// As [`Session::render`].
    pub fn check(
        &mut self,
        description: &Description,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<Vec<Problem>> {
        let facts = self.run(options, |shelf| {
            let ask = Ask {
                shelf,
                description,
                options,
                progress,
                traced: false,
            };
            Measure(ask).run_in(description, options)
        })?;
        Ok(facts.warnings)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::description;
    use crate::render::Silent;

    fn messages(problems: &[Problem]) -> Vec<String> {
        problems.iter().map(|p| p.message.clone()).collect()
    }

    fn check_text(text: &str) -> Vec<String> {
        let text = format!("<scene version='3.0.0'>{text}</scene>");
        let scene = Description::parse(
            &text,
            Path::new("test.xml"),
            &description::Options::default(),
        )
        .unwrap();
        match Session::default().check(&scene, &Options::default(), &Silent) {
            Ok(_) => Vec::new(),
            Err(error) => messages(error.problems()),
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

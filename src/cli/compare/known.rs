//! One image against a reference of known variance.

use std::path::Path;

use etendue::compare::Layer;
use etendue::compare::ztest::{self, Reference};
use etendue::error::{Error, Result};

use super::{Arguments, Difference, Outcome, T_TOP};

pub(super) fn against_reference(
    arguments: &Arguments,
    path: &Path,
    reference_path: &Path,
) -> Result<Outcome> {
    let (Some(variance), Some(spp)) = (&arguments.variance, arguments.spp) else {
        return Err(Error::input("a reference needs --variance and --spp"));
    };
    let selection = arguments.selection();
    let budget = arguments.memory.budget();
    let layer = Layer::read(path, &selection, &budget)?;
    let mean = Layer::read(reference_path, &selection, &budget)?;
    let variance = Layer::read(variance, &selection, &budget)?;
    let reference = Reference {
        mean: &mean,
        variance: &variance,
        spp: arguments.reference_spp,
    };
    let outcome = ztest::ztest(&layer, spp, &reference)?;
    let figures = format!(
        "accepted {:.5}, gain {:+.5} ± {:.5}, z rms {:.3}, greatest {:.2} (bound {:.2})",
        outcome.accepted,
        outcome.gain,
        outcome.gain_error,
        outcome.z_rms,
        outcome.z_max,
        outcome.z_bound
    );
    Ok(Outcome {
        agrees: outcome.passed,
        sentence: outcome.sentence(),
        lines: vec![format!("  {figures}")],
        rows: vec![("z-test".to_owned(), figures)],
        object: serde_json::to_value(&outcome).expect("it has only names and numbers"),
        difference: arguments.shows().then(|| Difference {
            encoding: mean.encoding,
            rgb: mean.rgb,
            images: [mean.image, layer.image],
            sides: [("reference", reference_path), ("image", path)]
                .map(|(side, path)| (side, path.display().to_string())),
            distance: outcome.map,
            label: "|z|",
            top: T_TOP,
        }),
    })
}

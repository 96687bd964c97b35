//! Scenes seen by rays and by the z-buffer, held against each other.

use super::options::Options;
use super::prepare::{self, Ask};
use super::progress::Progress;
use super::session::{Session, Task};
use crate::color::{ColorModel, Rgb};
use crate::description::Description;
use crate::error::Result;
use crate::raster::{self, Agreement};

/// Compares what both see.
struct Hold<'a>(Ask<'a>);

impl Task for Hold<'_> {
    type Output = Agreement;

    fn run<C: ColorModel>(mut self, color: C) -> Result<Agreement> {
        let job = prepare::prepare(&mut self.0, color)?;
        let mut agreement = raster::agreement(job.scene, &job.view.sensor, &job.view.film)?;
        agreement.notes.splice(0..0, job.warnings.iter().cloned());
        Ok(agreement)
    }
}

impl Session {
    /// What the z-buffer sees at pixel centres, against what rays see there.
    ///
    /// # Errors
    /// As [`Session::render`], and where the sensor's picture cannot be drawn.
    pub fn agreement(
        &mut self,
        description: &Description,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<Agreement> {
        self.run(options, |shelf| {
            let ask = Ask::traced(shelf, description, options, progress);
            // Surfaces have no colour.
            Hold(ask).run(Rgb)
        })
    }
}

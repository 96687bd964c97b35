//! Which colours a render has: what its options ask for, and what its film needs.

use std::sync::Arc;

use super::options::{Colors, Options};
use super::prepare::sensor;
use crate::color::{Comb, MAX_BANDS, Response, VISIBLE};
use crate::description::{Description, Kind};
use crate::error::{Error, Result};
use crate::sensor::Film;

/// The colour model of a render.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Model {
    /// Linear BT.709.
    Rgb,
    /// Bands, and what a `specfilm` makes of them.
    Bands(Comb, Arc<[Response]>),
}

/// How many bands a film of responses takes where nobody says it, unless it has more channels.
const BANDS_OF_RESPONSES: usize = 16;

impl Model {
    /// What the options and the film that is looked at ask for.
    ///
    /// # Errors
    /// Where there are no such bands.
    pub(super) fn of(description: &Description, options: &Options) -> Result<Self> {
        let responses = responses(description, options);
        let (count, range) = match options.colors {
            Colors::Rgb if responses.is_empty() => return Ok(Self::Rgb),
            Colors::Rgb => (responses.len().clamp(BANDS_OF_RESPONSES, MAX_BANDS), None),
            Colors::Bands { count, range } => (count, range),
        };
        let range = range.unwrap_or_else(|| match responses.is_empty() {
            true => VISIBLE,
            false => Response::range(&responses),
        });
        let comb = Comb::new(count, range).ok_or_else(|| {
            let [first, last] = range;
            Error::input(format!(
                "{count} bands from {first} to {last} nm; 1 to {MAX_BANDS} over a range that rises are possible"
            ))
        })?;
        Ok(Self::Bands(comb, responses))
    }
}

/// The channels of a `specfilm`; what is wrong with the film is told when the render is prepared.
fn responses(description: &Description, options: &Options) -> Arc<[Response]> {
    let film = || {
        let sensor = description.node(sensor(description, options).ok()?);
        Film::build(&sensor.child(Kind::Film).ok()??).ok()
    };
    film().map(|film| film.responses).unwrap_or_default()
}

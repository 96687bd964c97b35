//! Where the sun is seen, by time and place: Blanco-Muriel, Alarcón-Padilla, López-Moratalla and Lara-Coira, *Computing
//! the solar vector* (2001), good for half a minute of arc between 1999 and 2015 and for less than a minute for decades
//! around. All in double precision: days since noon of 1 January 2000 in single precision are right to some hours.

use glam::DVec3;

use crate::description::Properties;
use crate::description::declared::{Row, float};
use crate::error::Result;

/// A place on earth, with its clocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Degrees north.
    latitude: f64,
    /// Degrees east.
    longitude: f64,
    /// Hours that clocks are ahead of universal time.
    timezone: f64,
}

/// What a place reads.
pub(super) const PLACE: &[Row] = &[
    float("latitude", 35.6894, "degrees north"),
    float("longitude", 139.6917, "degrees east"),
    float(
        "timezone",
        9.0,
        "hours that clocks are ahead of universal time",
    ),
];

impl Place {
    pub(super) fn build(properties: &Properties<'_>) -> Result<Self> {
        Ok(Self {
            latitude: properties.float("latitude")?,
            longitude: properties.float("longitude")?,
            timezone: properties.float("timezone")?,
        })
    }
}

/// A day of the Gregorian calendar.
#[derive(Clone, Copy, Debug)]
pub(super) struct Date {
    pub(super) year: i64,
    /// From 1 to 12.
    pub(super) month: i64,
    /// From 1; what is beyond the month's last is in the next.
    pub(super) day: i64,
}

/// The years that are possible.
pub(super) const YEARS: std::ops::RangeInclusive<f64> = -4000.0..=100_000.0;

impl Date {
    /// Days from noon of 1 January 2000 to the day's beginning, both in universal time.
    pub(super) fn days(&self) -> f64 {
        let Self { year, month, day } = self;
        // Divisions toward zero (Fliegel and Van Flandern, 1968).
        let early = (month - 14) / 12;
        let julian = (1461 * (year + 4800 + early)) / 4 + (367 * (month - 2 - 12 * early)) / 12
            - (3 * ((year + 4900 + early) / 100)) / 4
            + day
            - 32075;
        julian as f64 - 0.5 - 2_451_545.0
    }
}

/// The direction toward the sun at an hour of the day by the clocks there, unit length: as in Mitsuba z is up,
/// the south is +x and the east −y.
pub(super) fn sun(date: &Date, hour: f64, place: &Place) -> DVec3 {
    const RADII_PER_UNIT: f64 = 6371.01 / 149_597_890.0;
    let universal = hour - place.timezone;
    let days = date.days() + universal / 24.0;
    let omega = 2.1429 - 0.001_039_459_4 * days;
    let mean_longitude = 4.895_063_0 + 0.017_202_791_698 * days;
    let anomaly = 6.240_060_0 + 0.017_201_969_9 * days;
    let longitude =
        mean_longitude + 0.033_416_07 * anomaly.sin() + 0.000_348_94 * (2.0 * anomaly).sin()
            - 0.000_113_4
            - 0.000_020_3 * omega.sin();
    let obliquity = 0.409_092_8 - 6.2140e-9 * days + 0.000_039_6 * omega.cos();
    let ascension = (obliquity.cos() * longitude.sin()).atan2(longitude.cos());
    let declination = (obliquity.sin() * longitude.sin()).asin();
    let greenwich = 6.697_424_324_2 + 0.065_709_828_3 * days + universal;
    let hour_angle = (greenwich * 15.0 + place.longitude).to_radians() - ascension;
    let (sin, cos) = place.latitude.to_radians().sin_cos();
    let zenith =
        (cos * hour_angle.cos() * declination.cos() + declination.sin() * sin).clamp(-1.0, 1.0);
    let zenith = zenith.acos();
    let azimuth = (-hour_angle.sin()).atan2(declination.tan() * cos - sin * hour_angle.cos());
    let zenith = zenith + RADII_PER_UNIT * zenith.sin();
    let (height, across) = (zenith.cos(), zenith.sin());
    // Half a turn.
    DVec3::new(-across * azimuth.cos(), -across * azimuth.sin(), height)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_stands_where_almanacs_say() {
        let greenwich = Place {
            latitude: 51.48,
            longitude: 0.0,
            timezone: 0.0,
        };
        let date = |year, month, day| Date { year, month, day };
        let elevation =
            |date: &Date, hour, place: &Place| sun(date, hour, place).z.asin().to_degrees();
        // At the solstices the declination is the ecliptic's obliquity, at the equinox 0.
        let noon = elevation(&date(2012, 6, 20), 12.03, &greenwich);
        assert!((noon - (90.0 - 51.48 + 23.44)).abs() < 0.02, "{noon}");
        let noon = elevation(&date(2012, 12, 21), 11.97, &greenwich);
        assert!((noon - (90.0 - 51.48 - 23.44)).abs() < 0.02, "{noon}");
        // The equinox of 20 March 2012 was at 5:14.
        let equator = Place {
            latitude: 0.0,
            longitude: 0.0,
            timezone: 0.0,
        };
        let toward = sun(&date(2012, 3, 20), 5.2333, &equator);
        assert!(toward.x.abs() < 1e-3, "{toward}");
        // Clocks and longitude go together.
        let east = Place {
            longitude: 30.0,
            timezone: 2.0,
            ..greenwich
        };
        let [a, b] = [
            sun(&date(2020, 5, 6), 9.0, &greenwich),
            sun(&date(2020, 5, 6), 9.0, &east),
        ];
        assert!(a.distance(b) < 1e-3, "{a} {b}");
        // In the morning the sun is in the east.
        let morning = sun(&date(2012, 6, 20), 7.0, &greenwich);
        let evening = sun(&date(2012, 6, 20), 17.0, &greenwich);
        assert!(morning.y < 0.0 && evening.y > 0.0, "{morning} {evening}");
    }

    #[test]
    fn days_are_counted_over_months_years_and_leap_days() {
        let days = |year, month, day| Date { year, month, day }.days();
        assert_eq!(days(2000, 1, 1), -0.5);
        assert_eq!(days(2000, 3, 1) - days(2000, 2, 28), 2.0);
        assert_eq!(days(1900, 3, 1) - days(1900, 2, 28), 1.0);
        assert_eq!(days(2025, 1, 1) - days(2024, 1, 1), 366.0);
        assert_eq!(days(2024, 1, 32), days(2024, 2, 1));
    }
}

//! A display in a lit room. What reaches the eye is L = L_display + E ρ / π: the room's illuminance E, reflected diffusely by
//! a part ρ (Mantiuk, Daly and Kerofsky, *Display adaptive tone mapping*, 2008, section 4.1). Of a see-through display ρ is
//! the part that it lets through, times the reflectance of what lies behind. The eye takes the display's white, with that
//! light, for white: with a = E ρ / (π L_white) the value v is seen as (v + a) / (1 + a), and black as a / (1 + a).

use std::f64::consts::PI;

use super::WHITE_NITS;

/// What to do about the light of the room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AmbientMode {
    /// Show less, so that with that light the picture is seen as it was meant, but where it is darker than the light
    /// itself: (1 + a) v − a, and never below 0.
    #[default]
    Compensate,
    /// Show what is seen in that light: (v + a) / (1 + a).
    Simulate,
}

/// The light of a room on a display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ambient {
    /// Illuminance on the display, in lux; not negative.
    pub illuminance: f32,
    /// How much of it the display sends to the eye, diffusely; from 0 to 1.
    pub reflectance: f32,
    /// The luminance of the display's white in the dark, in cd/m²; positive.
    pub white: f32,
    /// What to do about it.
    pub mode: AmbientMode,
}

impl Default for Ambient {
    fn default() -> Self {
        Self {
            illuminance: 0.0,
            reflectance: 0.01,
            white: WHITE_NITS,
            mode: AmbientMode::default(),
        }
    }
}

impl Ambient {
    /// The luminance of a black display, in parts of its white in the dark.
    pub fn veil(&self) -> f32 {
        let luminance = f64::from(self.illuminance) * f64::from(self.reflectance) / PI;
        (luminance / f64::from(self.white)) as f32
    }

    /// Light of the display's primaries, of which 1 is white, in place of `shown`.
    pub(super) fn view(&self, shown: [f32; 3]) -> [f32; 3] {
        let veil = self.veil();
        shown.map(|v| match self.mode {
            AmbientMode::Compensate => ((1.0 + veil) * v - veil).max(0.0),
            AmbientMode::Simulate => (v.max(0.0) + veil) / (1.0 + veil),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_black_display_has_the_luminance_of_what_it_reflects() {
        let ambient = Ambient {
            illuminance: 1000.0,
            reflectance: 0.05,
            white: 100.0,
            mode: AmbientMode::Simulate,
        };
        // 1000 lux · 0.05 / π = 15.915 cd/m², beside 115.915 of white.
        assert!((ambient.veil() - 0.159_155).abs() < 1e-6);
        let seen = ambient.view([0.0, 0.5, 1.0]);
        for (seen, nits) in seen.into_iter().zip([15.9155, 65.9155, 115.9155]) {
            assert!((seen - nits / 115.9155).abs() < 1e-6, "{seen}");
        }
        let dark = Ambient::default();
        assert_eq!(dark.view([0.0, 0.25, 3.0]), [0.0, 0.25, 3.0]);
    }

    #[test]
    fn what_is_compensated_is_seen_as_it_was_meant_down_to_the_light_itself() {
        let compensate = Ambient {
            illuminance: 500.0,
            reflectance: 0.3,
            ..Ambient::default()
        };
        let simulate = Ambient {
            mode: AmbientMode::Simulate,
            ..compensate
        };
        let black = simulate.view([0.0; 3])[0];
        assert!((black - 0.190_41).abs() < 1e-5, "{black}");
        for step in 0..=20 {
            let meant = step as f32 / 20.0;
            let seen = simulate.view(compensate.view([meant; 3]))[0];
            assert!((seen - meant.max(black)).abs() < 1e-6, "{meant}: {seen}");
        }
        assert_eq!(compensate.view([f32::NAN, -1.0, 0.0]), [0.0; 3]);
    }
}

//! Which renders a profile makes: along each axis of the cost model T = O(P·O·L·N/3), by brute force and by tree,
//! one quantity grows while all others stay.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::fit::Model;
use super::quantity::Quantity;
use crate::accel::Method;

/// What grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// P
    Pixels,
    /// O
    Objects,
    /// L
    Lights,
    /// N
    Bands,
    /// Samples a pixel.
    Samples,
    /// The longest path.
    Depth,
    /// Processors at work.
    Threads,
}

impl Axis {
    /// In the order of the report.
    pub const ALL: [Self; 7] = [
        Self::Pixels,
        Self::Objects,
        Self::Lights,
        Self::Bands,
        Self::Samples,
        Self::Depth,
        Self::Threads,
    ];

    /// As on the command line and on plots.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pixels => "P",
            Self::Objects => "O",
            Self::Lights => "L",
            Self::Bands => "N",
            Self::Samples => "samples",
            Self::Depth => "depth",
            Self::Threads => "threads",
        }
    }

    /// What stands along it.
    pub fn label(self) -> &'static str {
        match self {
            Self::Pixels => "pixels P",
            Self::Objects => "triangles O",
            Self::Lights => "lights L",
            Self::Bands => "bands N (3 is RGB)",
            Self::Samples => "samples a pixel",
            Self::Depth => "longest path",
            Self::Threads => "threads",
        }
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Axis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let named = |axis: &Self| axis.name().eq_ignore_ascii_case(text);
        Self::ALL.into_iter().find(named).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("there is no axis {text:?}; there are {names}")
        })
    }
}

/// How much a profile takes on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Effort {
    /// The least that can be fitted: for tests.
    Tiny,
    /// Under fifteen seconds.
    Quick,
    /// Under two minutes.
    #[default]
    Usual,
    /// Up to ten million triangles.
    Full,
}

impl Effort {
    /// The most triangles.
    pub(super) fn largest(self) -> u32 {
        match self {
            Self::Tiny => 4_096,
            Self::Quick => 256 << 10,
            Self::Usual => 1 << 20,
            Self::Full => 10_000_000,
        }
    }

    fn pick<T>(self, quick: T, usual: T) -> T {
        match self {
            Self::Tiny | Self::Quick => quick,
            Self::Usual | Self::Full => usual,
        }
    }
}

/// How light is gathered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Look {
    /// A shadow ray to every light: the textbook's loop.
    AllLights,
    /// A shadow ray to one of the lights.
    OneLight,
    /// The same within walls that no path leaves.
    Room,
    /// As the scene has it.
    Own,
}

impl Look {
    /// The integrator that does so.
    pub(super) fn integrator(self) -> Option<&'static str> {
        match self {
            Self::AllLights => Some("phong"),
            Self::OneLight | Self::Room => Some("path"),
            Self::Own => None,
        }
    }
}

/// One render.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Setting {
    /// About so many; the scene's own where the subject is a scene.
    pub(super) triangles: u32,
    pub(super) size: [u32; 2],
    pub(super) spp: u32,
    /// The scene's own where absent.
    pub(super) depth: Option<u32>,
    /// Lights; where the subject is a scene, beside its own.
    pub(super) lights: u32,
    /// RGB where absent.
    pub(super) bands: Option<usize>,
    pub(super) threads: usize,
    pub(super) method: Method,
    pub(super) look: Look,
}

/// Renders along one axis.
#[derive(Clone, Debug)]
pub(super) struct Sweep {
    pub(super) axis: Axis,
    /// Tells it from others along the axis.
    pub(super) way: Way,
    pub(super) settings: Vec<Setting>,
    /// Whether the scene is loaded and built anew each time.
    pub(super) fresh: bool,
    /// What is fitted how, in the order of the report.
    pub(super) fitted: Vec<(Quantity, Model)>,
    /// The x from which on it is fitted.
    pub(super) from: f64,
}

/// In which way a sweep is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// Every ray is held against everything, without an early end.
    Brute,
    /// By tree.
    Tree,
    /// By tree, with a shadow ray to one light chosen at random in place of all.
    One,
}

impl Way {
    /// As in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Brute => "brute force",
            Self::Tree => "tree",
            Self::One => "tree, one light",
        }
    }
}

/// What a profile may take.
#[derive(Clone, Debug)]
pub(super) struct Extent {
    pub(super) axes: Vec<Axis>,
    pub(super) effort: Effort,
    pub(super) threads: usize,
    /// The subject's triangles where it is a mesh.
    pub(super) own: Option<u32>,
    /// The most triangles that fit into memory.
    pub(super) most: u32,
}

use Model::{Line, Logarithm, Power};
use Quantity as Q;

impl Extent {
    /// Triangles for the tree to stand on while others grow.
    fn crowd(&self) -> u32 {
        let wanted = match self.effort {
            Effort::Tiny => 500,
            Effort::Quick => 20_000,
            Effort::Usual | Effort::Full => 100_000,
        };
        wanted.min(self.most).min(self.own.unwrap_or(u32::MAX))
    }

    /// Squares whose areas double from one to the next.
    fn squares(&self, first: f64) -> impl Iterator<Item = [u32; 2]> {
        let count = self.effort.pick(5, 6);
        let first = if self.effort == Effort::Tiny {
            8.0
        } else {
            first
        };
        (0..count).map(move |i| [(first * 2.0_f64.powf(f64::from(i) / 2.0)).round() as u32; 2])
    }

    fn square(&self, side: u32) -> [u32; 2] {
        [if self.effort == Effort::Tiny {
            12
        } else {
            side
        }; 2]
    }

    /// The sizes of the tree.
    fn sizes(&self) -> Vec<u32> {
        let largest = self.effort.largest().min(self.most);
        let mut sizes: Vec<u32> = match self.own {
            None => (0..12).map(|i| 1024 << (2 * i).min(20)).collect(),
            // Parts of the mesh, all of it, and cut in four as often as it goes.
            Some(own) => (-10..12)
                .map(|i: i32| f64::from(own) * 4_f64.powi(i))
                .filter(|n| *n < f64::from(u32::MAX))
                .map(|n| n as u32)
                .collect(),
        };
        if self.effort == Effort::Full && self.own.is_none() {
            sizes.push(10_000_000);
        }
        sizes.retain(|n| (500..=largest).contains(n));
        if self.effort == Effort::Tiny {
            sizes.extend([600, 2_000]);
        }
        sizes.sort_unstable();
        sizes.dedup();
        sizes
    }

    /// Sizes so small that brute force may be as fast.
    fn small(&self) -> Vec<u32> {
        let most = self.own.unwrap_or(u32::MAX);
        [2, 8, 32].into_iter().filter(|n| *n <= most).collect()
    }

    /// Sizes for brute force to be fitted over.
    fn exhaustible(&self) -> Vec<u32> {
        let most = self.own.unwrap_or(u32::MAX);
        let last = match self.effort {
            Effort::Tiny => 9,
            Effort::Quick => 11,
            Effort::Usual | Effort::Full => 13,
        };
        (7..=last).map(|i| 1 << i).filter(|n| *n <= most).collect()
    }

    fn base(&self) -> Setting {
        Setting {
            triangles: self.crowd(),
            size: self.square(self.effort.pick(128, 256)),
            spp: 1,
            depth: Some(2),
            lights: 1,
            bands: None,
            threads: 1,
            method: Method::Tree,
            look: Look::AllLights,
        }
    }

    fn brute(&self) -> Setting {
        let most = self.own.unwrap_or(u32::MAX);
        Setting {
            triangles: self.effort.pick(256, 512).min(most),
            size: self.square(64),
            method: Method::Exhaustive,
            ..self.base()
        }
    }

    /// All sweeps over a subject whose triangles can be chosen.
    pub(super) fn sweeps(&self) -> Vec<Sweep> {
        let (base, brute) = (self.base(), self.brute());
        let mut all = Vec::new();
        let side = self.effort.pick(64.0, 128.0);
        let mut add = |axis, way, settings: Vec<Setting>, fitted: &[(Q, Model)], from| {
            all.push(Sweep {
                axis,
                way,
                settings,
                fresh: matches!(axis, Axis::Objects | Axis::Threads) && way == Way::Tree,
                fitted: fitted.to_vec(),
                from,
            });
        };
        let sized = |of: &Setting, size| Setting { size, ..of.clone() };
        add(
            Axis::Pixels,
            Way::Brute,
            self.squares(self.effort.pick(32.0, 48.0))
                .map(|s| sized(&brute, s))
                .collect(),
            &[(Q::FirstTests, Power), (Q::Render, Power)],
            0.0,
        );
        add(
            Axis::Pixels,
            Way::Tree,
            self.squares(side).map(|s| sized(&base, s)).collect(),
            &[(Q::NodeSteps, Power), (Q::Render, Power)],
            0.0,
        );
        let of = |of: &Setting, triangles| Setting {
            triangles,
            ..of.clone()
        };
        add(
            Axis::Objects,
            Way::Brute,
            self.small()
                .into_iter()
                .chain(self.exhaustible())
                .map(|n| of(&brute, n))
                .collect(),
            &[(Q::FirstTests, Power), (Q::TracePerRay, Power)],
            128.0,
        );
        let mut sizes = self.small();
        sizes.extend(self.exhaustible());
        sizes.retain(|n| *n < 1000);
        sizes.extend(self.sizes());
        add(
            Axis::Objects,
            Way::Tree,
            sizes.into_iter().map(|n| of(&base, n)).collect(),
            &[
                (Q::StepsPerRay, Logarithm),
                (Q::StepsPerRay, Power),
                (Q::TracePerRay, Logarithm),
                (Q::TracePerRay, Power),
                (Q::Build, Power),
                (Q::Load, Power),
            ],
            if self.effort == Effort::Tiny {
                500.0
            } else {
                900.0
            },
        );
        let last = self.effort.pick(5, 6);
        let lit = |of: &Setting, look| {
            let lights = move |lights| Setting {
                lights,
                look,
                ..of.clone()
            };
            (0..=last).map(|i| 1 << i).map(lights).collect::<Vec<_>>()
        };
        let few = Setting {
            triangles: brute.triangles / 2,
            size: self.square(self.effort.pick(48, 64)),
            ..brute.clone()
        };
        let seen = Setting {
            size: self.square(128),
            ..base.clone()
        };
        let lights = [(Q::ShadowRays, Power), (Q::Shadows, Power)];
        add(
            Axis::Lights,
            Way::Brute,
            lit(&few, Look::AllLights),
            &[(Q::ShadowTests, Power), (Q::Shadows, Power)],
            0.0,
        );
        add(
            Axis::Lights,
            Way::Tree,
            lit(&seen, Look::AllLights),
            &lights,
            0.0,
        );
        add(
            Axis::Lights,
            Way::One,
            lit(&seen, Look::OneLight),
            &lights,
            0.0,
        );
        let room = Setting {
            look: Look::Room,
            depth: Some(6),
            size: self.square(self.effort.pick(96, 128)),
            ..seen.clone()
        };
        self.others(&room, &mut add);
        all.retain(|sweep| self.axes.contains(&sweep.axis));
        all
    }

    /// All sweeps over a scene as it is.
    pub(super) fn sweeps_of_scene(&self) -> Vec<Sweep> {
        let own = Setting {
            lights: 0,
            depth: None,
            spp: 4,
            look: Look::Own,
            ..self.base()
        };
        let mut all = Vec::new();
        let mut add = |axis, way, settings: Vec<Setting>, fitted: &[(Q, Model)], from| {
            all.push(Sweep {
                axis,
                way,
                settings,
                fresh: axis == Axis::Threads,
                fitted: fitted.to_vec(),
                from,
            });
        };
        let side = self.effort.pick(64.0, 96.0);
        add(
            Axis::Pixels,
            Way::Tree,
            self.squares(side)
                .map(|size| Setting {
                    size,
                    ..own.clone()
                })
                .collect(),
            &[(Q::NodeSteps, Power), (Q::Render, Power)],
            0.0,
        );
        let last = self.effort.pick(5, 6);
        for (way, look) in [(Way::Tree, Look::AllLights), (Way::One, Look::OneLight)] {
            let lit = |i: u32| Setting {
                lights: 1 << i,
                look,
                depth: Some(2),
                size: self.square(128),
                spp: 1,
                ..own.clone()
            };
            add(
                Axis::Lights,
                way,
                (0..=last).map(lit).collect(),
                &[(Q::ShadowRays, Power), (Q::Shadows, Power)],
                0.0,
            );
        }
        let small = Setting {
            size: self.square(64),
            spp: 4,
            ..own.clone()
        };
        self.others(&small, &mut add);
        all.retain(|sweep| self.axes.contains(&sweep.axis));
        all
    }

    /// The axes on which nothing but the render's own numbers grow.
    fn others(
        &self,
        base: &Setting,
        add: &mut impl FnMut(Axis, Way, Vec<Setting>, &[(Q, Model)], f64),
    ) {
        let bands = [None, Some(8), Some(16), Some(32)];
        let colored = bands.map(|bands| Setting {
            bands,
            ..base.clone()
        });
        let growth = [(Q::Render, Power), (Q::Render, Line), (Q::Shade, Power)];
        add(Axis::Bands, Way::Tree, colored.to_vec(), &growth, 0.0);
        let spp = |i: u32| Setting {
            spp: 1 << i,
            size: self.square(self.effort.pick(48, 64)),
            ..base.clone()
        };
        let rays = [(Q::Rays, Power), (Q::Render, Power)];
        add(
            Axis::Samples,
            Way::Tree,
            (0..self.effort.pick(5, 6)).map(spp).collect(),
            &rays,
            0.0,
        );
        let deep = |i: u32| Setting {
            depth: Some(1 << i),
            ..base.clone()
        };
        let deeper = (1..=self.effort.pick(4, 5)).map(deep).collect();
        add(
            Axis::Depth,
            Way::Tree,
            deeper,
            &[(Q::Rays, Line), (Q::Render, Line)],
            0.0,
        );
        let mut counts: Vec<usize> = (0..16).map(|i| 1 << i).collect();
        counts.retain(|n| *n < self.threads);
        counts.push(self.threads);
        let at_work = |threads| Setting {
            threads,
            spp: self.effort.pick(4, 16) * base.spp,
            triangles: base
                .triangles
                .saturating_mul(self.effort.pick(4, 5))
                .min(self.most),
            ..base.clone()
        };
        add(
            Axis::Threads,
            Way::Tree,
            counts.into_iter().map(at_work).collect(),
            &[],
            0.0,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn extent(effort: Effort) -> Extent {
        Extent {
            axes: Axis::ALL.to_vec(),
            effort,
            threads: 2,
            own: None,
            most: u32::MAX,
        }
    }

    #[test]
    fn axes_are_found_by_their_names() {
        for axis in Axis::ALL {
            assert_eq!(axis.name().parse(), Ok(axis));
            assert_eq!(axis.name().to_lowercase().parse(), Ok(axis));
        }
        assert!("Q".parse::<Axis>().unwrap_err().contains("samples"));
    }

    #[test]
    fn along_an_axis_nothing_else_changes() {
        for effort in [Effort::Tiny, Effort::Quick, Effort::Usual, Effort::Full] {
            for sweep in extent(effort).sweeps() {
                let first = &sweep.settings[0];
                for setting in &sweep.settings[1..] {
                    let mut same = setting.clone();
                    match sweep.axis {
                        Axis::Pixels => same.size = first.size,
                        Axis::Objects => same.triangles = first.triangles,
                        Axis::Lights => same.lights = first.lights,
                        Axis::Bands => same.bands = first.bands,
                        Axis::Samples => same.spp = first.spp,
                        Axis::Depth => same.depth = first.depth,
                        Axis::Threads => same.threads = first.threads,
                    }
                    assert_eq!(&same, first, "{:?}", sweep.axis);
                    assert_ne!(setting, first, "{:?}", sweep.axis);
                }
            }
        }
    }

    #[test]
    fn the_full_profile_goes_from_a_thousand_to_ten_million_triangles() {
        let sizes = extent(Effort::Full).sizes();
        assert_eq!((sizes[0], sizes[sizes.len() - 1]), (1024, 10_000_000));
        assert!(sizes.windows(2).all(|w| w[1] > 2 * w[0]), "{sizes:?}");
    }

    #[test]
    fn a_mesh_is_taken_in_parts_whole_and_cut_in_four() {
        let own = Extent {
            own: Some(50_000),
            ..extent(Effort::Usual)
        };
        let sizes = own.sizes();
        for size in [50_000 / 16, 50_000, 200_000] {
            assert!(sizes.contains(&size), "{sizes:?}");
        }
    }
}

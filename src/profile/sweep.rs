//! Which renders a profile makes: along each axis of the cost model T = O(P·O·L·N/3), by brute force and by tree,
//! one quantity grows while all others stay.

use super::axis::{Axis, Effort, Way};
use super::fit::Model;
use super::quantity::Quantity;
use crate::accel::Method;

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

impl Setting {
    fn with_triangles(self, triangles: u32) -> Self {
        Self { triangles, ..self }
    }
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

impl Sweep {
    fn new(axis: Axis, way: Way, settings: Vec<Setting>, fitted: &[(Quantity, Model)]) -> Self {
        Self {
            axis,
            way,
            settings,
            fresh: false,
            fitted: fitted.to_vec(),
            from: 0.0,
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

/// The least tree whose steps are fitted: below, all of it is a node or two.
const LEAST: u32 = 1000;

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

    /// Square films whose areas double from one to the next.
    fn squares(&self, of: &Setting, first: f64) -> Vec<Setting> {
        let first = match self.effort {
            Effort::Tiny => 8.0,
            _ => first,
        };
        let side = |i: u32| (first * 2.0_f64.powf(f64::from(i) / 2.0)).round() as u32;
        let sized = |i| Setting {
            size: [side(i); 2],
            ..of.clone()
        };
        (0..self.effort.pick(5, 6)).map(sized).collect()
    }

    /// Lights whose number doubles from one to the next.
    fn lit(&self, of: &Setting, look: Look) -> Vec<Setting> {
        let lit = |i: u32| Setting {
            lights: 1 << i,
            look,
            ..of.clone()
        };
        (0..=self.effort.pick(5, 6)).map(lit).collect()
    }

    fn square(&self, side: u32) -> [u32; 2] {
        match self.effort {
            Effort::Tiny => [12; 2],
            _ => [side; 2],
        }
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
        sizes.retain(|n| (LEAST..=largest).contains(n));
        if self.effort == Effort::Tiny {
            sizes.push(2_000);
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
        let seen = Setting {
            size: self.square(128),
            ..self.base()
        };
        let room = Setting {
            look: Look::Room,
            depth: Some(6),
            size: self.square(self.effort.pick(96, 128)),
            ..seen.clone()
        };
        let few = Setting {
            triangles: self.brute().triangles / 2,
            size: self.square(self.effort.pick(48, 64)),
            ..self.brute()
        };
        let by_shadow_tests = [(Q::ShadowTests, Power), (Q::Shadows, Power)];
        let mut all = vec![
            Sweep::new(
                Axis::Pixels,
                Way::Brute,
                self.squares(&self.brute(), self.effort.pick(32.0, 48.0)),
                &[(Q::FirstTests, Power), (Q::Render, Power)],
            ),
            self.pixels(&self.base(), self.effort.pick(64.0, 128.0)),
            self.exhausted(),
            self.grown(),
            Sweep::new(
                Axis::Lights,
                Way::Brute,
                self.lit(&few, Look::AllLights),
                &by_shadow_tests,
            ),
        ];
        all.extend(self.lights(&seen));
        all.extend(self.others(&room));
        self.chosen(all)
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
        let seen = Setting {
            depth: Some(2),
            size: self.square(128),
            spp: 1,
            ..own.clone()
        };
        let small = Setting {
            size: self.square(64),
            ..own.clone()
        };
        let mut all = vec![self.pixels(&own, self.effort.pick(64.0, 96.0))];
        all.extend(self.lights(&seen));
        all.extend(self.others(&small));
        self.chosen(all)
    }

    /// Those along the axes that were asked for.
    fn chosen(&self, mut all: Vec<Sweep>) -> Vec<Sweep> {
        all.retain(|sweep| self.axes.contains(&sweep.axis));
        all
    }

    /// P, by tree.
    fn pixels(&self, of: &Setting, first: f64) -> Sweep {
        let fitted = [(Q::NodeSteps, Power), (Q::Render, Power)];
        Sweep::new(Axis::Pixels, Way::Tree, self.squares(of, first), &fitted)
    }

    /// O, by brute force.
    fn exhausted(&self) -> Sweep {
        let sizes = self.small().into_iter().chain(self.exhaustible());
        let fitted = [(Q::FirstTests, Power), (Q::TracePerRay, Power)];
        let sized = sizes.map(|n| self.brute().with_triangles(n)).collect();
        Sweep {
            from: 128.0,
            ..Sweep::new(Axis::Objects, Way::Brute, sized, &fitted)
        }
    }

    /// O, by tree; of small sizes those that brute force has as well.
    fn grown(&self) -> Sweep {
        let mut sizes = self.small();
        sizes.extend(self.exhaustible());
        sizes.retain(|n| *n < LEAST);
        sizes.extend(self.sizes());
        let fitted = [
            (Q::StepsPerRay, Logarithm),
            (Q::StepsPerRay, Power),
            (Q::TracePerRay, Logarithm),
            (Q::TracePerRay, Power),
            (Q::Build, Power),
            (Q::Load, Power),
        ];
        let sized = sizes
            .into_iter()
            .map(|n| self.base().with_triangles(n))
            .collect();
        Sweep {
            fresh: true,
            from: match self.effort {
                Effort::Tiny => 100.0,
                // A generated mesh has about as many triangles as it should.
                _ => 0.9 * f64::from(LEAST),
            },
            ..Sweep::new(Axis::Objects, Way::Tree, sized, &fitted)
        }
    }

    /// L, by tree: all lights, and one of them.
    fn lights(&self, of: &Setting) -> [Sweep; 2] {
        let fitted = [(Q::ShadowRays, Power), (Q::Shadows, Power)];
        [(Way::Tree, Look::AllLights), (Way::One, Look::OneLight)]
            .map(|(way, look)| Sweep::new(Axis::Lights, way, self.lit(of, look), &fitted))
    }

    /// The axes on which nothing but the render's own numbers grow.
    fn others(&self, of: &Setting) -> [Sweep; 4] {
        let along = |axis, settings, fitted: &[_]| Sweep::new(axis, Way::Tree, settings, fitted);
        let bands = [None, Some(8), Some(16), Some(32)].map(|bands| Setting {
            bands,
            ..of.clone()
        });
        let samples = |i: u32| Setting {
            spp: 1 << i,
            size: self.square(self.effort.pick(48, 64)),
            ..of.clone()
        };
        let depth = |i: u32| Setting {
            depth: Some(1 << i),
            ..of.clone()
        };
        let mut counts: Vec<usize> = (0..16).map(|i| 1 << i).collect();
        counts.retain(|n| *n < self.threads);
        counts.push(self.threads);
        let threads = |threads| Setting {
            threads,
            spp: self.effort.pick(4, 16) * of.spp,
            triangles: (of.triangles.saturating_mul(self.effort.pick(4, 5))).min(self.most),
            ..of.clone()
        };
        [
            along(
                Axis::Bands,
                bands.to_vec(),
                &[(Q::Render, Power), (Q::Render, Line), (Q::Shade, Power)],
            ),
            along(
                Axis::Samples,
                (0..self.effort.pick(5, 6)).map(samples).collect(),
                &[(Q::Rays, Power), (Q::Render, Power)],
            ),
            along(
                Axis::Depth,
                (1..=self.effort.pick(4, 5)).map(depth).collect(),
                &[(Q::Rays, Line), (Q::Render, Line)],
            ),
            Sweep {
                fresh: true,
                ..along(
                    Axis::Threads,
                    counts.into_iter().map(threads).collect(),
                    &[],
                )
            },
        ]
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

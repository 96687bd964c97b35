//! `sggx`: flakes that are mirrors, whose normals are distributed as an ellipsoid's (Heitz, Dupuy, Crassin and
//! Dachsbacher, *The SGGX microflake distribution*, 2015). The volume `S` holds the symmetric matrix: xx, yy, zz, xy,
//! xz, yz, or its diagonal, or a multiple of the identity. How much light meets flakes depends on where it comes from.

use std::f32::consts::FRAC_1_PI;

use super::{BlockPhase, PhaseSamples, Scatter};
use crate::color::{Mono, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, volume};
use crate::error::Result;
use crate::lanes::{Frame, Lanes, MAX_LANES, Vec2, Vec3, warp};
use crate::texture::Palette;
use crate::texture::volume::Volume;

/// Mirroring flakes.
#[derive(Clone, Debug)]
pub struct Sggx {
    matrix: Volume<Mono>,
}

/// Symmetric matrices.
#[derive(Clone, Copy)]
struct Matrix<F> {
    xx: F,
    yy: F,
    zz: F,
    xy: F,
    xz: F,
    yz: F,
}

impl<F: Lanes> Matrix<F> {
    #[inline(always)]
    fn times(&self, v: Vec3<F>) -> Vec3<F> {
        Vec3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }

    /// vᵀ S v, at least 0.
    #[inline(always)]
    fn form(&self, v: Vec3<F>) -> F {
        v.dot(self.times(v)).max(F::zero())
    }

    /// At least 0.
    #[inline(always)]
    fn determinant(&self) -> F {
        let Self {
            xx,
            yy,
            zz,
            xy,
            xz,
            yz,
        } = *self;
        let determinant =
            xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
        determinant.max(F::zero())
    }

    /// vᵀ adj(S) v, which is det S · vᵀ S⁻¹ v.
    #[inline(always)]
    fn adjugate_form(&self, v: Vec3<F>) -> F {
        let Self {
            xx,
            yy,
            zz,
            xy,
            xz,
            yz,
        } = *self;
        let adjugate = Self {
            xx: yy * zz - yz * yz,
            yy: xx * zz - xz * xz,
            zz: xx * yy - xy * xy,
            xy: xz * yz - xy * zz,
            xz: xy * yz - xz * yy,
            yz: xy * xz - xx * yz,
        };
        adjugate.form(v)
    }
}

impl Sggx {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "mirroring flakes",
        properties: &[&[volume(
            "S",
            0.0,
            "symmetric matrices: a gridvolume with 6 channels, xx, yy, zz, xy, xz, yz",
        )
        .required()]],
    };

    pub(super) fn build(properties: &Properties<'_>, numbers: &Palette<Mono>) -> Result<Self> {
        Ok(Self {
            matrix: Volume::named(properties, "S", numbers, Role::Quantity)?,
        })
    }

    #[inline(always)]
    fn matrix<F: Lanes>(&self, at: Vec3<F>) -> Matrix<F> {
        let [xx, yy, zz, xy, xz, yz] = self.matrix.matrices(at, &[(); MAX_LANES]);
        Matrix {
            xx,
            yy,
            zz,
            xy,
            xz,
            yz,
        }
    }

    /// The density of `wo` by the normal between both directions.
    #[inline(always)]
    fn value<F: Lanes>(matrix: &Matrix<F>, wi: Vec3<F>, normal: Vec3<F>) -> F {
        let determinant = matrix.determinant();
        let form = matrix.adjugate_form(normal);
        let area = matrix.form(wi).sqrt();
        let value =
            F::splat(FRAC_1_PI / 4.0) * determinant * determinant.sqrt() / (form * form * area);
        let there = F::zero().lt(value) & value.is_finite();
        F::select(there, value, F::zero())
    }
}

impl Scatter for Sggx {
    fn has_flakes(&self) -> bool {
        true
    }

    fn most_area(&self) -> f32 {
        let most = match self.matrix.constant() {
            Some(number) => *number,
            None => self.matrix.most_within(&self.matrix.bounds()),
        };
        most.max(0.0).sqrt()
    }
}

impl BlockPhase for Sggx {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(&self, at: Vec3<F>, wi: Vec3<F>, wo: Vec3<F>) -> F {
        Self::value(&self.matrix(at), wi, (wi + wo).normalize_or_zero())
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: Vec3<F>,
        wi: Vec3<F>,
        _u1: F,
        u2: Vec2<F>,
    ) -> PhaseSamples<F> {
        let matrix = self.matrix(at);
        // Normals that are seen, in the frame (k, j, i) around wi: section 4.2 of the paper.
        let frame = Frame::around(wi);
        let (t, n) = (matrix.times(frame.t), matrix.times(frame.n));
        let (ii, kj, ki) = (frame.n.dot(n), frame.s.dot(t), frame.s.dot(n));
        let (jj, ji) = (frame.t.dot(t), frame.t.dot(n));
        let inverse = F::one() / ii.max(F::zero()).sqrt();
        let across = (jj * ii - ji * ji).max(F::zero()).sqrt();
        let m_k = matrix.determinant().sqrt() / across;
        let m_j = Vec2::new(-inverse * (ki * ji - kj * ii) / across, inverse * across);
        let m_i = Vec3::new(ki, ji, ii) * inverse;
        let w = warp::cosine_hemisphere(u2);
        let local = Vec3::new(
            w.x * m_k + w.y * m_j.x + w.z * m_i.x,
            w.y * m_j.y + w.z * m_i.y,
            w.z * m_i.z,
        );
        let normal = frame.to_world(local).normalize_or_zero();
        let twice = wi.dot(normal) + wi.dot(normal);
        let wo = (normal * twice - wi).normalize_or_zero();
        PhaseSamples {
            wo,
            pdf: Self::value(&matrix, wi, normal),
        }
    }

    #[inline(always)]
    fn projected_area<F: Lanes>(&self, at: Vec3<F>, wi: Vec3<F>) -> F {
        self.matrix(at).form(wi).sqrt()
    }
}

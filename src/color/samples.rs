//! What a path carries: one value for each channel or band, with arithmetic channel by channel; and what the paths of a
//! block carry, a column of lanes a channel.

use std::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, MulAssign, Sub};

use crate::lanes::{Call, Lanes, MAX_LANES, Mask as _};

/// The operations on one value a channel that light transport needs.
pub trait Spectral:
    Copy
    + std::fmt::Debug
    + Send
    + Sync
    + PartialEq
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + MulAssign
    + Mul<f32, Output = Self>
    + Div<f32, Output = Self>
    + Index<usize, Output = f32>
{
    /// How many channels.
    const LANES: usize;
    /// One value a channel.
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self;
    /// The values.
    fn values(&self) -> &[f32];

    /// The same value everywhere.
    fn splat(value: f32) -> Self {
        Self::from_fn(|_| value)
    }
    /// Darkness.
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// The function of each channel's value.
    fn map(self, mut f: impl FnMut(f32) -> f32) -> Self {
        Self::from_fn(|i| f(self[i]))
    }
    /// The largest value.
    fn max_value(self) -> f32 {
        (0..Self::LANES).map(|i| self[i]).fold(0.0, f32::max)
    }
    /// Whether every value is zero.
    fn is_black(self) -> bool {
        (0..Self::LANES).all(|i| self[i] == 0.0)
    }
}

/// `N` values, one a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Samples<const N: usize>(pub [f32; N]);

impl<const N: usize> Spectral for Samples<N> {
    const LANES: usize = N;

    #[inline]
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self {
        Self(std::array::from_fn(f))
    }

    #[inline(always)]
    fn values(&self) -> &[f32] {
        &self.0
    }
}

impl<const N: usize> Index<usize> for Samples<N> {
    type Output = f32;
    #[inline]
    fn index(&self, i: usize) -> &f32 {
        &self.0[i]
    }
}

impl<const N: usize> IndexMut<usize> for Samples<N> {
    #[inline]
    fn index_mut(&mut self, i: usize) -> &mut f32 {
        &mut self.0[i]
    }
}

macro_rules! channelwise {
    ($($operation:ident $method:ident $symbol:tt),+) => {$(
        impl<const N: usize> $operation for Samples<N> {
            type Output = Self;
            #[inline]
            fn $method(self, other: Self) -> Self {
                Self(std::array::from_fn(|i| self.0[i] $symbol other.0[i]))
            }
        }
    )+};
}
channelwise!(Add add +, Sub sub -, Mul mul *);

impl<const N: usize> AddAssign for Samples<N> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize> MulAssign for Samples<N> {
    #[inline]
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

impl<const N: usize> Mul<f32> for Samples<N> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f32) -> Self {
        Self(self.0.map(|v| v * factor))
    }
}

impl<const N: usize> Div<f32> for Samples<N> {
    type Output = Self;
    #[inline]
    fn div(self, divisor: f32) -> Self {
        self * (1.0 / divisor)
    }
}

/// The operations on a column of lanes a channel that light transport needs.
pub trait Spectra<F: Lanes>:
    Copy
    + std::fmt::Debug
    + Add<Output = Self>
    + Mul<Output = Self>
    + Mul<F, Output = Self>
    + Index<usize, Output = F>
{
    /// How many channels.
    const CHANNELS: usize;
    /// A row of lanes a channel.
    type Rows;

    /// The rows of its lanes.
    fn rows(self) -> Self::Rows;
    /// One lane's sample, of rows.
    fn of<S: Spectral>(rows: &Self::Rows, lane: usize) -> S;
    /// The same in every channel.
    fn splat(value: F) -> Self;
    /// Each lane's sample, from the first lane on.
    fn from_samples<S: Spectral>(sample: impl FnMut(usize) -> S) -> Self;
    /// `yes` where the mask is set, else `no`.
    fn select(mask: F::Mask, yes: Self, no: Self) -> Self;
    /// Exchanges a channel.
    fn set(&mut self, channel: usize, value: F);

    /// Darkness.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(F::zero())
    }
    /// One lane's sample.
    #[inline(always)]
    fn sample<S: Spectral>(&self, lane: usize) -> S {
        S::from_fn(|channel| self[channel].lane(lane))
    }
    /// The largest value of each lane, at least 0.
    #[inline(always)]
    fn max_value(self) -> F {
        let mut largest = F::zero();
        for channel in 0..Self::CHANNELS {
            largest = largest.max(self[channel]);
        }
        largest
    }
    /// Where every value is zero.
    #[inline(always)]
    fn is_black(self) -> F::Mask {
        let mut black = F::Mask::splat(true);
        for channel in 0..Self::CHANNELS {
            black = black & self[channel].eq(F::zero());
        }
        black
    }
}

/// A column of lanes for each of `N` channels.
#[derive(Clone, Copy, Debug)]
pub struct Columns<F, const N: usize>(pub [F; N]);

impl<F: Lanes, const N: usize> Spectra<F> for Columns<F, N> {
    const CHANNELS: usize = N;
    type Rows = [F::Row; N];

    #[inline(always)]
    fn rows(self) -> [F::Row; N] {
        done::<F, _, N>(ToRows(&self))
    }

    #[inline(always)]
    fn of<S: Spectral>(rows: &[F::Row; N], lane: usize) -> S {
        if !Self::IN_SQUARES {
            return S::from_fn(|channel| rows[channel][lane]);
        }
        let mut values = [0.0; N];
        let rows = &rows[lane * (N / F::WIDTH)..];
        for (values, row) in values.chunks_exact_mut(F::WIDTH).zip(rows) {
            values.copy_from_slice(row.as_ref());
        }
        S::from_fn(|channel| values[channel])
    }

    #[inline(always)]
    fn splat(value: F) -> Self {
        Self([value; N])
    }

    #[inline(always)]
    fn from_samples<S: Spectral>(mut sample: impl FnMut(usize) -> S) -> Self {
        if Self::IN_SQUARES {
            let mut samples = [S::zero(); MAX_LANES];
            for (lane, place) in samples[..F::WIDTH].iter_mut().enumerate() {
                *place = sample(lane);
            }
            return done::<F, _, N>(FromSamples::<S, N>(&samples));
        }
        let mut rows = [F::ROW; N];
        for lane in 0..F::WIDTH {
            let sample = sample(lane);
            for (channel, row) in rows.iter_mut().enumerate() {
                row[lane] = sample[channel];
            }
        }
        let mut columns = Self::splat(F::zero());
        for (column, row) in columns.0.iter_mut().zip(&rows) {
            *column = F::load(row);
        }
        columns
    }

    #[inline(always)]
    fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
        done::<F, _, N>(Choice(mask, &yes, &no))
    }

    #[inline(always)]
    fn set(&mut self, channel: usize, value: F) {
        self.0[channel] = value;
    }
}

impl<F: Lanes, const N: usize> Columns<F, N> {
    /// Whether channels and lanes make squares, so that lanes are turned into samples by whole registers. Then each lane has
    /// the next few of the rows.
    const IN_SQUARES: bool = F::WIDTH > 1 && N.is_multiple_of(F::WIDTH);
}

impl<F, const N: usize> Index<usize> for Columns<F, N> {
    type Output = F;
    #[inline(always)]
    fn index(&self, i: usize) -> &F {
        &self.0[i]
    }
}

/// Operations of up to so many channels are expanded where they stand; those of more are functions of their own, for the code
/// would be that many times as long.
const EXPANDED: usize = 3;

/// Sums, products and choices channel by channel.
struct Sum<'a, F, const N: usize>(&'a Columns<F, N>, &'a Columns<F, N>);
struct Product<'a, F, const N: usize>(&'a Columns<F, N>, &'a Columns<F, N>);
struct Scaled<'a, F, const N: usize>(&'a Columns<F, N>, F);
struct Choice<'a, F: Lanes, const N: usize>(F::Mask, &'a Columns<F, N>, &'a Columns<F, N>);
struct ToRows<'a, F, const N: usize>(&'a Columns<F, N>);
struct FromSamples<'a, S, const N: usize>(&'a [S; MAX_LANES]);

impl<F: Lanes, const N: usize> Call<F> for Sum<'_, F, N> {
    type Output = Columns<F, N>;
    #[inline(always)]
    fn run(self) -> Columns<F, N> {
        let mut sum = *self.0;
        for (a, b) in sum.0.iter_mut().zip(&self.1.0) {
            *a = *a + *b;
        }
        sum
    }
}

impl<F: Lanes, const N: usize> Call<F> for Product<'_, F, N> {
    type Output = Columns<F, N>;
    #[inline(always)]
    fn run(self) -> Columns<F, N> {
        let mut product = *self.0;
        for (a, b) in product.0.iter_mut().zip(&self.1.0) {
            *a = *a * *b;
        }
        product
    }
}

impl<F: Lanes, const N: usize> Call<F> for Scaled<'_, F, N> {
    type Output = Columns<F, N>;
    #[inline(always)]
    fn run(self) -> Columns<F, N> {
        let mut product = *self.0;
        for a in &mut product.0 {
            *a = *a * self.1;
        }
        product
    }
}

impl<F: Lanes, const N: usize> Call<F> for Choice<'_, F, N> {
    type Output = Columns<F, N>;
    #[inline(always)]
    fn run(self) -> Columns<F, N> {
        let mut chosen = *self.2;
        for (no, yes) in chosen.0.iter_mut().zip(&self.1.0) {
            *no = F::select(self.0, *yes, *no);
        }
        chosen
    }
}

impl<F: Lanes, const N: usize> Call<F> for ToRows<'_, F, N> {
    type Output = [F::Row; N];
    #[inline(always)]
    fn run(self) -> [F::Row; N] {
        let mut rows = [F::ROW; N];
        if Columns::<F, N>::IN_SQUARES {
            for first in (0..N).step_by(F::WIDTH) {
                let mut square = [F::zero(); MAX_LANES];
                square[..F::WIDTH].copy_from_slice(&self.0.0[first..][..F::WIDTH]);
                F::transpose(&mut square);
                for lane in 0..F::WIDTH {
                    square[lane].store(&mut rows[(lane * N + first) / F::WIDTH]);
                }
            }
            return rows;
        }
        for (row, column) in rows.iter_mut().zip(&self.0.0) {
            column.store(row);
        }
        rows
    }
}

impl<F: Lanes, S: Spectral, const N: usize> Call<F> for FromSamples<'_, S, N> {
    type Output = Columns<F, N>;
    #[inline(always)]
    fn run(self) -> Columns<F, N> {
        let mut columns = Columns([F::zero(); N]);
        for first in (0..N).step_by(F::WIDTH) {
            let mut square = [F::zero(); MAX_LANES];
            for (row, sample) in square[..F::WIDTH].iter_mut().zip(self.0) {
                *row = F::from_slice(&sample.values()[first..]);
            }
            F::transpose(&mut square);
            columns.0[first..][..F::WIDTH].copy_from_slice(&square[..F::WIDTH]);
        }
        columns
    }
}

/// Does an operation of `N` channels, where it stands or in a function. With one lane the channels are what is in registers:
/// short, and of the instructions of whoever asks.
#[inline(always)]
fn done<F: Lanes, T: Call<F>, const N: usize>(operation: T) -> T::Output {
    if N <= EXPANDED || F::WIDTH == 1 {
        operation.run()
    } else {
        F::call(operation)
    }
}

impl<F: Lanes, const N: usize> Add for Columns<F, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        done::<F, _, N>(Sum(&self, &other))
    }
}

impl<F: Lanes, const N: usize> Mul for Columns<F, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        done::<F, _, N>(Product(&self, &other))
    }
}

impl<F: Lanes, const N: usize> Mul<F> for Columns<F, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: F) -> Self {
        done::<F, _, N>(Scaled(&self, factor))
    }
}

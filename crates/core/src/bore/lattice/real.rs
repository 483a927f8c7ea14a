//! The two number types a lattice can be built of.

use super::{Asked, LEAST_MASK, Lattice, LatticeCoeffs, NEXT_MASK, Tip};

/// What the lattice computes in: `f32` to play, `f64` to prove.
pub trait Real:
    Copy
    + Default
    + PartialOrd
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<Output = Self>
    + std::ops::Div<Output = Self>
    + std::ops::Neg<Output = Self>
    + From<u16>
{
    /// Rounds from f64.
    fn of(x: f64) -> Self;
    /// Widens to f64.
    fn wide(self) -> f64;
    /// Absolute value.
    fn magnitude(self) -> Self;
    /// Whole part of a number that is not negative.
    fn whole(self) -> u16;
    /// The samples of a run in which no delay arrives.
    #[doc(hidden)]
    fn run_part<T: Tip<Self>>(lattice: &mut Lattice<Self>, samples: usize, tip: &mut T);
    /// [`Lattice::run_any`] of this number, which no crate but this one has to compile.
    #[doc(hidden)]
    fn run_any(lattice: &mut Lattice<Self>, samples: usize, tip: &mut dyn Tip<Self>);
    /// [`Lattice::stored_energy`] of this number, likewise.
    #[doc(hidden)]
    fn stored_energy(lattice: &Lattice<Self>, coeffs: &LatticeCoeffs) -> f64;
}

macro_rules! real {
    ($t:ty, |$lattice:ident, $samples:ident, $tip:ident| $run_part:expr) => {
        impl Real for $t {
            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn wide(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn magnitude(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn whole(self) -> u16 {
                self as u16
            }
            #[inline(always)]
            fn run_part<T: Tip<Self>>($lattice: &mut Lattice<Self>, $samples: usize, $tip: &mut T) {
                $run_part
            }
            fn run_any(lattice: &mut Lattice<Self>, samples: usize, tip: &mut dyn Tip<Self>) {
                lattice.in_parts(samples, &mut Asked(tip), |lattice, samples, tip| {
                    run_asked(lattice, samples, tip.0)
                });
            }
            fn stored_energy(lattice: &Lattice<Self>, coeffs: &LatticeCoeffs) -> f64 {
                lattice.energy(coeffs)
            }
        }
    };
}
// A mask known beforehand saves 15 instructions a sample, and the two shortest rings are what clarinets up to the bass play on. Longer
// rings, and what proves, ask the tip through a table of its functions: that spares half of all bodies of the loop to be compiled.
real!(f32, |lattice, samples, tip| match lattice.mask {
    LEAST_MASK => lattice.run_masked::<T, LEAST_MASK>(samples, tip),
    NEXT_MASK => lattice.run_masked::<T, NEXT_MASK>(samples, tip),
    _ => run_asked(lattice, samples, tip),
});
real!(f64, |lattice, samples, tip| run_asked(lattice, samples, tip));

/// The samples of a run in which no delay arrives, compiled once for all tips.
fn run_asked<F: Real>(lattice: &mut Lattice<F>, samples: usize, tip: &mut dyn Tip<F>) {
    lattice.run_masked::<_, 0>(samples, &mut Asked(tip));
}

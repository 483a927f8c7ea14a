//! The reed without inertia, on the built-in bore with linear holes and on a cylinder without losses.

use chalumeau_core::bore::lattice::Lattice;
use chalumeau_core::bore::lattice::Tip;
use chalumeau_core::instrument::Model;
use chalumeau_core::reed::QuasiStaticReed;
use chalumeau_core::reed::QuasiStaticState;
use chalumeau_core::reed::ReedLaw;
use chalumeau_core::reed::ReedTables;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// A memoryless reed and its volume at the lattice's tip, all in f64.
pub struct MemorylessVoice<'a> {
    model: &'a Model,
    open: Vec<f64>,
    lattice: Lattice<f64>,
    tip: Mouth,
}

struct Mouth {
    reed: QuasiStaticReed,
    state: QuasiStaticState,
    tables: &'static ReedTables,
    admittance: f64,
    p_mouth: f64,
    glide: f64,
    kick: f64,
    heard: Vec<f64>,
}

impl Tip<f64> for Mouth {
    #[inline(always)]
    fn reflect(&mut self, p_minus: f64) -> f64 {
        self.p_mouth += self.glide;
        let p_minus = p_minus + self.kick;
        self.kick = 0.0;
        let p_plus = self.state.tick(&self.reed, self.tables, self.admittance, self.p_mouth, p_minus);
        self.heard.push(self.state.p_mouthpiece);
        p_plus
    }
}

impl<'a> MemorylessVoice<'a> {
    /// A silent note: linear holes, no trim.
    pub fn new(model: &'a Model, fingering: usize, zeta: f64) -> Self {
        let mut lattice = Lattice::new(&model.coeffs);
        let open: Vec<f64> =
            model.file.fingerings[fingering].open.iter().map(|&open| f64::from(u8::from(open))).collect();
        for (hole, &opening) in open.iter().enumerate() {
            lattice.set_opening(hole, opening);
        }
        lattice.set_jet_loss(0.0);
        let tip = Mouth {
            reed: QuasiStaticReed::new(ReedLaw::default(), zeta, model.swept_s, model.coeffs.rate_hz),
            state: QuasiStaticState::default(),
            tables: ReedTables::reference(),
            admittance: model.coeffs.tip_admittance(),
            p_mouth: 0.0,
            glide: 0.0,
            kick: 0.0,
            heard: Vec::new(),
        };
        Self { model, open, lattice, tip }
    }

    /// Mouth pressure moves to `gamma` in `seconds`, straight; what the mouthpiece heard meanwhile. A `kick` this large
    /// comes back from the bore in the first sample: something to grow from.
    pub fn blow(&mut self, gamma: f64, seconds: f64, kick: f64) -> Vec<f64> {
        let samples = ((seconds * self.model.coeffs.rate_hz) as usize).max(1);
        self.tip.glide = (gamma - self.tip.p_mouth) / samples as f64;
        self.tip.kick = kick;
        self.lattice.run_any(samples, &mut self.tip);
        self.tip.p_mouth = gamma;
        self.tip.glide = 0.0;
        std::mem::take(&mut self.tip.heard)
    }

    /// `Z / Zc` at the tip with the reed's volume, exactly what this lattice does at `f_hz`.
    fn impedance(&self, f_hz: f64) -> Complex64 {
        let coeffs = &self.model.coeffs;
        let r = coeffs.reflectance(f_hz, &self.open, 0.0);
        let z1 = Complex64::from_polar(1.0, -TAU * f_hz / coeffs.rate_hz);
        let volume = 2.0 * coeffs.rate_hz * self.model.swept_s * (1.0 - z1) / (1.0 + z1);
        1.0 / (coeffs.tip_admittance() * (1.0 - r) / (1.0 + r) + volume)
    }

    /// Where the phase of the impedance falls through zero nearest `near_hz`, Hz, and Re Z/Zc there.
    pub fn playing_frequency(&self, near_hz: f64) -> (f64, f64) {
        let im = |f_hz: f64| self.impedance(f_hz).im;
        let (mut low, mut high) = (0..600)
            .map(|step| near_hz * (f64::from(step) / 600.0 - 0.5).exp2())
            .filter(|&f_hz| im(f_hz) > 0.0 && im(f_hz * (1.0_f64 / 600.0).exp2()) <= 0.0)
            .min_by(|a, b| (a / near_hz).ln().abs().total_cmp(&(b / near_hz).ln().abs()))
            .map(|f_hz| (f_hz, f_hz * (1.0_f64 / 600.0).exp2()))
            .unwrap();
        while high - low > 1e-7 {
            let middle = 0.5 * (low + high);
            if im(middle) > 0.0 { low = middle } else { high = middle }
        }
        (low, self.impedance(low).re)
    }

    /// How fast a small oscillation at `f_hz` grows under a constant mouth pressure, 1/s: slope of the logarithm of its
    /// amplitude through ten Blackman-Harris windows of 0.1 s. Other modes, which may grow faster, are not in the window.
    pub fn growth(mut self, gamma: f64, f_hz: f64) -> f64 {
        const WINDOWS: usize = 10;
        let rate = self.model.coeffs.rate_hz;
        // So smoothly that hardly any mode is excited, then a kick.
        let rise = 0.2 * rate;
        for n in 0..rise as usize {
            let x = (n + 1) as f64 / rise;
            self.blow(gamma * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x), 0.0, 0.0);
        }
        self.blow(gamma, 0.05, 1e-7);
        let mut sound = self.blow(gamma, 0.7, 0.0);
        // What another mode, already loud, does to this one is not asked.
        let small = sound.iter().position(|p| p.abs() > 0.01).unwrap_or(sound.len());
        sound.truncate(small);
        assert!(sound.len() as f64 > 0.2 * rate, "gamma {gamma}: another mode is loud at once");
        let len = (0.1 * rate) as usize;
        let amplitudes: Vec<(f64, f64)> = (0..WINDOWS)
            .map(|window| {
                let from = window * (sound.len() - len) / (WINDOWS - 1);
                (from as f64 / rate, amplitude_at(&sound[from..from + len], f_hz, rate))
            })
            .map(|(t, amplitude)| (t, amplitude.ln()))
            .collect();
        let count = amplitudes.len() as f64;
        let (t_mean, y_mean) =
            amplitudes.iter().fold((0.0, 0.0), |(t, y), a| (t + a.0 / count, y + a.1 / count));
        let (ty, tt) = amplitudes.iter().fold((0.0, 0.0), |(ty, tt), a| {
            (ty + (a.0 - t_mean) * (a.1 - y_mean), tt + (a.0 - t_mean).powi(2))
        });
        ty / tt
    }
}

/// Amplitude of the line at `f_hz` through a Blackman-Harris window over the whole slice.
pub fn amplitude_at(sound: &[f64], f_hz: f64, rate_hz: f64) -> f64 {
    let sum: Complex64 = sound
        .iter()
        .enumerate()
        .map(|(n, p)| {
            let turn = TAU * n as f64 / sound.len() as f64;
            let window = 0.358_75 - 0.488_29 * turn.cos() + 0.141_28 * (2.0 * turn).cos()
                - 0.011_68 * (3.0 * turn).cos();
            Complex64::from_polar(window * p, -TAU * f_hz * n as f64 / rate_hz)
        })
        .sum();
    sum.norm() * 2.0 / (0.358_75 * sound.len() as f64)
}

/// Mouth pressure at which a note's small oscillation neither grows nor dies, by playing, found within 2 % of the
/// `expected` one; NaN if it is not there.
pub fn threshold_by_growth(model: &Model, fingering: usize, zeta: f64, f_hz: f64, expected: f64) -> f64 {
    let growth = |gamma: f64| MemorylessVoice::new(model, fingering, zeta).growth(gamma, f_hz);
    let (mut low, mut high) = (0.98 * expected, 1.02 * expected);
    if growth(low) > 0.0 || growth(high) < 0.0 {
        return f64::NAN;
    }
    while high - low > 5e-4 * expected {
        let middle = 0.5 * (low + high);
        if growth(middle) > 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// Steady rms in the mouthpiece of a memoryless reed on a cylinder that loses nothing.
pub fn raman_rms(gamma: f64, zeta: f64) -> f64 {
    const ROUND_TRIP: usize = 100;
    let (reed, tables) =
        (QuasiStaticReed::new(ReedLaw::default(), zeta, 0.0, 96_000.0), ReedTables::reference());
    let mut state = QuasiStaticState::default();
    let mut pipe = [0.0; ROUND_TRIP];
    let mut square = 0.0;
    const PERIODS: usize = 2_000;
    for n in 0..2 * ROUND_TRIP * PERIODS {
        let at = n % ROUND_TRIP;
        // Open end: what left a round trip ago comes back upside down.
        pipe[at] = state.tick(&reed, tables, 1.0, gamma, -pipe[at]);
        if n >= ROUND_TRIP * PERIODS {
            square += state.p_mouthpiece * state.p_mouthpiece;
        }
    }
    (square / (ROUND_TRIP * PERIODS) as f64).sqrt()
}

//! The player's settings as arguments.

use crate::cli::Failure;
use crate::cli::args::within_f32;
use crate::cli::reed_physical::PhysicalReedArgs;
use chalumeau_core::bore::instrument_file::InstrumentFile;
use chalumeau_core::instrument::{Settings, Tuning};
use chalumeau_core::score;
use chalumeau_core::score::breath::BreathCurve;
use clap::Args;

/// Most mouth pressure the instrument's settings know, kPa.
const BREATH_FULL_MAX_KPA: f32 = 20.0;

/// What a player can set; what is not given stays as the reference clarinet has it.
#[derive(Args)]
#[command(next_help_heading = "Player, reed and instrument")]
pub struct SettingsArgs {
    /// Reed strength as on the box, 1.5..5; 2.5 closes at 6 kPa
    #[arg(long, value_name = "N", value_parser = |s: &str| within_f32(s, 1.5, 5.0))]
    strength: Option<f32>,
    /// Lip: tip opening over the reference, 0.6 (bites) ..1.4 [default: 1]
    #[arg(long, value_name = "X", value_parser = |s: &str| within_f32(s, 0.6, 1.4))]
    lip: Option<f32>,
    /// Lip damping over the normal embouchure, 0.2 (squeaks) ..2 [default: 1]
    #[arg(long, value_name = "X", value_parser = |s: &str| within_f32(s, 0.2, 2.0))]
    damping: Option<f32>,
    /// Embouchure parameter zeta, flow strength of the reed, 0.05..0.9 [default: 0.3]
    #[arg(long, value_name = "ZETA", value_parser = |s: &str| within_f32(s, 0.05, 0.9))]
    zeta: Option<f32>,
    /// Curve of the lay, 0 (closes sharply) ..0.5 [default: 0.4]
    #[arg(long, value_name = "X", value_parser = |s: &str| within_f32(s, 0.0, 0.5))]
    lay: Option<f32>,
    /// Rest opening H of the dimensionless law, 1..5 [default: sqrt(27)/2]
    #[arg(long = "H", value_name = "H", value_parser = |s: &str| within_f32(s, 1.0, 5.0))]
    h: Option<f32>,
    /// Stiffness k of the dimensionless law, 0.1..2 [default: 27/(4 H^3), following H]
    #[arg(long = "k", value_name = "K", value_parser = |s: &str| within_f32(s, 0.1, 2.0))]
    k: Option<f32>,
    /// Amplitude A of the flow, 0..2 [default: 1]
    #[arg(long = "A", value_name = "A", value_parser = |s: &str| within_f32(s, 0.0, 2.0))]
    a: Option<f32>,
    /// Time for the tongue to let go of the reed, ms, 1..20 [default: 2]
    #[arg(long, value_name = "MS", value_parser = |s: &str| within_f32(s, 1.0, 20.0))]
    tongue_ms: Option<f32>,
    /// Time for fingers to move between slurred notes, ms, 5..15 [default: 8]
    #[arg(long, value_name = "MS", value_parser = |s: &str| within_f32(s, 5.0, 15.0))]
    legato_ms: Option<f32>,
    /// Breath noise, 0..1 [default: 0.3]
    #[arg(long, value_name = "X", conflicts_with = "no_noise", value_parser = |s: &str| within_f32(s, 0.0, 1.0))]
    noise: Option<f32>,
    /// No breath noise, for measurements
    #[arg(long)]
    no_noise: bool,
    /// Pitch of A4, Hz, 415..466 [default: 440]
    #[arg(long, value_name = "HZ", value_parser = |s: &str| within_f32(s, 415.0, 466.0))]
    a4: Option<f32>,
    /// Hold every note in tune whatever the breath, instead of letting it drift as the bore does
    #[arg(long)]
    tempered: bool,
    /// Air temperature, Celsius, 10..40 [default: 25]
    #[arg(long, value_name = "C", value_parser = |s: &str| within_f32(s, 10.0, 40.0))]
    temperature: Option<f32>,
    /// Nonlinear loss of open holes, 0..4; without it the clarion hardly speaks [default: 2]
    #[arg(long, value_name = "X", value_parser = |s: &str| within_f32(s, 0.0, 4.0))]
    vent_loss: Option<f32>,
    /// Output gain, dB, -60..24; at 0, 1 Pa at 1 m is -6 dBFS
    #[arg(long, value_name = "DB", allow_negative_numbers = true, value_parser = |s: &str| within_f32(s, -60.0, 24.0))]
    gain_db: Option<f32>,
    /// Mouth pressure at full breath (CC2 = 127), kPa, 2..20 [default: 6, more if gamma needs it]
    #[arg(long, value_name = "KPA", value_parser = |s: &str| within_f32(s, 2.0, 20.0))]
    breath_full: Option<f32>,
    #[command(flatten)]
    measured: PhysicalReedArgs,
}

impl SettingsArgs {
    fn settings(&self) -> Settings {
        let d = Settings::default();
        Settings {
            breath_full_kpa: self.breath_full.unwrap_or(d.breath_full_kpa),
            noise: if self.no_noise { 0.0 } else { self.noise.unwrap_or(d.noise) },
            tongue_ms: self.tongue_ms.unwrap_or(d.tongue_ms),
            legato_ms: self.legato_ms.unwrap_or(d.legato_ms),
            strength: self.strength.unwrap_or(d.strength),
            lip: self.lip.unwrap_or(d.lip),
            zeta: self.zeta.unwrap_or(d.zeta),
            damping: self.damping.unwrap_or(d.damping),
            lay: self.lay.unwrap_or(d.lay),
            reed_h: self.h.unwrap_or(d.reed_h),
            reed_k: self.k.unwrap_or(d.reed_k),
            coupled: self.k.is_none(),
            reed_a: self.a.unwrap_or(d.reed_a),
            a4_hz: self.a4.unwrap_or(d.a4_hz),
            tuning: if self.tempered { Tuning::Tempered } else { Tuning::Natural },
            temperature_c: self.temperature.unwrap_or(d.temperature_c),
            vent_loss: self.vent_loss.unwrap_or(d.vent_loss),
            gain_db: self.gain_db.unwrap_or(d.gain_db),
        }
    }

    /// Whether the user has chosen an amount of breath noise.
    pub fn noise_given(&self) -> bool {
        self.noise.is_some()
    }

    /// Settings whose full breath reaches the curve's largest gamma: raised for it unless the user has chosen it.
    /// The instrument's nominal bore is what a reed given in millimetres is measured against.
    pub fn blown_by(&self, curve: Option<&BreathCurve>, file: &InstrumentFile) -> Result<Settings, Failure> {
        let mut settings = self.measured.over(self.settings(), file.nominal_radius_m)?;
        let Some(gamma_max) = curve.map(BreathCurve::gamma_max) else { return Ok(settings) };
        let closing_kpa = score::closing_kpa(&settings);
        // Less what single precision adds to a closing pressure of 6 kPa.
        let needed_kpa = gamma_max * closing_kpa * (1.0 - 4.0 * f32::EPSILON);
        if needed_kpa <= settings.breath_full_kpa {
            return Ok(settings);
        }
        let limit_kpa =
            if self.breath_full.is_some() { settings.breath_full_kpa } else { BREATH_FULL_MAX_KPA };
        if needed_kpa > limit_kpa {
            return Err(Failure::Usage(format!(
                "gamma {gamma_max} needs {needed_kpa:.1} kPa with this reed, but full breath is {limit_kpa} kPa; \
                 stay below gamma {:.2}, or take a softer reed or more --breath-full (up to {BREATH_FULL_MAX_KPA})",
                limit_kpa / closing_kpa
            )));
        }
        settings.breath_full_kpa = needed_kpa;
        Ok(settings)
    }
}

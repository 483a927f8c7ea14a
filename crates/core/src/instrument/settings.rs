//! What a player can set, as plain numbers in the units that a player uses. They are clamped once, where they come in.

use crate::bore::lattice::JET_LOSS_REFERENCE;
use crate::event::{Fingerings, SettingNumber};
use crate::instrument::articulation::Articulation;
use crate::instrument::concert_pitch::A4_RANGE_HZ;
use crate::instrument::lip::Hold;
use crate::instrument::listening::Listening;
use crate::instrument::player::Attack;
use crate::instrument::player::dynamics::LipShape;
use crate::instrument::player::response::ONSET;
use crate::instrument::player::vibrato::Vibrato;
use crate::instrument::players::Players;
use crate::instrument::reach::Reach;
use crate::instrument::room::Room;
use crate::instrument::techniques::{Techniques, Tract};
use crate::reed::ReedLaw;
use crate::reed::law::{H_INIT, K_INIT, ZETA_RANGE, coupled_k};
use crate::reed::physical::{LAY_REFERENCE, P_REF_PA, PhysicalReed, ZETA_REFERENCE};
use crate::reed::strength;
use crate::units::clamped_or;

/// Stiffnesses of coupled reeds, of H 5 and of H 1, with room for rounding.
const K_RANGE: (f32, f32) = (0.05, 7.0);
/// Softest and loudest breath are at least this far apart.
const LEAST_BREATH_RANGE: f32 = 0.05;

/// What a breath source sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum BreathResponse {
    /// The dynamic, as a player does: the [rule](crate::instrument::player::dynamics) moves breath and lip together, every note
    /// begins at the same small breath, and equal steps of breath are equal steps of level.
    #[default]
    Played,
    /// The mouth pressure, as a blowing machine does: a share of [`Settings::breath_full_kpa`], on a lip that stays.
    Physical,
}

impl BreathResponse {
    /// All, in the order of the parameter that chooses one.
    pub const ALL: [Self; 2] = [Self::Played, Self::Physical];
}

/// How the tuning delay follows the breath.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Tuning {
    /// One trim per note, right at gamma 0.5: the pitch moves with the dynamics as the bore makes it.
    Natural,
    /// The trim follows the breath, so that each note stays in tune at every dynamic, or from gamma 0.45 to 0.9 where the
    /// breath is [physical](BreathResponse::Physical).
    #[default]
    Tempered,
}

impl Tuning {
    /// All, in the order of the parameter that chooses one.
    pub const ALL: [Self; 2] = [Self::Natural, Self::Tempered];
}

/// Everything that can be set while playing. `Default` is the reference clarinet as a player plays it;
/// [`physical`](Self::physical) is the same blown by a machine.
///
/// ```
/// use chalumeau_core::instrument::{Clarinet, Settings, Tuning};
///
/// let settings = Settings { strength: 3.0, tuning: Tuning::Natural, ..Settings::default() };
/// // A harder reed closes at a higher pressure: 20 % for half a number.
/// assert!((settings.closing_pa() / Settings::default().closing_pa() - 1.2).abs() < 1e-6);
/// Clarinet::built_in(48_000.0)?.set_settings(&settings);
/// # Ok::<(), chalumeau_core::instrument::BuildError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// What a breath source sets. Default [`BreathResponse::Played`].
    pub breath_response: BreathResponse,
    /// Curve of the played response, 0.5..=2: the dynamic is the share of breath above the threshold to this power. Default 1.
    pub breath_curve: f32,
    /// Breath at which notes begin where the response is played, 0..=0.5. Default 4/127, the controller value 4.
    pub breath_softest: f32,
    /// Breath that plays fortissimo where the response is played, 0.1..=1, and at least 0.05 above the softest. Default 1.
    pub breath_loudest: f32,
    /// Width of the band of breath within which a restless source moves nothing, 0..=0.1. Default 0.
    pub breath_deadband: f32,
    /// Mouth pressure at full breath where the response is physical, kPa, 2..=20. Default 6, the reference reed's closing
    /// pressure.
    pub breath_full_kpa: f32,
    /// Breath noise, 0 (none)..=1 (much). Default 0.3, by ear.
    pub noise: f32,
    /// Time that the tongue takes to let go of the reed, ms, 1..=20. Default 2.
    pub tongue_ms: f32,
    /// Time that the fingers take between slurred notes, ms, 5..=15. Default 8.
    pub legato_ms: f32,
    /// How much a held note lives where the breath is [played](BreathResponse::Played): slow wander of breath and lip, 0 (it
    /// stands still)..=1 (as recorded players). Default 1.
    pub life: f32,
    /// Regular swing of breath and lip. Default none.
    pub vibrato: Vibrato,
    /// How a tongued note begins where the breath is [played](BreathResponse::Played). Default [`Attack::Normal`].
    pub attack: Attack,
    /// Reed strength as printed on the box, 1.5..=5. It scales the stiffness. Default 2.5, the reference reed (closing
    /// pressure 6 kPa).
    pub strength: f32,
    /// Lip position: tip opening over the reference, 0.6..=1.4; below 1 the lip bites. Default 1.
    pub lip: f32,
    /// Embouchure parameter zeta, the flow strength of the reed, 0.05..=0.9. Default 0.3.
    pub zeta: f32,
    /// Lip damping over that of the [lip rule](super::lip), 0.2..=2; low values squeak. Default 1.
    pub damping: f32,
    /// Curve of the lay, 0 (sharp, the closure of the reference notebook)..=0.5. Default 0.4.
    pub lay: f32,
    /// H of the reference notebook, the dimensionless rest opening, 1..=5. Default sqrt(27)/2.
    pub reed_h: f32,
    /// k of the reference notebook, the dimensionless stiffness, 0.1..=2 as a parameter; up to those of a coupled reed, 0.05..=7, as it
    /// is played. Default 27/(4 H^3). Ignored while `coupled`.
    pub reed_k: f32,
    /// Coupling of the reference notebook: k = 27/(4 H^3), so that the peak flow stays 1. Default true.
    pub coupled: bool,
    /// Amplitude A of the flow in the reference notebook, 0..=2. Default 1.
    pub reed_a: f32,
    /// Pitch of A4, Hz, 415..=466. Default 440.
    pub a4_hz: f32,
    /// How the tuning delay follows the breath. Default [`Tuning::Tempered`].
    pub tuning: Tuning,
    /// Air temperature, Celsius, 10..=40. The instrument is tuned at 25, the default; the pitch rises by 3 cents a kelvin.
    pub temperature_c: f32,
    /// Nonlinear flow loss K of open holes, 0..=4. At 0 fewer notes of clarion and altissimo hold their register. Default 2.
    pub vent_loss: f32,
    /// Output gain, dB, -60..=24. At 0 dB 1 Pa at 1 m from a B flat clarinet is -6 dBFS. Default -2.5: the loudest keys stay below the limiter.
    pub gain_db: f32,
    /// Where the instrument is heard from.
    pub listening: Listening,
    /// Which note a key plays.
    pub reach: Reach,
    /// The room around the instrument, on two channels. Default none.
    pub room: Room,
    /// Growl, flutter tongue and subtone. All off by default.
    pub techniques: Techniques,
    /// The vocal tract's resonance. Off by default.
    pub tract: Tract,
    /// Time that a slur slides from note to note, s, 0 (the fingers move at once)..=3. Default 0.
    pub glissando_s: f32,
    /// Scoop, fall, breath in, and the sounds of the keys. All off by default.
    pub articulation: Articulation,
    /// How many players play. Default one.
    pub players: Players,
    /// Whether slurs by a semitone or a tone, as in chromatic runs and trills, take an
    /// [alternate fingering](crate::bore::context_fingerings) where fewer fingers then move. Not where slurs slide. Default
    /// false.
    pub alternates: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            breath_response: BreathResponse::Played,
            breath_curve: 1.0,
            breath_softest: ONSET as f32,
            breath_loudest: 1.0,
            breath_deadband: 0.0,
            breath_full_kpa: 6.0,
            noise: 0.3,
            tongue_ms: 2.0,
            legato_ms: 8.0,
            life: 1.0,
            vibrato: Vibrato::default(),
            attack: Attack::Normal,
            strength: 2.5,
            lip: 1.0,
            zeta: ZETA_REFERENCE as f32,
            damping: 1.0,
            lay: LAY_REFERENCE as f32,
            reed_h: H_INIT as f32,
            reed_k: K_INIT as f32,
            coupled: true,
            reed_a: 1.0,
            a4_hz: 440.0,
            tuning: Tuning::Tempered,
            temperature_c: 25.0,
            vent_loss: JET_LOSS_REFERENCE as f32,
            gain_db: -2.5,
            listening: Listening::default(),
            reach: Reach::default(),
            room: Room::default(),
            techniques: Techniques::default(),
            tract: Tract::default(),
            glissando_s: 0.0,
            articulation: Articulation::default(),
            players: Players::default(),
            alternates: false,
        }
    }
}

impl Settings {
    /// The reference clarinet blown by a machine: breath is mouth pressure, and the pitch moves with it as the bore makes it.
    /// For measurements.
    pub fn physical() -> Self {
        Self {
            breath_response: BreathResponse::Physical,
            tuning: Tuning::Natural,
            life: 0.0,
            ..Self::default()
        }
    }

    /// Which fingerings the next note takes, if the player has [`chosen`](crate::event::Event::Fingerings) any.
    pub fn fingerings(&self, chosen: Option<Fingerings>) -> Fingerings {
        let by_setting = if self.alternates { Fingerings::ByContext } else { Fingerings::Chart };
        chosen.unwrap_or(by_setting)
    }

    /// k as it is set, or as H has it.
    fn own_k(&self) -> f64 {
        if self.coupled { coupled_k(f64::from(self.reed_h)) } else { f64::from(self.reed_k) }
    }

    /// The law of the reed under these settings: strength sets the stiffness, the lip the opening. Real-time safe.
    pub fn reed_law(&self) -> ReedLaw {
        let settings = self.clamped();
        let set_h = f64::from(settings.reed_h);
        let set_k = settings.own_k();
        let stiffer = strength::stiffness(f64::from(settings.strength));
        let h = (set_h * f64::from(settings.lip)).clamp(0.5, 10.0);
        let k = (set_k * stiffer).clamp(0.01, 20.0);
        ReedLaw::free(h, k, f64::from(settings.reed_a)).unwrap_or_default()
    }

    /// How the player holds this reed. Real-time safe.
    pub fn hold(&self) -> Hold {
        // Of two numbers of one kind, the same for the default reed to the bit.
        let power = |settings: &Self| {
            let law = settings.reed_law();
            law.closing() * law.flow_strength(f64::from(settings.zeta))
        };
        Hold { damping: f64::from(self.damping), power: power(self) / power(&Self::default()) }
    }

    /// A number by its name, as [`Event::Set`](crate::event::Event::Set) has it; not clamped. Real-time safe.
    ///
    /// ```
    /// use chalumeau_core::event::SettingNumber;
    /// use chalumeau_core::instrument::Settings;
    ///
    /// let mut settings = Settings::default();
    /// *settings.number(SettingNumber::Noise) = 0.5;
    /// assert_eq!(settings.noise, 0.5);
    /// ```
    pub fn number(&mut self, which: SettingNumber) -> &mut f32 {
        match which {
            SettingNumber::BreathFullKpa => &mut self.breath_full_kpa,
            SettingNumber::TongueMs => &mut self.tongue_ms,
            SettingNumber::LegatoMs => &mut self.legato_ms,
            SettingNumber::BreathCurve => &mut self.breath_curve,
            SettingNumber::BreathSoftest => &mut self.breath_softest,
            SettingNumber::BreathLoudest => &mut self.breath_loudest,
            SettingNumber::BreathDeadband => &mut self.breath_deadband,
            SettingNumber::Strength => &mut self.strength,
            SettingNumber::Lip => &mut self.lip,
            SettingNumber::Zeta => &mut self.zeta,
            SettingNumber::Damping => &mut self.damping,
            SettingNumber::ReedH => &mut self.reed_h,
            SettingNumber::ReedK => &mut self.reed_k,
            SettingNumber::ReedA => &mut self.reed_a,
            SettingNumber::Lay => &mut self.lay,
            SettingNumber::A4Hz => &mut self.a4_hz,
            SettingNumber::TemperatureC => &mut self.temperature_c,
            SettingNumber::VentLoss => &mut self.vent_loss,
            SettingNumber::Noise => &mut self.noise,
            SettingNumber::GainDb => &mut self.gain_db,
            SettingNumber::ListeningDistanceM => &mut self.listening.distance_m,
            SettingNumber::ListeningAngleDeg => &mut self.listening.angle_deg,
            SettingNumber::ListeningHeightM => &mut self.listening.height_m,
            SettingNumber::ListeningWidthDeg => &mut self.listening.width_deg,
            SettingNumber::RoomAmount => &mut self.room.amount,
            SettingNumber::RoomSizeM => &mut self.room.size_m,
            SettingNumber::RoomDecayS => &mut self.room.decay_s,
            SettingNumber::RoomTone => &mut self.room.tone,
            SettingNumber::Life => &mut self.life,
            SettingNumber::VibratoDepth => &mut self.vibrato.depth,
            SettingNumber::VibratoRateHz => &mut self.vibrato.rate_hz,
            SettingNumber::VibratoOnsetS => &mut self.vibrato.onset_s,
            SettingNumber::VibratoUnevenness => &mut self.vibrato.unevenness,
            SettingNumber::GlissandoS => &mut self.glissando_s,
            SettingNumber::ScoopCents => &mut self.articulation.scoop_cents,
            SettingNumber::ScoopS => &mut self.articulation.scoop_s,
            SettingNumber::FallCents => &mut self.articulation.fall_cents,
            SettingNumber::FallS => &mut self.articulation.fall_s,
            SettingNumber::BreathIn => &mut self.articulation.breath_in,
            SettingNumber::KeySounds => &mut self.articulation.key_sounds,
            SettingNumber::Slap => &mut self.articulation.slap,
            SettingNumber::Growl => &mut self.techniques.growl,
            SettingNumber::GrowlSemitones => &mut self.techniques.growl_semitones,
            SettingNumber::GrowlHz => &mut self.techniques.growl_hz,
            SettingNumber::Flutter => &mut self.techniques.flutter,
            SettingNumber::FlutterHz => &mut self.techniques.flutter_hz,
            SettingNumber::Subtone => &mut self.techniques.subtone,
            SettingNumber::TractAmount => &mut self.tract.amount,
            SettingNumber::TractIntervalSemitones => &mut self.tract.interval_semitones,
            SettingNumber::PlayersSpreadCents => &mut self.players.spread_cents,
            SettingNumber::PlayersOnsetSpreadMs => &mut self.players.onset_spread_ms,
            SettingNumber::PlayersWidth => &mut self.players.width,
        }
    }

    /// These settings with H and k multiplied by the factors of controllers; see
    /// [`Event::Reed`](crate::event::Event::Reed). A coupled k stays as H without its factor has it: a reed that a controller
    /// opens keeps its stiffness, else it would be softer by the third power, and notes would leave their register. Real-time safe.
    pub fn with_reed_factors(self, [h, k]: [f32; 2]) -> Self {
        if [h, k] == [1.0, 1.0] {
            return self;
        }
        let reed_k = self.own_k() as f32 * k;
        Self { reed_h: self.reed_h * h, reed_k, coupled: false, ..self }.clamped()
    }

    /// These settings with the reed as a player's lip shapes it: what meters and drawings of the played reed need. Real-time
    /// safe.
    pub fn under_lip(self, lip: Option<LipShape>) -> Self {
        let Some(lip) = lip else { return self };
        Self {
            reed_h: self.reed_h * lip.opening as f32,
            reed_k: self.own_k() as f32,
            coupled: false,
            zeta: self.zeta * lip.channel as f32,
            lay: self.lay * lip.knee as f32,
            ..self
        }
        .clamped()
    }

    /// These settings with H, k and zeta of a reed as its maker measures it; strength, lip, lay and A stay and act on it.
    /// The area is heard only in the closing pressure: the air that the reed's motion moves belongs to the instrument
    /// (`reed_volume_mm3` of its file), because its tuning depends on it. Numbers outside the ranges are clamped as all
    /// settings are; [`refused_reed`](Self::refused_reed) tells which. Real-time safe.
    pub fn with_physical_reed(self, reed: &PhysicalReed, reference: &PhysicalReed) -> Self {
        let a = f64::from(self.reed_a);
        let set = reed.dimensionless(reference, if a > 0.0 { a } else { 1.0 });
        Self { reed_h: set.h as f32, reed_k: set.k as f32, coupled: false, zeta: set.zeta as f32, ..self }
    }

    /// The first of H, k and zeta of such a reed that lies outside the range the instrument plays: symbol, value and
    /// range; `None` if all lie inside.
    pub fn refused_reed(
        &self,
        reed: &PhysicalReed,
        reference: &PhysicalReed,
    ) -> Option<(&'static str, f64, [f64; 2])> {
        let wanted = self.with_physical_reed(reed, reference);
        let played = wanted.clamped();
        let ends = |get: fn(&Self) -> f32, set: fn(&mut Self, f32)| {
            [-1e9, 1e9].map(|x| {
                let mut end = wanted;
                set(&mut end, x);
                f64::from(get(&end.clamped()))
            })
        };
        if wanted.reed_h != played.reed_h {
            return Some(("H", wanted.reed_h.into(), ends(|s| s.reed_h, |s, x| s.reed_h = x)));
        }
        if wanted.reed_k != played.reed_k {
            return Some(("k", wanted.reed_k.into(), ends(|s| s.reed_k, |s, x| s.reed_k = x)));
        }
        if wanted.zeta != played.zeta {
            return Some(("zeta", wanted.zeta.into(), ends(|s| s.zeta, |s, x| s.zeta = x)));
        }
        None
    }

    /// Closing pressure of the reed under these settings, Pa.
    pub fn closing_pa(&self) -> f64 {
        P_REF_PA * self.reed_law().closing()
    }

    /// These settings with every number inside its range; a number that is not finite becomes its default. Real-time safe.
    pub fn clamped(self) -> Self {
        let d = Self::default();
        let breath_softest = clamped_or(self.breath_softest, 0.0, 0.5, d.breath_softest);
        Self {
            breath_response: self.breath_response,
            breath_curve: clamped_or(self.breath_curve, 0.5, 2.0, d.breath_curve),
            breath_softest,
            breath_loudest: clamped_or(self.breath_loudest, 0.1, 1.0, d.breath_loudest)
                .max(breath_softest + LEAST_BREATH_RANGE),
            breath_deadband: clamped_or(self.breath_deadband, 0.0, 0.1, d.breath_deadband),
            breath_full_kpa: clamped_or(self.breath_full_kpa, 2.0, 20.0, d.breath_full_kpa),
            noise: clamped_or(self.noise, 0.0, 1.0, d.noise),
            tongue_ms: clamped_or(self.tongue_ms, 1.0, 20.0, d.tongue_ms),
            legato_ms: clamped_or(self.legato_ms, 5.0, 15.0, d.legato_ms),
            life: clamped_or(self.life, 0.0, 1.0, d.life),
            vibrato: self.vibrato.clamped(),
            attack: self.attack,
            strength: clamped_or(self.strength, 1.5, 5.0, d.strength),
            lip: clamped_or(self.lip, 0.6, 1.4, d.lip),
            zeta: clamped_or(self.zeta, ZETA_RANGE.0 as f32, ZETA_RANGE.1 as f32, d.zeta),
            damping: clamped_or(self.damping, 0.2, 2.0, d.damping),
            lay: clamped_or(self.lay, 0.0, 0.5, d.lay),
            reed_h: clamped_or(self.reed_h, 1.0, 5.0, d.reed_h),
            reed_k: clamped_or(self.reed_k, K_RANGE.0, K_RANGE.1, d.reed_k),
            coupled: self.coupled,
            reed_a: clamped_or(self.reed_a, 0.0, 2.0, d.reed_a),
            a4_hz: clamped_or(self.a4_hz, A4_RANGE_HZ.0 as f32, A4_RANGE_HZ.1 as f32, d.a4_hz),
            tuning: self.tuning,
            temperature_c: clamped_or(self.temperature_c, 10.0, 40.0, d.temperature_c),
            vent_loss: clamped_or(self.vent_loss, 0.0, 4.0, d.vent_loss),
            gain_db: clamped_or(self.gain_db, -60.0, 24.0, d.gain_db),
            listening: Listening {
                mode: self.listening.mode,
                distance_m: clamped_or(self.listening.distance_m, 0.2, 10.0, d.listening.distance_m),
                angle_deg: clamped_or(self.listening.angle_deg, -180.0, 180.0, d.listening.angle_deg),
                height_m: clamped_or(self.listening.height_m, -1.0, 2.0, d.listening.height_m),
                width_deg: clamped_or(self.listening.width_deg, 0.0, 180.0, d.listening.width_deg),
            },
            reach: self.reach.clamped(),
            room: self.room.clamped(),
            techniques: self.techniques.clamped(),
            tract: self.tract.clamped(),
            glissando_s: clamped_or(self.glissando_s, 0.0, 3.0, d.glissando_s),
            articulation: self.articulation.clamped(),
            players: self.players.clamped(),
            alternates: self.alternates,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reed::physical::DimensionlessReed;

    #[test]
    fn a_makers_reed_sets_h_k_and_zeta() {
        let reference = PhysicalReed::reference();
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 3e-7, "{a} {b}, single precision");
        let d = Settings::default();
        near(d.closing_pa(), P_REF_PA);
        let same = d.with_physical_reed(&reference, &reference);
        near(f64::from(same.reed_h), f64::from(d.reed_h));
        near(f64::from(same.reed_k), coupled_k(f64::from(d.reed_h)));
        near(f64::from(same.zeta), f64::from(d.zeta));
        let reed =
            PhysicalReed { stiffness_n_m: 2_000.0, tip_opening_m: 0.6e-3, width_m: 20e-3, ..reference };
        let set =
            Settings { strength: 3.0, lip: 0.8, reed_a: 0.5, ..d }.with_physical_reed(&reed, &reference);
        assert_eq!(set.refused_reed(&reed, &reference), None);
        let (h, k) = (f64::from(set.reed_h), f64::from(set.reed_k));
        let dimensionless = DimensionlessReed { h, k, a: 0.5, zeta: f64::from(set.zeta), area: 1.0 };
        let read = PhysicalReed::from_dimensionless(&dimensionless, &reference);
        near(read.stiffness_n_m, 2_000.0);
        near(read.tip_opening_m, 0.6e-3);
        near(read.width_m, 20e-3);
        // Half a number is 20 % stiffer; the lip reduces the opening.
        near(set.reed_law().k(), 1.2 * k);
        near(set.reed_law().h(), 0.8 * h);
        near(set.closing_pa(), 1.2 * 0.8 * reed.closing_pa());
    }

    #[test]
    fn fingerings_are_judged_with_the_embouchure_that_plays_them() {
        assert_eq!(crate::bore::ZETA, ZETA_REFERENCE);
    }

    #[test]
    fn a_lip_moves_the_closing_pressure_by_its_factors() {
        let lip = LipShape { opening: 1.2, channel: 1.2, knee: 0.8 };
        let shaped = Settings::default().under_lip(Some(lip));
        assert!((shaped.closing_pa() / (1.2 * Settings::default().closing_pa()) - 1.0).abs() < 1e-6);
        assert!((shaped.zeta - 0.36).abs() < 1e-6 && (shaped.lay - 0.32).abs() < 1e-6);
        assert_eq!(Settings::default().under_lip(None), Settings::default());
    }

    #[test]
    fn a_reed_nobody_could_play_is_named() {
        let reference = PhysicalReed::reference();
        let refused = |reed: PhysicalReed| Settings::default().refused_reed(&reed, &reference).unwrap();
        let (symbol, h, [low, high]) = refused(PhysicalReed { tip_opening_m: 2e-3, ..reference });
        assert_eq!((symbol, low, high), ("H", 1.0, 5.0));
        assert!((h - 4.0 * H_INIT).abs() < 1e-4);
        assert_eq!(refused(PhysicalReed { stiffness_n_m: 1e5, ..reference }).0, "k");
        assert_eq!(refused(PhysicalReed { width_m: 0.1, ..reference }).0, "zeta");
    }
}

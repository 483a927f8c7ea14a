//! The numbers of the settings, by name, so that an event can say which one it sets.

/// A number of [`Settings`](crate::instrument::Settings), see [`Settings::number`](crate::instrument::Settings::number). Its
/// unit and range are that of the field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SettingNumber {
    /// `breath_full_kpa`.
    BreathFullKpa,
    /// `tongue_ms`.
    TongueMs,
    /// `legato_ms`.
    LegatoMs,
    /// `breath_curve`.
    BreathCurve,
    /// `breath_softest`.
    BreathSoftest,
    /// `breath_loudest`.
    BreathLoudest,
    /// `breath_deadband`.
    BreathDeadband,
    /// `strength`.
    Strength,
    /// `lip`.
    Lip,
    /// `zeta`.
    Zeta,
    /// `damping`.
    Damping,
    /// `reed_h`.
    ReedH,
    /// `reed_k`.
    ReedK,
    /// `reed_a`.
    ReedA,
    /// `lay`.
    Lay,
    /// `a4_hz`.
    A4Hz,
    /// `temperature_c`.
    TemperatureC,
    /// `vent_loss`.
    VentLoss,
    /// `noise`.
    Noise,
    /// `gain_db`.
    GainDb,
    /// `listening.distance_m`.
    ListeningDistanceM,
    /// `listening.angle_deg`.
    ListeningAngleDeg,
    /// `listening.height_m`.
    ListeningHeightM,
    /// `listening.width_deg`.
    ListeningWidthDeg,
    /// `room.amount`.
    RoomAmount,
    /// `room.size_m`.
    RoomSizeM,
    /// `room.decay_s`.
    RoomDecayS,
    /// `room.tone`.
    RoomTone,
    /// `life`.
    Life,
    /// `vibrato.depth`.
    VibratoDepth,
    /// `vibrato.rate_hz`.
    VibratoRateHz,
    /// `vibrato.onset_s`.
    VibratoOnsetS,
    /// `vibrato.unevenness`.
    VibratoUnevenness,
    /// `glissando_s`.
    GlissandoS,
    /// `articulation.scoop_cents`.
    ScoopCents,
    /// `articulation.scoop_s`.
    ScoopS,
    /// `articulation.fall_cents`.
    FallCents,
    /// `articulation.fall_s`.
    FallS,
    /// `articulation.breath_in`.
    BreathIn,
    /// `articulation.key_sounds`.
    KeySounds,
    /// `articulation.slap`.
    Slap,
    /// `techniques.growl`.
    Growl,
    /// `techniques.growl_semitones`.
    GrowlSemitones,
    /// `techniques.growl_hz`.
    GrowlHz,
    /// `techniques.flutter`.
    Flutter,
    /// `techniques.flutter_hz`.
    FlutterHz,
    /// `techniques.subtone`.
    Subtone,
    /// `tract.amount`.
    TractAmount,
    /// `tract.interval_semitones`.
    TractIntervalSemitones,
    /// `players.spread_cents`.
    PlayersSpreadCents,
    /// `players.onset_spread_ms`.
    PlayersOnsetSpreadMs,
    /// `players.width`.
    PlayersWidth,
}

impl SettingNumber {
    /// Whether each of several players can have a value of its own: what lip, breath, tongue, fingers and reed do. The others
    /// belong to all of them: pitch, air, seats, listening and room.
    pub fn is_of_player(self) -> bool {
        !matches!(
            self,
            Self::A4Hz
                | Self::TemperatureC
                | Self::ListeningDistanceM
                | Self::ListeningAngleDeg
                | Self::ListeningHeightM
                | Self::ListeningWidthDeg
                | Self::RoomAmount
                | Self::RoomSizeM
                | Self::RoomDecayS
                | Self::RoomTone
                | Self::PlayersSpreadCents
                | Self::PlayersOnsetSpreadMs
                | Self::PlayersWidth
        )
    }
}

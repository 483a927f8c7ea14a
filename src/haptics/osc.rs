//! A feel under the names it has in OSC, as plain data: `/chalumeau/feel/<name>`.
//!
//! For firmware that listens by libmapper or OSC and can be bridged. TorqueTuner's own words are kept (scale, stretch,
//! offset, damping) beside the reed's H and k; units are those of `docs/protocol.md`.

use crate::wire::message::Feel;

/// What every address begins with.
pub const PREFIX: &str = "/chalumeau/feel/";

/// Names and values of a feel, in the order of the wire.
pub fn fields(feel: &Feel) -> [(&'static str, f32); 17] {
    [
        ("feel_id", f32::from(feel.feel_id)),
        ("law", f32::from(feel.law as u8)),
        ("morph_ms", f32::from(feel.morph_ms)),
        ("H", feel.h),
        ("k", feel.k),
        ("scale", feel.scale_mnm),
        ("stretch", feel.stretch),
        ("offset", feel.offset_deg),
        ("a_on", feel.a_on_deg),
        ("a_off", feel.a_off_deg),
        ("a_beat", feel.a_beat_deg),
        ("wall", feel.wall_deg),
        ("wall_stiffness", feel.wall_mnm_per_deg),
        ("slap", feel.slap_mnm_per_deg),
        ("damping", feel.damping_mnms),
        ("friction", 0.1 * f32::from(feel.friction)),
        ("detent", 0.1 * f32::from(feel.detent)),
    ]
}

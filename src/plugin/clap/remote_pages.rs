//! Pages of up to eight parameters for the knobs of a control surface.
//!
//! What arms a knob, or raises the torque that it may make, is only in the window and in the host's own list.

use nice_plug::prelude::*;

use crate::plugin::params::ChalumeauParams;

/// Defines the pages. They are shown in this order.
pub fn define(params: &ChalumeauParams, context: &mut impl RemoteControlsContext) {
    let ChalumeauParams {
        breath,
        embouchure,
        reed,
        tuning,
        noise,
        output,
        knob,
        instrument,
        physical,
        listening,
        room,
        expression,
        techniques,
        players,
        ..
    } = params;
    context.add_section("Player", |section| {
        section.add_page("Breath and lip", |page| {
            page.add_param(&breath.breath);
            page.add_param(&embouchure.lip);
            page.add_param(&embouchure.strength);
            page.add_param(&noise.noise);
            page.add_param(&output.gain);
            page.add_param(&breath.full);
            page.add_param(&breath.tongue);
            page.add_param(&breath.legato);
        });
        section.add_page("Expression", |page| {
            page.add_param(&expression.vibrato);
            page.add_param(&expression.vibrato_rate);
            page.add_param(&expression.attack);
            page.add_param(&expression.glissando);
            page.add_param(&expression.life);
            page.add_param(&breath.curve);
            page.add_param(&breath.softest);
            page.add_param(&breath.loudest);
        });
        section.add_page("Techniques", |page| {
            page.add_param(&techniques.growl);
            page.add_param(&techniques.growl_interval);
            page.add_param(&techniques.flutter);
            page.add_param(&techniques.flutter_rate);
            page.add_param(&techniques.subtone);
            page.add_param(&techniques.tract);
            page.add_param(&techniques.tract_interval);
            page.add_param(&expression.slap);
        });
        section.add_page("Room", |page| {
            page.add_param(&room.amount);
            page.add_param(&room.size);
            page.add_param(&room.decay);
            page.add_param(&room.tone);
        });
        section.add_page("Players", |page| {
            page.add_param(&players.count);
            page.add_param(&players.split);
            page.add_param(&players.spread);
            page.add_param(&players.onset_spread);
            page.add_param(&players.seats);
        });
        section.add_page("Tuning", |page| {
            page.add_param(&tuning.a4);
            page.add_param(&tuning.tuning);
            page.add_param(&tuning.temperature);
            page.add_param(&tuning.vent_loss);
            page.add_param(&instrument.bend_range);
            page.add_param(&instrument.choice);
            page.add_param(&tuning.transpose);
            page.add_param(&tuning.beyond);
        });
        section.add_page("Listening", |page| {
            page.add_param(&listening.mode);
            page.add_param(&listening.distance);
            page.add_param(&listening.angle);
            page.add_param(&listening.height);
            page.add_param(&listening.width);
        });
    });
    context.add_section("Reed", |section| {
        section.add_page("Reed", |page| {
            page.add_param(&reed.h);
            page.add_param(&reed.k);
            page.add_param(&reed.coupled);
            page.add_param(&reed.a);
            page.add_param(&embouchure.zeta);
            page.add_param(&embouchure.damping);
            page.add_param(&reed.lay);
            page.add_param(&physical.description);
        });
        section.add_page("Reed, physical", |page| {
            page.add_param(&physical.description);
            page.add_param(&physical.stiffness);
            page.add_param(&physical.area);
            page.add_param(&physical.width);
            page.add_param(&physical.opening);
        });
    });
    context.add_section("Knob", |section| {
        section.add_page("Feel", |page| {
            page.add_param(&knob.law);
            page.add_param(&knob.contrast);
            page.add_param(&knob.order);
            page.add_param(&knob.torque);
            page.add_param(&knob.detent);
            page.add_param(&knob.damping);
            page.add_param(&knob.friction);
            page.add_param(&knob.curve);
        });
    });
}

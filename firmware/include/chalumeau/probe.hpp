// The sign probe: before the first arming of a session a few mNm to and fro, to see that the motor turns the knob the way
// the angle counts and that the board's speed has the angle's sign. With a wrong sign every spring would push.
//
// Forth: the torque rises until the knob has moved. Back: the torque rises the other way until the knob has come back from
// the furthest point, so that a knob that coasts is judged too. A hand that drifts moves the knob in one direction only and
// decides nothing. Two rounds; without an answer the knob is not armed.
#pragma once

#include <cstdint>

#include "encoder.hpp"

namespace chalumeau {

/// Torque of the probe, mNm: four times the dry friction of such knobs, a thirtieth of what they can do (judgement).
constexpr float PROBE_MNM = 12.0F;
/// Time in which it rises, s. A free knob of 2e-5 kg m2 has moved far enough at 2 rad/s.
constexpr float PROBE_RISE_S = 0.060F;
/// Time for which one direction is tried, s.
constexpr float PROBE_TRY_S = 0.100F;
/// What counts as moved, rad (0.7 degrees): twice a hand's tremor, and what 12 mNm do to a grip of 0.9 N m/rad.
constexpr float PROBE_MOVE_RAD = 0.0122F;
/// The board's speed, added up over that motion, must reach this share of it to speak for either sign.
constexpr float PROBE_SPEED_SHARE = 0.25F;
constexpr std::uint8_t PROBE_ROUNDS = 2;

enum class Finding : std::uint8_t { Probing, Right, Reversed, SpeedReversed, Unmoved };

class Probe {
  public:
    /// Begins at `counts`; `most_mnm` is what the user and the configuration allow.
    void begin(std::int64_t counts, float most_mnm) {
        most_mnm_ = least(PROBE_MNM, most_mnm);
        rounds_ = 0;
        try_forth(counts);
    }

    /// One tick: judges the motion since the last and sets the torque of this one.
    Finding tick(const Encoder& encoder, float dt_s) {
        elapsed_s_ += dt_s;
        told_rad_ += encoder.told() * dt_s;
        const std::int64_t at = encoder.counts();
        if (forth_) {
            const float moved = encoder.radians(at - from_);
            if (magnitude(moved) >= PROBE_MOVE_RAD) {
                if (told_rad_ * moved < 0.0F && magnitude(told_rad_) > PROBE_SPEED_SHARE * PROBE_MOVE_RAD) {
                    return Finding::SpeedReversed;
                }
                reversed_ = moved < 0.0F;
                forth_ = false;
                furthest_ = at;
                elapsed_s_ = 0.0F;
            } else if (elapsed_s_ > PROBE_TRY_S) {
                return next_round(at);
            }
        } else {
            const bool is_further = reversed_ ? at < furthest_ : at > furthest_;
            furthest_ = is_further ? at : furthest_;
            if (magnitude(encoder.radians(at - furthest_)) >= PROBE_MOVE_RAD) {
                return reversed_ ? Finding::Reversed : Finding::Right;
            }
            if (elapsed_s_ > PROBE_TRY_S) {
                return next_round(at);
            }
        }
        return Finding::Probing;
    }

    /// What neither the torque nor its whole counts may exceed, mNm.
    float most_mnm() const { return most_mnm_; }

    float torque_mnm() const {
        const float size = most_mnm_ * least(1.0F, elapsed_s_ / PROBE_RISE_S);
        return forth_ ? size : -size;
    }

  private:
    void try_forth(std::int64_t counts) {
        forth_ = true;
        from_ = counts;
        elapsed_s_ = 0.0F;
        told_rad_ = 0.0F;
    }
    Finding next_round(std::int64_t counts) {
        if (++rounds_ >= PROBE_ROUNDS) {
            return Finding::Unmoved;
        }
        try_forth(counts);
        return Finding::Probing;
    }

    std::int64_t from_ = 0;
    std::int64_t furthest_ = 0;
    float most_mnm_ = 0.0F;
    float elapsed_s_ = 0.0F;
    float told_rad_ = 0.0F;
    std::uint8_t rounds_ = 0;
    bool forth_ = true;
    bool reversed_ = false;
};

}  // namespace chalumeau

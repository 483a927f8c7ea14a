// Where the knob is and how fast it turns: counts that wrap become a position that does not. Angle and speed come from one
// board and are still doubted: each must agree with the other, and no reading may be further away than a knob can turn.
#pragma once

#include <cstdint>

#include "health.hpp"
#include "law.hpp"

namespace chalumeau {

/// Smoothing of a motor board's own speed before damping uses it: longer ages the damping, shorter lets its steps
/// through (judgement).
constexpr float MOTOR_SPEED_S = 0.001F;
/// Smoothing of the speed from differences of counts: one count a tick is 3.5 rad/s at 3600 counts (judgement).
constexpr float OWN_SPEED_S = 0.005F;
constexpr float RAD_PER_S_PER_RPM = 0.104719755F;

/// A reading that would need this speed is no motion, rad/s: three times the speed at which the motor is switched off.
constexpr float GLITCH_SPEED = 180.0F;
/// So many readings in a row that stay away mean that the encoder counts from another origin now.
constexpr std::uint8_t JUMP_READINGS = 3;
/// Board and counts may differ by this much and this share, rad/s: the ripple of whole counts is 0.3 rad/s, the board's own
/// filter is late by 2 ms, which is 2 rad/s at the 1000 rad/s2 of a quick hand (judgement).
constexpr float SPEED_APART = 1.5F;
constexpr float SPEED_APART_SHARE = 0.5F;
/// Time for which they may differ by more, s: four times the longest filter.
constexpr float APART_S = 0.020F;
/// The board tells a motion of this much, rad (3.4 degrees), and the counts stand still: they are frozen.
constexpr float FROZEN_RAD = 0.06F;
/// Speeds below this are the board's noise at rest, rad/s (2 rpm, judgement).
constexpr float FROZEN_SPEED = 0.2F;

inline float magnitude(float x) { return x < 0.0F ? -x : x; }

/// What became of a reading.
enum class Look : std::uint8_t { Taken, Glitch, Jump };

class Encoder {
  public:
    /// `counts_per_turn` and where the raw reading wraps: 0 for a 32-bit counter, else that many counts.
    Encoder(std::uint32_t counts_per_turn, std::uint32_t wraps_at)
        : per_turn_(counts_per_turn), wraps_at_(static_cast<std::int32_t>(wraps_at)),
          deg_per_count_(360.0F / static_cast<float>(counts_per_turn)) {}

    /// A reading that arrived whole. `rpm` counts only where the board `tells` a speed. A glitch changes nothing; after a
    /// jump the position goes on from where it was.
    Look read(std::int32_t raw, bool tells, float rpm, float dt_s) {
        const float since_s = dt_s + missed_s_;
        std::int32_t delta = begun_ ? difference(raw, last_) : 0;
        Look look = Look::Taken;
        if (!is_motion(delta, since_s)) {
            count_up(glitches_);
            strayed_ = strayed_ > 0 && is_motion(difference(raw, stray_), dt_s) ? static_cast<std::uint8_t>(strayed_ + 1)
                                                                                : std::uint8_t{1};
            stray_ = raw;
            if (strayed_ < JUMP_READINGS) {
                missed_s_ += dt_s;
                return Look::Glitch;
            }
            delta = 0;
            look = Look::Jump;
        }
        strayed_ = 0;
        missed_s_ = 0.0F;
        begun_ = true;
        last_ = raw;
        position_ += delta;
        const float turned = radians(delta);
        own_ += (turned / since_s - own_) * (since_s / (since_s + OWN_SPEED_S));
        const float told = tells ? rpm * RAD_PER_S_PER_RPM : 0.0F;
        motor_ = tells ? motor_ + (told - motor_) * (since_s / (since_s + MOTOR_SPEED_S)) : own_;
        told_ = tells ? told_ + (told - told_) * (since_s / (since_s + OWN_SPEED_S)) : own_;
        compare(delta, told, since_s);
        place();
        return look;
    }

    /// A reading that did not arrive.
    void miss(float dt_s) { missed_s_ = least(missed_s_ + dt_s, 1.0F); }

    /// What the present position shall be called, 0.01 degrees.
    void call(std::int32_t hundredths) {
        const std::int64_t scaled = static_cast<std::int64_t>(hundredths) * per_turn_;
        zero_ = position_ - (scaled + (scaled < 0 ? -18000 : 18000)) / 36000;
        place();
    }

    /// Degrees since zero, for the law; it stops counting at 4,600 turns of 3600 counts, where float ends.
    float degrees() const { return degrees_; }

    /// 0.01 degrees since zero for STATE; saturates at 59,652 turns.
    std::int32_t hundredths() const {
        const std::int64_t value = (position_ - zero_) * 36000 / per_turn_;
        return value > INT32_MAX ? INT32_MAX : (value < INT32_MIN ? INT32_MIN : static_cast<std::int32_t>(value));
    }

    /// Counts over all turns, for differences.
    std::int64_t counts() const { return position_; }
    float radians(std::int64_t counts) const {
        return static_cast<float>(static_cast<std::int32_t>(counts)) * deg_per_count_ * (1.0F / DEG_PER_RAD);
    }

    /// rad/s, smoothed, as the board tells it, or from the counts if it tells none.
    float told() const { return motor_; }

    /// The speed for damping, rad/s. Where board and counts differ, the smaller of the two, and none if they differ in
    /// sign: damping by a wrong speed drives the knob, less damping does not.
    float velocity() const {
        if (!apart()) {
            return motor_;
        }
        if ((motor_ < 0.0F) != (own_ < 0.0F)) {
            return 0.0F;
        }
        return magnitude(motor_) < magnitude(own_) ? motor_ : own_;
    }

    /// The larger of what the board says and what the counts say: a stuck number must not blind the guard.
    float speed() const { return most(magnitude(motor_), magnitude(own_)); }

    /// Board and counts contradict each other, and have done so for too long to be late filters.
    bool contradicts() const { return apart_s_ > APART_S; }

    /// The board tells of motion, the counts stand still.
    bool frozen() const { return magnitude(unmoved_) > FROZEN_RAD; }

    /// Readings that no motion explains, saturating.
    std::uint16_t glitches() const { return glitches_; }

  private:
    std::int32_t difference(std::int32_t raw, std::int32_t from) const {
        auto delta = static_cast<std::int32_t>(static_cast<std::uint32_t>(raw) - static_cast<std::uint32_t>(from));
        if (wraps_at_ > 0) {
            delta %= wraps_at_;
            if (2 * static_cast<std::int64_t>(delta) > wraps_at_) {
                delta -= wraps_at_;
            } else if (2 * static_cast<std::int64_t>(delta) < -static_cast<std::int64_t>(wraps_at_)) {
                delta += wraps_at_;
            }
        }
        return delta;
    }

    bool is_motion(std::int32_t delta, float dt_s) const {
        // One count of rounding at either end.
        const float most_counts = GLITCH_SPEED * dt_s * DEG_PER_RAD / deg_per_count_ + 2.0F;
        return magnitude(static_cast<float>(delta)) <= most_counts;
    }

    bool apart() const { return magnitude(told_ - own_) > SPEED_APART + SPEED_APART_SHARE * magnitude(own_); }

    /// `told` is the board's speed as it came: a filter would go on telling of motion after the knob has stopped.
    void compare(std::int32_t delta, float told, float dt_s) {
        apart_s_ = apart() ? apart_s_ + dt_s : 0.0F;
        if (delta != 0) {
            unmoved_ = 0.0F;
        } else if (magnitude(told) > FROZEN_SPEED) {
            unmoved_ += told * dt_s;
        }
    }

    void place() {
        constexpr std::int64_t FLOAT_EXACT = 1 << 24;
        std::int64_t counts = position_ - zero_;
        counts = counts > FLOAT_EXACT ? FLOAT_EXACT : (counts < -FLOAT_EXACT ? -FLOAT_EXACT : counts);
        degrees_ = static_cast<float>(static_cast<std::int32_t>(counts)) * deg_per_count_;
    }

    std::int64_t position_ = 0;
    std::int64_t zero_ = 0;
    std::int64_t per_turn_;
    std::int32_t wraps_at_;
    std::int32_t last_ = 0;
    std::int32_t stray_ = 0;
    float deg_per_count_;
    float degrees_ = 0.0F;
    float own_ = 0.0F;      // from the counts
    float motor_ = 0.0F;    // the board's, for damping
    float told_ = 0.0F;     // the board's, smoothed like own_, to be compared with it
    float apart_s_ = 0.0F;
    float unmoved_ = 0.0F;  // what the board told while the counts stood still, rad
    float missed_s_ = 0.0F;
    std::uint16_t glitches_ = 0;
    std::uint8_t strayed_ = 0;
    bool begun_ = false;
};

}  // namespace chalumeau

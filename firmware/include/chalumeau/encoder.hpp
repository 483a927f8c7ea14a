// Where the knob is and how fast it turns: counts that wrap become a position that does not.
#pragma once

#include <cstdint>

#include "law.hpp"

namespace chalumeau {

/// Smoothing of a motor board's own speed before damping uses it: longer ages the damping, shorter lets its steps
/// through (judgement).
constexpr float MOTOR_SPEED_S = 0.001F;
/// Smoothing of the speed from differences of counts: one count a tick is 3.5 rad/s at 3600 counts (judgement).
constexpr float OWN_SPEED_S = 0.005F;
constexpr float RAD_PER_S_PER_RPM = 0.104719755F;

class Encoder {
  public:
    /// `counts_per_turn` and where the raw reading wraps: 0 for a 32-bit counter, else that many counts.
    Encoder(std::uint32_t counts_per_turn, std::uint32_t wraps_at)
        : per_turn_(counts_per_turn), wraps_at_(static_cast<std::int32_t>(wraps_at)),
          deg_per_count_(360.0F / static_cast<float>(counts_per_turn)) {}

    /// A good reading. `rpm` counts only where the board `tells` a speed.
    void read(std::int32_t raw, bool tells, float rpm, float dt_s) {
        std::int32_t delta = 0;
        if (begun_) {
            delta = static_cast<std::int32_t>(static_cast<std::uint32_t>(raw) - static_cast<std::uint32_t>(last_));
            if (wraps_at_ > 0) {
                delta %= wraps_at_;
                if (2 * static_cast<std::int64_t>(delta) > wraps_at_) {
                    delta -= wraps_at_;
                } else if (2 * static_cast<std::int64_t>(delta) < -static_cast<std::int64_t>(wraps_at_)) {
                    delta += wraps_at_;
                }
            }
        }
        begun_ = true;
        last_ = raw;
        position_ += delta;
        const float turned = static_cast<float>(delta) * deg_per_count_ * (1.0F / DEG_PER_RAD);
        own_ += (turned / dt_s - own_) * (dt_s / (dt_s + OWN_SPEED_S));
        motor_ = tells ? motor_ + (rpm * RAD_PER_S_PER_RPM - motor_) * (dt_s / (dt_s + MOTOR_SPEED_S)) : own_;
        place();
    }

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

    /// rad/s, smoothed; the motor board's if it has one.
    float velocity() const { return motor_; }

    /// The larger of what the board says and what the counts say: a stuck number must not blind the guard.
    float speed() const {
        const float a = motor_ < 0.0F ? -motor_ : motor_;
        const float b = own_ < 0.0F ? -own_ : own_;
        return most(a, b);
    }

  private:
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
    float deg_per_count_;
    float degrees_ = 0.0F;
    float own_ = 0.0F;
    float motor_ = 0.0F;
    bool begun_ = false;
};

}  // namespace chalumeau

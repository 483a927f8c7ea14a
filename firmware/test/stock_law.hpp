// The stock reed law of the TorqueTuner, said again in plain words from what its public sources do (firmware and wiring
// as documented in `docs/touch.md`); faults included. Counts, one count of angle being 0.1 degrees.
#pragma once

#include <cmath>
#include <cstdint>

#include "../include/pressure_table_values.h"

namespace stock {

constexpr int ANGLE_MAX = 3600;
constexpr int SLAP_AT = -1000;
constexpr int SLAP_FULL_AT = -1500;

struct Knob {
    float h = H_init;
    float k = k_init;
    float scale = 90.0F;  // of 180 counts
    float stretch = 1.0F;
    float damping = 0.0F;

    int last = 0;
    std::int16_t angle_out = 0;  // overflows after 9.1 turns
    std::int16_t state = 0;

    /// The tables times H and over k, as they are: below 0 and past closure too.
    float u(int index) const {
        return (h * rp_table[index] - rp_B_table[index] / k) * static_cast<float>(rp_sgn_table[index]);
    }

    /// One turn of the loop: single-turn angle 0..3599 and speed in, torque counts out.
    int tick(int angle, float rpm) {
        int delta = angle - last;
        if (delta > ANGLE_MAX / 2) {
            delta -= ANGLE_MAX;
        } else if (delta < -ANGLE_MAX / 2) {
            delta += ANGLE_MAX;
        }
        last = angle;
        angle_out = static_cast<std::int16_t>(angle_out + delta);
        state = static_cast<std::int16_t>(state + std::lround(static_cast<float>(delta) * stretch));
        if (angle_out < SLAP_AT) {
            const float value = angle_out < SLAP_FULL_AT ? -1.0F : static_cast<float>(angle_out - SLAP_AT) / 1500.0F;
            return static_cast<int>(std::lround(-scale * value));
        }
        const int index = state < 0 ? 0 : (state > ANGLE_MAX ? ANGLE_MAX : state);
        return static_cast<int>(std::lround(-scale * u(index)) - std::lround(damping * rpm));
    }
};

/// The notebook's form for either sign: odd, so that it closes at -1 as well.
inline float odd_flow(float p, float h, float k) {
    const float size = p < 0.0F ? -p : p;
    const float flow = h * std::sqrt(size) - size * std::sqrt(size) / k;
    return p < 0.0F ? -flow : flow;
}

}  // namespace stock

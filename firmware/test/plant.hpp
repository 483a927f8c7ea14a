// A knob on its motor for tests that close the loop: inertia, friction, encoder of 3600 steps, and a hand's grip.
#pragma once

#include <cmath>

#include "../include/chalumeau/device.hpp"

namespace test {

struct Plant {
    double inertia = 6e-5;   // kg m2
    double damping = 5e-4;   // N m s/rad
    double coulomb = 0.0;    // N m
    double grip = 0.0;       // N m/rad, about `grip_at`
    double grip_damping = 0.0;
    double grip_at = 0.0;    // rad
    int torque_sign = 1;     // -1: the motor turns the other way
    int speed_sign = 1;      // -1: the board's speed has the wrong sign
    int late = 0;            // ticks from reading to torque, 0..3
    double angle = 0.0;      // rad
    double velocity = 0.0;   // rad/s
    double torque[4] = {0.0, 0.0, 0.0, 0.0};

    void read(chalumeau::Reading& reading) const {
        reading.counts = static_cast<std::int32_t>(std::floor(angle * 57.29577951 * 10.0));
        reading.velocity_rpm = static_cast<float>(speed_sign * velocity / 0.1047197551);
    }

    void push(float mnm) {
        for (int i = 3; i > 0; --i) {
            torque[i] = torque[i - 1];
        }
        torque[0] = torque_sign * static_cast<double>(mnm) * 1e-3;
        for (int part = 0; part < 10; ++part) {
            const double driving =
                torque[late] - damping * velocity - grip * (angle - grip_at) - grip_damping * velocity;
            const double free = velocity + driving / inertia * 5e-5;
            const double brake = coulomb / inertia * 5e-5;
            velocity = std::fabs(free) <= brake ? 0.0 : free - std::copysign(brake, free);
            angle += velocity * 5e-5;
        }
    }
};

}  // namespace test

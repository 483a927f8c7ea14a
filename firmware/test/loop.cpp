// The loop closed over a knob nobody holds: whatever `check_feel` accepts comes to rest.

#include <algorithm>

#include "check.hpp"
#include "host.hpp"

using namespace chalumeau;

namespace {

/// A free knob: inertia and viscous damping only, no dry friction, which would hide a limit cycle. Encoder of 3600 steps;
/// torque acts `late` ticks after the reading it was made from.
struct Knob {
    double inertia;
    double damping;
    int late;
    double angle = 0.0;
    double velocity = 0.0;
    double torque[4] = {0.0, 0.0, 0.0, 0.0};

    Reading read() const {
        Reading reading;
        reading.counts = static_cast<std::int32_t>(std::floor(angle * 57.29577951 * 10.0));
        reading.velocity_rpm = static_cast<float>(velocity / 0.1047197551);
        return reading;
    }
    void push(float mnm) {
        for (int i = 3; i > 0; --i) {
            torque[i] = torque[i - 1];
        }
        torque[0] = static_cast<double>(mnm) * 1e-3;
        for (int part = 0; part < 10; ++part) {
            velocity += (torque[late] - damping * velocity) / inertia * 5e-5;
            angle += velocity * 5e-5;
        }
    }
};

struct Rest {
    double rms_deg;
    bool armed;
};

/// Lets go at `start_deg` and looks at the last second of `seconds`: how far it swings about its own straight line, because
/// a weak spring under much friction creeps home for a minute, which is no limit cycle.
Rest let_go(const Feel& feel, double start_deg, double inertia, double damping, int late, int seconds) {
    Config config;
    config.knob_damping_nms = static_cast<float>(damping);
    config.probe_mnm = 0.0F;  // it would begin elsewhere
    test::Bench bench(config);
    Knob knob{inertia, damping, late};
    bench.run(1);
    bench.hello();
    bench.feel(feel);
    CHECK(bench.device.feel().feel_id == feel.feel_id);
    // Carried to its place by hand.
    bench.turn_to(static_cast<std::int32_t>(start_deg * 10.0), 3);
    knob.angle = start_deg / 57.29577951;
    bench.arm(450);
    double sum = 0.0;
    double squares = 0.0;
    double moment = 0.0;
    const int ticks = 2000 * seconds;
    for (int i = 0; i < ticks; ++i) {
        bench.reading = knob.read();
        knob.push(bench.run(1));
        if (i >= ticks - 2000) {
            const double deg = knob.angle * 57.29577951;
            const double at = (i - (ticks - 2000)) - 999.5;
            sum += deg;
            squares += deg * deg;
            moment += deg * at;
        }
    }
    const double mean = sum / 2000.0;
    const double places = 2000.0 * (2000.0 * 2000.0 - 1.0) / 12.0;  // sum of `at` squared
    const double about_line = squares / 2000.0 - mean * mean - moment * moment / places / 2000.0;
    return {std::sqrt(std::max(0.0, about_line)), bench.device.armed()};
}

}  // namespace

CLAIM(every_accepted_feel_lets_a_free_knob_come_to_rest) {
    test::Random random(8);
    double worst = 0.0;
    unsigned long tried = 0;
    unsigned long tripped = 0;
    while (tried < test::options().trials / 250) {
        Feel feel = test::reference_feel();
        feel.feel_id = 77;
        feel.law = static_cast<std::uint8_t>(1 + random.below(2));
        feel.h = random.between(0.5F, 10.0F);
        feel.k = random.between(0.01F, 2.0F);
        feel.scale_mnm = random.between(20.0F, 450.0F);
        feel.stretch = random.between(0.1F, random.below(2) == 0 ? 4.0F : 30.0F);
        feel.offset_deg = random.between(-20.0F, 20.0F);
        feel.a_on_deg = random.between(0.0F, 200.0F);
        feel.wall_deg = random.between(100.0F, 500.0F);
        feel.wall_mnm_per_deg = random.between(0.0F, 34.0F);
        feel.slap_mnm_per_deg = random.between(0.0F, 20.0F);
        feel.damping_mnms = random.below(2) == 0 ? 0.0F : random.between(0.0F, 20.0F);
        feel.friction = static_cast<std::uint16_t>(random.below(2) == 0 ? 0 : random.below(1001));
        feel.detent = static_cast<std::uint16_t>(random.below(100));
        const double damping = 5e-4;
        const double inertia = random.below(2) == 0 ? 2e-5 : 5e-5;  // kg m2: knobs of 4 and 5 cm, about
        if (check_feel(feel, FeelLimits{}).code != Refusal::None) {
            continue;
        }
        ++tried;
        const Rest rest = let_go(feel, static_cast<double>(random.between(-140.0F, 200.0F)), inertia, damping, 0, 12);
        if (!rest.armed) {
            ++tripped;  // let go against a strong law it may pass 60 rad/s: then it is free, and at rest as well
        }
        worst = std::max(worst, rest.rms_deg);
        CHECK(rest.rms_deg < 0.2);
    }
    std::printf("    %lu feels: worst %.4f degrees rms; %lu ended in over-speed\n", tried, worst, tripped);
}

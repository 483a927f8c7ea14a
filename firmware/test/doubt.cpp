// The knob doubts what it senses: signs, speed against counts, glitches, frozen angles, a failing bus, a slow loop.

#include <algorithm>
#include <utility>

#include "../include/chalumeau/calibration.hpp"
#include "../include/chalumeau/i2c.hpp"
#include "check.hpp"
#include "host.hpp"
#include "plant.hpp"

using namespace chalumeau;
using test::Bench;
using test::Plant;

namespace {

/// A feel by lot that a knob with this damping accepts; with all that could drive a knob whose signs are wrong.
Feel accepted_feel(test::Random& random, const FeelLimits& limits) {
    for (;;) {
        Feel feel = test::reference_feel();
        feel.law = static_cast<std::uint8_t>(1 + random.below(2));
        feel.h = random.between(0.5F, 10.0F);
        feel.k = random.between(0.01F, 2.0F);
        feel.scale_mnm = random.between(20.0F, 450.0F);
        feel.stretch = random.between(0.1F, random.below(2) == 0 ? 4.0F : 30.0F);
        feel.wall_deg = random.between(100.0F, 500.0F);
        feel.wall_mnm_per_deg = random.between(0.0F, 30.0F);
        feel.slap_mnm_per_deg = random.between(0.0F, 20.0F);
        feel.damping_mnms = random.below(2) == 0 ? 20.0F : random.between(0.0F, 20.0F);
        feel.friction = static_cast<std::uint16_t>(random.below(2) == 0 ? 1000 : random.below(1001));
        feel.detent = static_cast<std::uint16_t>(random.below(100));
        if (check_feel(feel, limits).code == Refusal::None) {
            return feel;
        }
    }
}

/// Bench and plant in one loop; the fastest it turned, rad/s.
double closed(Bench& bench, Plant& plant, int ticks) {
    double fastest = 0.0;
    for (int i = 0; i < ticks; ++i) {
        plant.read(bench.reading);
        plant.push(bench.run(1));
        fastest = std::max(fastest, std::fabs(plant.velocity));
    }
    return fastest;
}

Config probing(float damping) {
    Config config;
    config.knob_damping_nms = damping;
    return config;
}

/// Greets, feels, and stands where the plant is.
void begin(Bench& bench, Plant& plant, const Feel& feel) {
    bench.run(1);
    bench.hello();
    bench.feel(feel);
    const std::int32_t at = static_cast<std::int32_t>(std::floor(plant.angle * 57.29577951 * 10.0));
    bench.turn_to(at, 3);
}

bool has(const Bench& bench, EventKind kind, Cause cause) {
    return std::any_of(bench.events.begin(), bench.events.end(), [&](const Event& event) {
        return event.kind == static_cast<std::uint8_t>(kind) && event.code == static_cast<std::uint8_t>(cause);
    });
}

}  // namespace

CLAIM(probe_with_a_wrong_sign_of_torque_or_speed_nothing_arms_and_the_knob_stays_below_10_rad_per_s) {
    test::Random random(21);
    double fastest = 0.0;
    for (int trial = 0; trial < 1000; ++trial) {
        const float damping = random.between(2e-4F, 2e-3F);
        Plant plant;
        plant.inertia = static_cast<double>(random.between(2e-5F, 1e-4F));
        plant.damping = static_cast<double>(damping);
        plant.coulomb = static_cast<double>(random.between(0.0F, 3e-3F));
        plant.late = static_cast<int>(random.below(2));
        plant.angle = static_cast<double>(random.between(-2.0F, 4.0F));
        const int which = trial % 3;  // torque, speed, both
        plant.torque_sign = which == 1 ? 1 : -1;
        plant.speed_sign = which == 0 ? 1 : -1;
        Bench bench(probing(damping));
        begin(bench, plant, accepted_feel(random, bench.device.allowed()));
        bench.arm(450);
        CHECK((bench.device.state().flags & flag::PROBING) != 0 && !bench.device.armed());
        fastest = std::max(fastest, closed(bench, plant, 2000));
        CHECK(!bench.device.armed() && bench.run(1) == 0.0F);
        CHECK(bench.disarmed_by(which == 0 ? Cause::Sign : Cause::Speed));
        // Another try finds the same.
        bench.arm(450);
        fastest = std::max(fastest, closed(bench, plant, 2000));
        CHECK(!bench.device.armed());
    }
    std::printf("    1000 knobs with wrong signs: at most %.1f rad/s\n", fastest);
    CHECK(fastest < 10.0 && fastest > 0.5);
}

CLAIM(probe_a_knob_with_right_signs_arms_free_or_in_a_hand_and_once_a_session) {
    test::Random random(22);
    int longest = 0;
    double furthest = 0.0;
    for (int trial = 0; trial < 400; ++trial) {
        const float damping = random.between(2e-4F, 2e-3F);
        Plant plant;
        plant.inertia = static_cast<double>(random.between(2e-5F, 1e-4F));
        plant.damping = static_cast<double>(damping);
        plant.coulomb = static_cast<double>(random.between(0.0F, 3e-3F));
        plant.late = 1;
        if (trial % 2 == 1) {
            plant.grip = static_cast<double>(random.between(0.05F, 0.5F));
            plant.grip_damping = 0.01;
        }
        Bench bench(probing(damping));
        begin(bench, plant, Feel{});
        bench.arm(450);
        int ticks = 0;
        while (!bench.device.armed() && ticks < 1000) {
            closed(bench, plant, 1);
            ++ticks;
            furthest = std::max(furthest, std::fabs(plant.angle));
        }
        CHECK(bench.device.armed());
        longest = std::max(longest, ticks);
        bench.send(Type::Free, Payload{});
        closed(bench, plant, 2000);
        bench.arm(450);
        CHECK(bench.device.armed());  // at once
        bench.hello(test::SESSION + 1);
        closed(bench, plant, 100);
        bench.arm(450, test::SESSION + 1);
        CHECK(!bench.device.armed() && (bench.device.state().flags & flag::PROBING) != 0);
    }
    std::printf("    armed after at most %.0f ms, moved by at most %.1f degrees\n", 0.5 * longest, furthest * 57.3);
    CHECK(longest < 400 && furthest * 57.3 < 15.0);
}

CLAIM(probe_a_knob_that_does_not_move_is_not_armed_and_says_so) {
    Plant plant;
    plant.grip = 20.0;
    plant.grip_damping = 0.05;
    Bench bench(probing(5e-4F));
    begin(bench, plant, test::reference_feel());
    bench.arm(450);
    float most = 0.0F;
    float most_given = 0.0F;
    CountRounding rounding;
    for (int i = 0; i < 2000; ++i) {
        plant.read(bench.reading);
        const float torque = bench.run(1);
        most = std::max(most, std::fabs(torque));
        const std::int16_t counts = rounding.counts(torque, bench.device.ceiling_mnm(), MOTEUS_UNIT);
        most_given = std::max(most_given, std::fabs(mnm_of(counts, MOTEUS_UNIT)));
        plant.push(torque);
    }
    CHECK(most > 11.0F && most <= PROBE_MNM);
    // Counts of 4.8 mNm: rounding must not add what the probe may not use.
    CHECK(most_given > 9.0F && most_given <= PROBE_MNM);
    CHECK(bench.refused(Refusal::Unmoved) && !bench.device.armed() && bench.run(1) == 0.0F);
}

CLAIM(probe_ends_with_the_host_and_keeps_the_ceiling) {
    for (int way = 0; way < 4; ++way) {
        Plant plant;
        plant.grip = 20.0;
        Bench bench(probing(5e-4F));
        begin(bench, plant, Feel{});
        bench.ceiling_mnm = 5;
        bench.arm(5);
        float most = 0.0F;
        for (int i = 0; i < 60; ++i) {
            plant.read(bench.reading);
            most = std::max(most, std::fabs(bench.run(1)));
        }
        CHECK(most == 5.0F);
        if (way == 0) {
            bench.send(Type::Free, Payload{});
        } else if (way == 1) {
            bench.reading.stop = true;
        } else if (way == 2) {
            bench.beats = false;
            bench.run(160);
        } else {
            bench.reading.bus_ok = false;
            bench.run(2);
        }
        CHECK(bench.run(1) == 0.0F && bench.run(1) == 0.0F && !bench.device.armed());
        CHECK((bench.device.state().flags & flag::PROBING) == 0);
    }
}

CLAIM(doubt_a_speed_whose_sign_turns_while_armed_stays_below_10_rad_per_s_and_is_a_fault) {
    test::Random random(23);
    double fastest = 0.0;
    int faults = 0;
    for (int trial = 0; trial < 1000; ++trial) {
        const float damping = random.between(2e-4F, 2e-3F);
        Plant plant;
        plant.inertia = static_cast<double>(random.between(2e-5F, 1e-4F));
        plant.damping = static_cast<double>(damping);
        plant.late = static_cast<int>(random.below(2));
        plant.speed_sign = -1;
        Config config = probing(damping);
        config.probe_mnm = 0.0F;
        Bench bench(config);
        // At rest at the origin, where no law pushes: what turns it is the wrong sign alone.
        Feel feel = accepted_feel(random, bench.device.allowed());
        begin(bench, plant, feel);
        bench.arm(450);
        plant.velocity = 0.3;
        fastest = std::max(fastest, closed(bench, plant, 3000));
        faults += has(bench, EventKind::Fault, Cause::Speed) ? 1 : 0;
    }
    std::printf("    1000 feels with the speed reversed: at most %.1f rad/s, %d faults\n", fastest, faults);
    CHECK(fastest < 10.0);
}

CLAIM(doubt_a_speed_of_the_wrong_sign_is_a_fault_after_20_ms) {
    Bench bench;
    bench.ready(test::reference_feel(), 300);
    bench.counts_per_tick = 2;  // 7 rad/s
    bench.reading.velocity_rpm = -2.0F * 33.3333F;
    int ticks = 0;
    while (bench.device.state().fault == 0 && ticks < 200) {
        bench.run(1);
        ++ticks;
    }
    std::printf("    noticed after %.1f ms\n", 0.5 * ticks);
    CHECK(bench.device.fault() == Cause::Speed && ticks >= 40 && ticks <= 50);
    bench.run(110);
    CHECK(bench.run(1) == 0.0F && bench.disarmed_by(Cause::Speed));
}

CLAIM(doubt_a_quick_hand_is_no_fault) {
    // To and fro at 12 Hz by 40 degrees, up to 53 rad/s; the board's speed is late by a filter of 100 Hz.
    Bench bench;
    bench.ready(Feel{}, 0);
    double filtered = 0.0;
    for (int i = 0; i < 20000; ++i) {
        const double t = i * 5e-4;
        const double amplitude = 0.7 * std::min(1.0, t);
        const double angle = amplitude * std::sin(6.2831853 * 12.0 * t);
        const double speed = amplitude * 6.2831853 * 12.0 * std::cos(6.2831853 * 12.0 * t);
        filtered += (speed - filtered) * (1.0 - std::exp(-6.2831853 * 100.0 * 5e-4));
        bench.reading.counts = static_cast<std::int32_t>(std::floor(angle * 572.957795));
        bench.reading.velocity_rpm = static_cast<float>(filtered / 0.1047197551);
        bench.run(1);
    }
    CHECK(bench.device.armed() && bench.device.glitches() == 0);
}

CLAIM(doubt_a_glitch_changes_nothing_and_is_counted) {
    for (int size : {-1800, -170, 170, 110, 1799, 40000000}) {
        Bench bench;
        bench.ready(test::reference_feel(), 1200);
        const float before = bench.run(1);
        for (int burst = 1; burst <= 2; ++burst) {
            const std::uint16_t glitches = bench.device.glitches();
            const std::int32_t at = bench.reading.counts;
            bench.reading.counts = at + size;
            for (int i = 0; i < burst; ++i) {
                CHECK(bench.run(1) == before && bench.device.angle_deg() == 120.0F);
            }
            bench.reading.counts = at;
            bench.run(40);
            CHECK(bench.run(1) == before && bench.device.armed());
            CHECK(bench.device.glitches() == glitches + burst);
        }
    }
}

CLAIM(doubt_a_jump_ends_torque_and_the_position_goes_on_from_where_it_was) {
    Bench bench;
    bench.ready(test::reference_feel(), 1200);
    bench.reading.counts += 1000;
    bench.run(3);
    CHECK(bench.device.fault() == Cause::Angle && bench.device.angle_deg() == 120.0F);
    bench.run(110);
    CHECK(bench.run(1) == 0.0F && bench.disarmed_by(Cause::Angle));
    bench.turn_to(bench.reading.counts + 100);
    CHECK(bench.state.angle == 13000);
    bench.arm();
    CHECK(bench.device.armed());
}

CLAIM(doubt_a_frozen_angle_is_noticed_within_200_ms_of_motion) {
    int longest = 0;
    for (float speed = 0.3F; speed < 55.0F; speed *= 1.1F) {
        for (float sign : {-1.0F, 1.0F}) {
            Bench bench;
            bench.ready(test::reference_feel(), 600);
            bench.reading.velocity_rpm = sign * speed / 0.1047197551F;
            int ticks = 0;
            while (bench.device.state().fault == 0 && ticks < 1000) {
                bench.run(1);
                ++ticks;
            }
            longest = std::max(longest, ticks);
            CHECK(bench.device.fault() == Cause::Angle || bench.device.fault() == Cause::Speed);
        }
    }
    std::printf("    noticed after at most %.0f ms\n", 0.5 * longest);
    CHECK(longest <= 420);  // 200 ms and the filter of the speed
    // A board whose speed is off by less than its noise at rest is no fault.
    Bench still;
    still.ready(test::reference_feel(), 600);
    still.reading.velocity_rpm = 1.8F;
    still.run(20000);
    CHECK(still.device.armed());
}

CLAIM(doubt_a_bus_that_fails_two_times_of_three_is_a_fault_and_one_of_six_is_counted) {
    const auto bus = [](int period, int bad, int ticks) {
        Bench bench;
        bench.ready(test::reference_feel(), 1200);
        int until_fault = -1;
        for (int i = 0; i < ticks; ++i) {
            bench.reading.bus_ok = i % period >= bad;
            bench.run(1);
            if (until_fault < 0 && bench.device.state().fault != 0) {
                until_fault = i;
            }
        }
        bench.run(8);
        return std::pair<int, int>(until_fault, bench.device.bus_errors());
    };
    const auto two_of_three = bus(3, 2, 2000);
    CHECK(two_of_three.first >= 0 && two_of_three.first < 60);
    const auto one_of_three = bus(3, 1, 2000);
    CHECK(one_of_three.first >= 0 && one_of_three.first < 200);
    const auto one_of_six = bus(6, 1, 12000);
    CHECK(one_of_six.first < 0 && one_of_six.second == 2000);
}

CLAIM(doubt_a_loop_slower_than_the_limits_assume_is_a_fault_and_late_ticks_are_counted) {
    const auto loop = [](std::uint32_t period_us, int pause_every) {
        Bench bench;
        bench.ready(test::reference_feel(), 1200);
        for (int i = 0; i < 2000; ++i) {
            bench.t_us += period_us - 500;
            if (pause_every > 0 && i % pause_every == 0) {
                bench.t_us += 5000;
            }
            bench.alive();
            bench.tick();
        }
        bench.hello();
        bench.tick();
        return std::pair<bool, int>(bench.device.armed(), bench.info.overruns);
    };
    CHECK(loop(500, 0) == std::make_pair(true, 0));
    CHECK(loop(590, 0).first);
    CHECK(!loop(620, 0).first);
    CHECK(!loop(1000, 0).first && loop(1000, 0).second > 100);
    // A pause of 5 ms ten times a second is late ticks, no slow loop.
    CHECK(loop(500, 200) == std::make_pair(true, 10));
}

CLAIM(stop_is_free_within_its_tick_and_no_arming_while_it_is_pressed) {
    Bench bench;
    bench.ready(test::reference_feel(), 1200);
    CHECK(bench.run(1) < -89.0F);
    bench.reading.stop = true;
    CHECK(bench.run(1) == 0.0F && !bench.device.armed() && bench.disarmed_by(Cause::Stop));
    CHECK((bench.device.state().flags & flag::FAULT) != 0);
    bench.arm();
    bench.run(1);
    CHECK(bench.refused(Refusal::Fault) && !bench.device.armed());
    bench.reading.stop = false;
    CHECK(bench.run(2000) == 0.0F && !bench.device.armed());
    bench.arm();
    CHECK(bench.device.armed());
}

CLAIM(a_refused_feel_never_clears_a_fault) {
    Bench bench;
    bench.ready(test::reference_feel(), 1200);
    Feel nan = test::reference_feel();
    nan.scale_mnm = NAN;
    bench.feel(nan);
    bench.run(110);
    CHECK(bench.device.fault() == Cause::NotFinite && !bench.device.armed());
    Feel refused[5] = {test::reference_feel(), test::reference_feel(), test::reference_feel(), test::reference_feel(),
                       test::reference_feel()};
    refused[0].law = 9;
    refused[1].wall_mnm_per_deg = 90.0F;
    refused[2].h = 0.1F;
    refused[3].scale_mnm = 451.0F;
    refused[4].h = SLIP_H;
    refused[4].k = SLIP_K;
    for (const Feel& feel : refused) {
        bench.feel(feel);
        bench.run(1);
        bench.arm();
        bench.run(1);
        CHECK(bench.refused(Refusal::Fault) && !bench.device.armed() && bench.device.fault() == Cause::NotFinite);
    }
    // Nor does another host.
    bench.hello(test::SESSION + 1);
    bench.arm(450, test::SESSION + 1);
    CHECK(!bench.device.armed());
    bench.hello();
    bench.feel(test::reference_feel());
    bench.run(1);
    bench.arm();
    CHECK(bench.device.armed());
}

CLAIM(an_uncalibrated_knob_makes_50_mnm_at_most_and_says_so) {
    Config config = test::damped();
    config.calibrated = false;
    Bench bench(config);
    bench.run(1);
    bench.hello();
    bench.run(1);
    CHECK(bench.info.ceiling_mnm == 50 && (bench.info.capabilities & capability::CALIBRATED) == 0);
    Bench measured;
    measured.run(1);
    measured.hello();
    measured.run(1);
    CHECK(measured.info.ceiling_mnm == 450 && (measured.info.capabilities & capability::CALIBRATED) != 0);
}

CLAIM(calibration_comes_back_and_any_bit_changed_is_none) {
    Calibration stored;
    stored.damping_nms = 1.2e-3F;
    stored.mnm_per_count = 0.52F;
    stored.torque_sign = -1;
    stored.rpm_per_unit = -60.0F;
    std::uint8_t bytes[CALIBRATION_SIZE];
    stored.encode(bytes);
    Calibration read;
    CHECK(read.decode(bytes, sizeof bytes));
    CHECK(read.damping_nms == 1.2e-3F && read.mnm_per_count == 0.52F && read.torque_sign == -1 && read.rpm_per_unit == -60.0F);
    for (std::size_t bit = 0; bit < 8 * sizeof bytes; ++bit) {
        std::uint8_t damaged[CALIBRATION_SIZE];
        std::memcpy(damaged, bytes, sizeof bytes);
        damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1U << (bit % 8)));
        Calibration other;
        CHECK(!other.decode(damaged, sizeof damaged) && other.torque_sign == 1);
    }
    CHECK(!read.decode(bytes, sizeof bytes - 1));
    std::uint8_t empty[CALIBRATION_SIZE] = {};
    CHECK(!read.decode(empty, sizeof empty));
    // A checksum does not make sense of nonsense.
    for (int kind = 0; kind < 5; ++kind) {
        Calibration odd;
        odd.rpm_per_unit = kind == 4 ? 0.0F : 1.0F;
        odd.damping_nms = kind == 0 ? NAN : (kind == 1 ? 1.0F : 1e-3F);
        odd.mnm_per_count = kind == 2 ? 0.0F : 4.8F;
        odd.torque_sign = kind == 3 ? std::int8_t{0} : std::int8_t{1};
        odd.encode(bytes);
        CHECK(!odd.is_sane() && !read.decode(bytes, sizeof bytes));
    }
}

// The ten faults of the stock firmware (`docs/touch.md` lists them), each against the stock law said again in
// `stock_law.hpp`: equal where it is right, and the documented difference where it is not.

#include <algorithm>

#include "../include/chalumeau/i2c.hpp"
#include "check.hpp"
#include "host.hpp"
#include "stock_law.hpp"

using namespace chalumeau;

namespace {

/// Brings the stock knob to a count, slowly enough for it.
int stock_at(stock::Knob& knob, int count) {
    int torque = 0;
    while (knob.angle_out != count) {
        const int to = knob.angle_out + (count > knob.angle_out ? 1 : -1);
        torque = knob.tick(((to % 3600) + 3600) % 3600, 0.0F);
    }
    return torque;
}

}  // namespace

/// The reference setting: stretch 1, scale 90 of 180 counts. In our units a count may be anything; here it is 1 mNm.
CLAIM(integer_torque_is_the_stock_firmwares_at_every_tenth_of_a_degree_but_the_first_six_degrees) {
    stock::Knob knob;
    stock_at(knob, -1001);
    const TorqueUnit unit{1.0F, 450.0F};
    test::Bench bench;
    Feel feel = test::reference_feel();
    feel.slap_mnm_per_deg = 90.0F / 150.0F;
    bench.reading.has_velocity = false;
    bench.ready(feel, -1000);
    int compared = 0;
    int differ_inside = 0;
    int most_inside = 0;
    for (int count = -1000; count <= 3600; ++count) {
        const int wanted = stock_at(knob, count);
        // The law alone, and through the whole device, tick after tick.
        const int alone = counts_of(Curve(feel).at_rest(0.1F * static_cast<float>(count)), unit);
        bench.reading.counts = count;
        const int through = counts_of(bench.run(1), unit);
        CHECK(alone == through);
        if (count > 0 && count < 60) {
            const int off = std::abs(alone - wanted);
            differ_inside += off > 0 ? 1 : 0;
            most_inside = std::max(most_inside, off);
        } else {
            ++compared;
            if (alone != wanted) {
                CHECK(alone == wanted);
                std::printf("    at %d: %d, stock %d\n", count, alone, wanted);
            }
        }
    }
    std::printf(
        "    %d of %d angles compared equal; of the 59 between 0 and 6 degrees %d differ, by at most %d counts\n",
        compared, 4601 - 59, differ_inside, most_inside);
    CHECK(compared == 4601 - 59 && differ_inside > 0 && most_inside <= 7);
}

CLAIM(fault_1_the_slip_of_the_notebook_is_refused_and_no_pair_reverses_past_closure) {
    stock::Knob slipped;
    slipped.h = std::sqrt(13.5F);
    slipped.k = 27.0F / (4.0F * slipped.h * slipped.h * slipped.h);
    CHECK(std::fabs(slipped.u(3600) + 3.67F) < 0.01F);  // the torque reverses
    CHECK(stock_at(slipped, 3600) == 331);
    Feel feel = test::reference_feel();
    feel.h = slipped.h;
    feel.k = slipped.k;
    const Verdict verdict = check_feel(feel, FeelLimits{});
    CHECK(verdict.code == Refusal::Closure && std::fabs(verdict.value - 0.5F) < 1e-4F);
    for (float typed : {3.6742F, 3.67423F, 3.674235F}) {
        feel.h = typed;
        feel.k = 0.13608F;
        CHECK(check_feel(feel, FeelLimits{}).code == Refusal::Closure);
    }
    // A hair beside it is an honest choice, harmless because nothing pushes past closure.
    test::Random random(5);
    for (int trial = 0; trial < 3000; ++trial) {
        feel.h = random.between(0.5F, 10.0F);
        feel.k = random.between(0.01F, 10.0F / feel.h);
        const Curve curve(feel);
        for (int i = 0; i < 400; ++i) {
            CHECK(curve.at_rest(static_cast<float>(i)) <= 0.0F);
        }
        const float peak_at = curve.closure_deg() / 3.0F;
        const float peak = std::sqrt(4.0F * feel.h * feel.h * feel.h * feel.k / 27.0F);
        if (peak_at < 400.0F) {
            CHECK(std::fabs(curve.at_rest(peak_at) + 90.0F * peak) < 1e-3F * 90.0F * peak + 1e-3F);
        }
    }
}

CLAIM(fault_2_a_negative_pressure_opens_the_reed_instead_of_closing_it) {
    CHECK(std::fabs(stock::odd_flow(-1.0F, H_init, k_init)) < 1e-6F);  // the notebook's closes at -1
    for (float p : {0.01F, 0.3F, 1.0F, 2.0F, 9.0F}) {
        const float wanted = -(H_init * std::sqrt(p) + p * std::sqrt(p) / k_init);
        CHECK(std::fabs(physical_flow(-3600.0F * p, H_init, k_init) - wanted) < 1e-4F * -wanted);
    }
    CHECK(physical_flow(3700.0F, H_init, k_init) == 0.0F);
    CHECK(physical_flow(1200.0F, H_init, k_init) == seed_flow(1200, H_init, k_init));
}

CLAIM(fault_3_the_slap_region_does_not_jump_and_its_event_tells_the_peak_speed) {
    stock::Knob knob;
    CHECK(stock_at(knob, -1500) == 30 && stock_at(knob, -1501) == 90);  // from a third to all of it
    Feel feel = test::reference_feel();
    feel.slap_mnm_per_deg = 90.0F / 150.0F;
    const Curve curve(feel);
    for (int count = -1000; count >= -1500; --count) {
        // Equal to the stock's as far as that is right.
        stock::Knob there = knob;
        CHECK(counts_of(curve.at_rest(0.1F * static_cast<float>(count)), TorqueUnit{1.0F, 450.0F}) ==
              stock_at(there, count));
    }
    for (int count = -990; count > -4000; --count) {
        const float jump =
            curve.at_rest(0.1F * static_cast<float>(count)) - curve.at_rest(0.1F * static_cast<float>(count + 1));
        CHECK(jump >= 0.0F && jump < 0.07F);
    }
    CHECK(curve.at_rest(-399.0F) == 90.0F);
    // An origin below zero takes the region with it, so that law and slap spring never work against each other.
    Feel moved = feel;
    moved.offset_deg = -150.0F;
    CHECK(Curve(moved).at_rest(-249.9F) == 0.0F && Curve(moved).at_rest(-251.0F) > 0.5F);
    moved.offset_deg = 150.0F;
    CHECK(Curve(moved).at_rest(-99.9F) == 0.0F && Curve(moved).at_rest(-101.0F) > 0.5F);
    // In and out, fast in between.
    test::Bench bench;
    bench.ready(feel, -950);
    const std::uint8_t before = bench.state.slaps;
    bench.turn_to(-1300, 9);
    CHECK((bench.state.flags & flag::SLAP) != 0);
    CHECK(bench.last(EventKind::Slap) == nullptr);
    bench.turn_to(-900, 2);
    const Event* slap = bench.last(EventKind::Slap);
    CHECK(slap != nullptr && bench.state.slaps == static_cast<std::uint8_t>(before + 1));
    const float speed = 9.0F * 2000.0F / 3600.0F * 6.2831853F;
    CHECK(slap != nullptr && std::fabs(slap->value - speed) < 0.02F * speed);
    CHECK((bench.state.flags & flag::SLAP) == 0);
    // A hand that trembles at the edge slaps once, when it has left.
    bench.turn_to(-1005, 2);
    for (int i = 0; i < 20; ++i) {
        bench.turn_to(i % 2 == 0 ? -995 : -1005, 2);
    }
    CHECK(bench.state.slaps == static_cast<std::uint8_t>(before + 1));
    bench.turn_to(-900, 2);
    CHECK(bench.state.slaps == static_cast<std::uint8_t>(before + 2));
    // A zero that is set within the region is no way out of it.
    bench.turn_to(-1300, 9);
    bench.send(Type::Free, Payload{});
    bench.run(1);
    bench.send(Type::Zero, Zero{0}.encode());
    bench.run(1);
    bench.turn_to(-1200, 2);
    CHECK(bench.state.angle > 900 && bench.state.slaps == static_cast<std::uint8_t>(before + 2));
}

CLAIM(fault_4_a_knob_let_go_past_closure_meets_a_wall) {
    stock::Knob knob;
    CHECK(stock_at(knob, 3600) == 0 && stock_at(knob, 9000) == 0);
    const Curve curve(test::reference_feel());
    CHECK(curve.at_rest(361.0F) == 0.0F && curve.at_rest(399.9F) == 0.0F);
    CHECK(std::fabs(curve.at_rest(404.5F) + 90.0F) < 1e-3F);
}

CLAIM(fault_5_slow_motion_counts_and_the_way_there_does_not_matter) {
    // Stretch 0.4: the stock index stands still when the knob creeps, and jumps ahead when it hurries.
    stock::Knob creeping;
    creeping.stretch = 0.4F;
    stock_at(creeping, 1200);
    CHECK(creeping.state == 0);
    stock::Knob hurrying;
    hurrying.stretch = 0.4F;
    for (int count = 0; count <= 1200; count += 4) {
        hurrying.tick(count, 0.0F);
    }
    CHECK(hurrying.state == 600);
    Feel feel = test::reference_feel();
    feel.stretch = 0.4F;
    test::Bench slow;
    slow.ready(feel);
    slow.turn_to(1200, 1);
    test::Bench fast;
    fast.ready(feel);
    fast.turn_to(2000, 9);
    fast.turn_to(1200, 7);
    const float u = static_cast<float>(rp_table[480]) * H_init - rp_B_table[480] / k_init;
    CHECK(slow.run(1) == fast.run(1));
    CHECK(std::fabs(slow.run(1) + 90.0F * u) < 0.01F);
}

CLAIM(fault_6_no_number_of_turns_overflows_a_law_change_keeps_the_angle_and_an_unknown_law_is_refused) {
    stock::Knob knob;
    for (int count = 0; count <= 33000; count += 100) {
        knob.tick(count % 3600, 0.0F);
    }
    CHECK(knob.angle_out < 0);  // after 9.1 turns
    test::Bench bench;
    bench.run(1);
    bench.turn_to(3600 * 500, 16);
    CHECK(bench.state.angle == 500 * 36000);
    // Across the end of the 32-bit counter of the encoder, and far beyond it.
    Encoder encoder(3600, 0);
    std::uint32_t raw = 0x7FFFFF00U;
    encoder.read(static_cast<std::int32_t>(raw), true, 0.0F, 5e-4F);
    for (int i = 0; i < 5000000; ++i) {
        raw += 50;
        encoder.read(static_cast<std::int32_t>(raw), true, 0.0F, 5e-4F);
    }
    CHECK(encoder.hundredths() == INT32_MAX);  // 2.5e9 hundredths saturate
    for (int i = 0; i < 5000000; ++i) {
        raw -= 50;
        encoder.read(static_cast<std::int32_t>(raw), true, 0.0F, 5e-4F);
    }
    CHECK(encoder.hundredths() == 0 && encoder.degrees() == 0.0F);
    // A single-turn encoder, both ways round.
    Encoder single(3600, 3600);
    std::int32_t angle = 0;
    for (int turn = 0; turn < 20 * 90; ++turn) {
        single.read(angle, true, 0.0F, 5e-4F);
        angle = (angle + 3560) % 3600;
    }
    CHECK(single.hundredths() == -40 * (20 * 90 - 1) * 10);
    CHECK(encoder.glitches() == 0 && single.glitches() == 0);
    // A change of law under the hand.
    test::Bench held;
    held.ready(test::reference_feel(), 800);
    const std::int32_t before = held.state.angle;
    Feel other = test::pressure_feel();
    held.feel(other);
    held.run(200);
    CHECK(held.state.angle == before && before == 8000);
    other.law = 9;
    held.feel(other);
    held.run(10);
    CHECK(held.refused(Refusal::Law) && held.device.feel().law == 2);
    // Index 3600 of a table of 3601 is its last entry, and nothing behind it is read.
    CHECK(sizeof rp_table == 3601 * sizeof(float) && sizeof rp_B_table == sizeof rp_table);
    CHECK(table_at(rp_table, 3600.0F) == 1.0F && table_at(rp_table, 3599.9998F) <= 1.0F);
}

namespace {

/// A knob nobody holds: inertia, the given damping of its own, no dry friction (worst case), steps of its encoder.
/// `law` gives mNm. Peak to peak in degrees over the last second of five.
template <typename LawOf>
double swings(LawOf law, double damping, double start_deg) {
    const double inertia = 5e-5;  // kg m2, of a 5 cm knob on a small motor
    double angle = start_deg / 57.29578;
    double velocity = 0.0;
    double torque = 0.0;
    double low = 1e9;
    double high = -1e9;
    for (int tick = 0; tick < 10000; ++tick) {
        const double felt = std::round(angle * 57.29578 * 10.0) * 0.1;
        torque = law(static_cast<float>(felt), static_cast<float>(velocity));
        for (int part = 0; part < 50; ++part) {
            velocity += (torque * 1e-3 - damping * velocity) / inertia * 1e-5;
            angle += velocity * 1e-5;
        }
        if (tick > 8000) {
            low = std::min(low, angle * 57.29578);
            high = std::max(high, angle * 57.29578);
        }
    }
    return high - low;
}

}  // namespace

CLAIM(fault_7_a_spring_from_both_sides_without_end_of_slope_swings_and_the_regularised_one_does_not) {
    // The notebook's odd law at full scale holds the origin from both sides; its slope there has no end.
    const auto odd = [](float deg, float) {
        return static_cast<double>(-180.0F * stock::odd_flow(deg / 360.0F, H_init, k_init));
    };
    Feel feel = test::reference_feel();
    feel.scale_mnm = 180.0F;
    const Curve curve(feel);
    const auto regular = [&](float deg, float) {
        return static_cast<double>(deg < 0.0F ? -curve.at_rest(-deg) : curve.at_rest(deg));
    };
    const double stock = swings(odd, 5e-4, 3.0);
    const double ours = swings(regular, 5e-4, 3.0);
    std::printf("    at scale 180, from both sides: stock %.2f degrees peak to peak, regularised %.2f\n", stock, ours);
    CHECK(stock > 0.8);
    CHECK(ours < 0.2);
}

CLAIM(fault_8_torque_is_mnm_and_a_board_says_what_it_clips) {
    CHECK(std::fabs(MOTEUS_UNIT.mnm_per_count - 4.8077F) < 1e-3F);
    CHECK(counts_of(99.9F, MOTEUS_UNIT) == 21 && counts_of(450.0F, MOTEUS_UNIT) == counts_of(100.0F, MOTEUS_UNIT));
    // The stock curve of 90 counts is cut to 20.8 from about 3 to 328 degrees: what the player is meant to feel is gone.
    int first = -1;
    int last = -1;
    stock::Knob knob;
    for (int index = 0; index <= 3600; ++index) {
        if (90.0F * knob.u(index) * MOTEUS_UNIT.mnm_per_count > MOTEUS_UNIT.clips_at_mnm) {
            first = first < 0 ? index : first;
            last = index;
        }
    }
    std::printf("    the stock board clips from %.1f to %.1f degrees\n", 0.1 * first, 0.1 * last);
    CHECK(first == 29 && last == 3263);
    // Ours declares its ceiling instead, and refuses a scale beyond it.
    Config config = test::damped();
    config.ceiling_mnm = 100;
    test::Bench bench(config);
    bench.run(1);
    bench.hello();
    bench.run(1);
    CHECK(bench.info.ceiling_mnm == 100);
    Feel feel = test::reference_feel();
    feel.scale_mnm = 120.0F;
    bench.feel(feel);
    bench.run(1);
    CHECK(bench.refused(Refusal::Scale) && bench.last(EventKind::Refused)->value == 120.0F);
}

CLAIM(fault_9_every_silence_ends_in_no_torque) {
    // The stock board holds its last torque over an I2C error; see session.cpp for all the others.
    test::Bench bench;
    bench.ready(test::reference_feel(), 1200);
    CHECK(bench.run(1) < -89.0F);
    bench.reading.bus_ok = false;
    CHECK(bench.run(2) < -89.0F);  // two failures are weather
    bench.run(1 + 102);
    CHECK(bench.run(1) == 0.0F && !bench.device.armed() && bench.device.fault() == Cause::I2c);
}

CLAIM(fault_10_speaks_no_radio_and_a_state_is_never_older_than_a_tick) {
    // Up to 250 ms of Wi-Fi power save: this firmware's line is serial or USB. STATE leaves in the tick it is due.
    test::Bench bench;
    bench.run(1);
    bench.reading.counts = 0;
    int longest = 0;
    int waited = 0;
    for (int i = 1; i <= 4000; ++i) {
        const int states = bench.states;
        bench.run(1);
        waited = bench.states == states ? waited + 1 : 0;
        longest = std::max(longest, waited);
        CHECK(bench.states == states || bench.state.t_us == bench.t_us);
    }
    CHECK(longest == 3 && bench.states >= 1000 && bench.states <= 1001);
}

// Frames of the motor boards and their units.

#include <algorithm>

#include "../include/chalumeau/i2c.hpp"
#include "../motor_board/bridge_watch.hpp"
#include "check.hpp"

using namespace chalumeau;

CLAIM(i2c_frames_have_the_layout_of_both_boards) {
    std::uint8_t frame[I2C_FRAME];
    encode_reading(MotorBoard::Mechaduino, {0x0E0F, 1.0F}, frame);
    const std::uint8_t mec[] = {0x0F, 0x0E, 0, 0, 0, 0, 0x80, 0x3F, 0, 0, 0xDC, 0};
    CHECK(std::memcmp(frame, mec, sizeof mec) == 0);
    encode_reading(MotorBoard::Moteus, {0x0E0F, -2.0F}, frame);
    const std::uint8_t mot[] = {0, 0x0F, 0x0E, 0, 0, 0, 0, 0xC0, 0, 0, 0xDD, 0};
    CHECK(std::memcmp(frame, mot, sizeof mot) == 0);
    encode_command({-90, 1.0F, 't'}, frame);
    const std::uint8_t command[] = {0xA6, 0xFF, 0, 0, 0x80, 0x3F, 't', 0, 0, 0, 0xD8, 0x02};
    CHECK(std::memcmp(frame, command, sizeof command) == 0);
}

CLAIM(i2c_frames_come_back_and_any_byte_changed_is_refused) {
    std::uint8_t frame[I2C_FRAME];
    for (MotorBoard board : {MotorBoard::Mechaduino, MotorBoard::Moteus}) {
        for (int angle = 0; angle < 3600; angle += 7) {
            const float rpm = 0.37F * static_cast<float>(angle) - 650.0F;
            encode_reading(board, {static_cast<std::int16_t>(angle), rpm}, frame);
            MotorReading reading;
            CHECK(decode_reading(board, frame, reading) && reading.angle == angle && reading.rpm == rpm);
            for (std::size_t i = 0; i < I2C_FRAME; ++i) {
                frame[i] = static_cast<std::uint8_t>(frame[i] + 1 + angle % 255);
                CHECK(!decode_reading(board, frame, reading));
                frame[i] = static_cast<std::uint8_t>(frame[i] - 1 - angle % 255);
            }
        }
    }
    for (int torque = -450; torque <= 450; ++torque) {
        encode_command({static_cast<std::int16_t>(torque), 0.0F, 't'}, frame);
        MotorCommand command;
        CHECK(decode_command(frame, command) && command.torque_counts == torque && command.mode == 't');
        frame[6] = 'v';
        CHECK(!decode_command(frame, command));
    }
}

CLAIM(i2c_frame_of_a_line_shorted_to_ground_is_none) {
    const std::uint8_t silent[I2C_FRAME] = {};
    for (MotorBoard board : {MotorBoard::Mechaduino, MotorBoard::Moteus}) {
        MotorReading reading{123, 4.0F};
        CHECK(!decode_reading(board, silent, reading) && reading.angle == 123);
        // The smallest angle beside it is one.
        std::uint8_t frame[I2C_FRAME];
        encode_reading(board, {1, 0.0F}, frame);
        CHECK(decode_reading(board, frame, reading) && reading.angle == 1);
    }
    MotorCommand command;
    CHECK(!decode_command(silent, command));
}

CLAIM(counts_are_the_nearest_and_never_exceed_what_the_board_takes) {
    const TorqueUnit mechaduino = mechaduino_unit(60.0F);
    for (const TorqueUnit& unit : {MOTEUS_UNIT, mechaduino}) {
        for (int i = -4500; i <= 4500; ++i) {
            const float mnm = 0.1F * static_cast<float>(i);
            const float back = mnm_of(counts_of(mnm, unit), unit);
            if (std::fabs(mnm) <= unit.clips_at_mnm) {
                CHECK(std::fabs(back - mnm) <= 0.5001F * unit.mnm_per_count);
            } else {
                CHECK(std::fabs(back) <= unit.clips_at_mnm + 0.5001F * unit.mnm_per_count);
            }
        }
        CHECK(counts_of(NAN, unit) == 0 && counts_of(INFINITY, unit) == 0);
    }
    CHECK(counts_of(108.0F, mechaduino) == 208);
}

CLAIM(counts_what_a_tick_rounds_off_is_given_in_the_next_so_that_the_mean_of_10_ms_is_right) {
    // Torque as a hand feels it: slow turns through the whole range, small ones, and torque held still.
    const auto wanted_at = [](int kind, int tick) {
        const float t = 5e-4F * static_cast<float>(tick);
        if (kind == 0) {
            return 45.0F + 40.0F * std::sin(6.2831853F * 0.37F * t);
        }
        if (kind == 1) {
            return -20.0F + 3.0F * std::sin(6.2831853F * 5.0F * t);
        }
        return 2.0F + 0.31F * static_cast<float>(tick / 2000);
    };
    for (int kind = 0; kind < 3; ++kind) {
        CountRounding rounding;
        double nearest_squares = 0.0;
        double carried_squares = 0.0;
        double nearest[20] = {};
        double carried[20] = {};
        constexpr int TICKS = 200000;
        for (int i = 0; i < TICKS; ++i) {
            const float wanted = wanted_at(kind, i);
            nearest[i % 20] = static_cast<double>(mnm_of(counts_of(wanted, MOTEUS_UNIT), MOTEUS_UNIT) - wanted);
            const std::int16_t counts = rounding.counts(wanted, 450.0F, MOTEUS_UNIT);
            carried[i % 20] = static_cast<double>(mnm_of(counts, MOTEUS_UNIT) - wanted);
            double sums[2] = {0.0, 0.0};
            for (int k = 0; k < 20; ++k) {
                sums[0] += nearest[k] / 20.0;
                sums[1] += carried[k] / 20.0;
            }
            nearest_squares += sums[0] * sums[0] / TICKS;
            carried_squares += sums[1] * sums[1] / TICKS;
        }
        std::printf("    mean of 10 ms: %.2f mNm rms to the nearest count, %.3f with what was rounded off\n",
                    std::sqrt(nearest_squares), std::sqrt(carried_squares));
        CHECK(std::sqrt(nearest_squares) > 1.0);
        CHECK(std::sqrt(carried_squares) < 0.12);
    }
}

CLAIM(counts_never_exceed_the_ceiling_nor_the_board_and_no_torque_owes_nothing) {
    test::Random random(9);
    CountRounding rounding;
    for (int i = 0; i < 200000; ++i) {
        const float ceiling = random.between(0.0F, 450.0F);
        const float wanted = random.between(-ceiling, ceiling);
        const std::int16_t counts = rounding.counts(wanted, ceiling, MOTEUS_UNIT);
        CHECK(std::fabs(mnm_of(counts, MOTEUS_UNIT)) <= std::min(ceiling + 0.005F, MOTEUS_UNIT.clips_at_mnm));
        if (random.below(10) == 0) {
            CHECK(rounding.counts(0.0F, ceiling, MOTEUS_UNIT) == 0);
            CHECK(rounding.counts(1.0F, 450.0F, MOTEUS_UNIT) == 0);
            CHECK(rounding.counts(NAN, 450.0F, MOTEUS_UNIT) == 0 && rounding.counts(INFINITY, 450.0F, MOTEUS_UNIT) == 0);
        }
    }
}

CLAIM(bridge_passes_every_frame_on_stops_after_100_ms_and_once_more_before_it_goes_on) {
    BridgeWatch watch;
    const std::uint32_t start = 0xFFFFFF00U;  // its clock wraps on the way
    CHECK(watch.poll(start) == BridgeOrder::Nothing);
    CHECK(watch.frame(start) == BridgeOrder::StopAndTorque);
    std::uint32_t now = start;
    for (int i = 0; i < 2000; ++i) {
        // The same torque again and again, now and then late by 90 ms.
        now += i % 50 == 0 ? 90 : 1;
        CHECK(watch.poll(now) == BridgeOrder::Nothing);
        CHECK(watch.frame(now) == BridgeOrder::Torque);
    }
    int stops = 0;
    for (std::uint32_t ms = 1; ms < 5000; ++ms) {
        const BridgeOrder order = watch.poll(now + ms);
        CHECK((order == BridgeOrder::Stop) == (ms == BRIDGE_TIMEOUT_MS));
        stops += order == BridgeOrder::Stop ? 1 : 0;
    }
    CHECK(stops == 1);
    CHECK(watch.frame(now + 5000) == BridgeOrder::StopAndTorque);
    CHECK(watch.frame(now + 5001) == BridgeOrder::Torque);
}

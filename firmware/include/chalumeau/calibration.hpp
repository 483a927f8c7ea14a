// What was measured on one knob, as bytes that survive a power cut: its damping, its signs, its torque per count. The bytes
// carry a version and a checksum; anything else is no calibration, and the device keeps its low ceiling.
#pragma once

#include <cstddef>
#include <cstdint>

#include "crc32.hpp"
#include "i2c.hpp"

namespace chalumeau {

/// Kinds of calibration that this firmware can read.
constexpr std::uint8_t CALIBRATION_VERSION = 1;
constexpr std::size_t CALIBRATION_SIZE = 16;

struct Calibration {
    float damping_nms = 5e-4F;                       // the knob's own, N m s/rad, 1e-5..0.02
    float mnm_per_count = MOTEUS_UNIT.mnm_per_count;  // 0.05..100
    std::int8_t torque_sign = 1;                     // -1: a positive command turns the knob to smaller angles
    std::int8_t speed_sign = 1;                      // -1: the board's speed has the wrong sign

    bool is_sane() const {
        const auto within = [](float x, float low, float high) { return is_finite(x) && x >= low && x <= high; };
        const auto is_sign = [](std::int8_t x) { return x == 1 || x == -1; };
        return within(damping_nms, 1e-5F, 0.02F) && within(mnm_per_count, 0.05F, 100.0F) && is_sign(torque_sign) &&
               is_sign(speed_sign);
    }

    /// Writes CALIBRATION_SIZE bytes.
    void encode(std::uint8_t* out) const {
        Payload to;
        to.u8('K').u8(CALIBRATION_VERSION).f32(damping_nms).f32(mnm_per_count);
        to.u8(static_cast<std::uint8_t>(torque_sign)).u8(static_cast<std::uint8_t>(speed_sign));
        to.u32(crc32(to.bytes, to.length));
        std::memcpy(out, to.bytes, CALIBRATION_SIZE);
    }

    /// False, and nothing changed, if the bytes are no whole calibration of this version with sane values.
    bool decode(const std::uint8_t* bytes, std::size_t length) {
        if (length != CALIBRATION_SIZE || Bytes(bytes + CALIBRATION_SIZE - 4).u32() != crc32(bytes, CALIBRATION_SIZE - 4) ||
            bytes[0] != 'K' || bytes[1] != CALIBRATION_VERSION) {
            return false;
        }
        Bytes from(bytes + 2);
        Calibration read;
        read.damping_nms = from.f32();
        read.mnm_per_count = from.f32();
        read.torque_sign = static_cast<std::int8_t>(from.u8());
        read.speed_sign = static_cast<std::int8_t>(from.u8());
        if (!read.is_sane()) {
            return false;
        }
        *this = read;
        return true;
    }
};

}  // namespace chalumeau

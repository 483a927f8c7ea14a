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
constexpr std::size_t CALIBRATION_SIZE = 20;

struct Calibration {
    float damping_nms = 5e-4F;                       // the knob's own, N m s/rad, 1e-5..0.02
    float mnm_per_count = MOTEUS_UNIT.mnm_per_count;  // 0.05..100
    float rpm_per_unit = 1.0F;                        // of the board's speed: -1 turns its sign, 60 if it tells turns a second
    std::int8_t torque_sign = 1;                      // -1: a positive command turns the knob to smaller angles

    bool is_sane() const {
        const auto within = [](float x, float low, float high) { return is_finite(x) && x >= low && x <= high; };
        const float scale = rpm_per_unit < 0.0F ? -rpm_per_unit : rpm_per_unit;
        return within(damping_nms, 1e-5F, 0.02F) && within(mnm_per_count, 0.05F, 100.0F) && within(scale, 0.1F, 100.0F) &&
               (torque_sign == 1 || torque_sign == -1);
    }

    /// Writes CALIBRATION_SIZE bytes.
    void encode(std::uint8_t* out) const {
        Payload to;
        to.u8('K').u8(CALIBRATION_VERSION).f32(damping_nms).f32(mnm_per_count).f32(rpm_per_unit);
        to.u8(static_cast<std::uint8_t>(torque_sign)).u8(0);
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
        read.rpm_per_unit = from.f32();
        read.torque_sign = static_cast<std::int8_t>(from.u8());
        if (!read.is_sane()) {
            return false;
        }
        *this = read;
        return true;
    }
};

}  // namespace chalumeau

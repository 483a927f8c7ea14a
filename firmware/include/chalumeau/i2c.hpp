// The I2C frames of the two motor boards a TorqueTuner may carry, and their unit of torque. Twelve bytes each way: ten of
// payload, then the sum of those ten as a little-endian u16. Read from public sources (MEC: Mechaduino-Firmware; MOT:
// Moteus, branch RotaRep); never tried on hardware.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "messages.hpp"

namespace chalumeau {

constexpr std::size_t I2C_FRAME = 12;

enum class MotorBoard : std::uint8_t { Mechaduino, Moteus };

/// What a motor board says.
struct MotorReading {
    std::int16_t angle = 0;  // 0.1 degrees, 0 to 3599 on both
    float rpm = 0.0F;
};

/// What it is told; mode 't' torque, 'v' velocity.
struct MotorCommand {
    std::int16_t torque_counts = 0;
    float target_rpm = 0.0F;
    char mode = 't';
};

inline std::uint16_t byte_sum(const std::uint8_t* bytes) {
    std::uint16_t sum = 0;
    for (std::size_t i = 0; i < I2C_FRAME - 2; ++i) {
        sum = static_cast<std::uint16_t>(sum + bytes[i]);
    }
    return sum;
}

inline void seal(std::uint8_t* frame) {
    const std::uint16_t sum = byte_sum(frame);
    frame[10] = static_cast<std::uint8_t>(sum);
    frame[11] = static_cast<std::uint8_t>(sum >> 8U);
}

/// Whether the sum is right. A frame of twelve zeros has a right sum too, and is what a data line shorted to ground reads as:
/// it is none. A board that rests at the very tenth of a degree of its own zero, and tells a speed of exactly 0, would send
/// the same; there the knob counts as failed, which is the safe side.
inline bool sealed(const std::uint8_t* frame) {
    std::uint8_t any = 0;
    for (std::size_t i = 0; i < I2C_FRAME; ++i) {
        any = static_cast<std::uint8_t>(any | frame[i]);
    }
    return any != 0 && Bytes(frame + 10).u16() == byte_sum(frame);
}

constexpr std::size_t angle_at(MotorBoard board) { return board == MotorBoard::Mechaduino ? 0 : 1; }

/// False when the sum is wrong or every byte is 0; a failure for the device to count.
inline bool decode_reading(MotorBoard board, const std::uint8_t* frame, MotorReading& reading) {
    if (!sealed(frame)) {
        return false;
    }
    reading.angle = Bytes(frame + angle_at(board)).i16();
    reading.rpm = Bytes(frame + 4).f32();
    return true;
}

/// The other side, for tests and simulators.
inline void encode_reading(MotorBoard board, const MotorReading& reading, std::uint8_t* frame) {
    std::memset(frame, 0, I2C_FRAME);
    Payload angle;
    angle.i16(reading.angle);
    std::memcpy(frame + angle_at(board), angle.bytes, 2);
    Payload rpm;
    rpm.f32(reading.rpm);
    std::memcpy(frame + 4, rpm.bytes, 4);
    seal(frame);
}

inline void encode_command(const MotorCommand& command, std::uint8_t* frame) {
    Payload payload;
    payload.i16(command.torque_counts).f32(command.target_rpm).u8(static_cast<std::uint8_t>(command.mode));
    std::memset(frame, 0, I2C_FRAME);
    std::memcpy(frame, payload.bytes, payload.length);
    seal(frame);
}

inline bool decode_command(const std::uint8_t* frame, MotorCommand& command) {
    if (!sealed(frame)) {
        return false;
    }
    Bytes bytes(frame);
    command.torque_counts = bytes.i16();
    command.target_rpm = bytes.f32();
    command.mode = static_cast<char>(bytes.u8());
    return true;
}

/// How a board's counts become torque.
struct TorqueUnit {
    float mnm_per_count;
    float clips_at_mnm;  // what the board itself will not exceed
};

/// Moteus takes counts / 208 N m, and clips at 0.1 N m ("during debug") unless its own firmware is changed: 20.8 counts,
/// which flattens the stock reed curve from about 3 to 328 degrees.
constexpr TorqueUnit MOTEUS_UNIT{1000.0F / 208.0F, 100.0F};

/// Mechaduino: 208 counts are 1.8 A; torque per ampere belongs to the motor built in and has to be measured.
constexpr TorqueUnit mechaduino_unit(float mnm_per_ampere) {
    return TorqueUnit{1.8F / 208.0F * mnm_per_ampere, 1.8F * mnm_per_ampere};
}

/// Nearest count, ties away from zero, clipped to what the board takes; not a number becomes 0.
inline std::int16_t counts_of(float mnm, const TorqueUnit& unit) {
    if (!is_finite(mnm)) {
        return 0;
    }
    const float clipped =
        mnm > unit.clips_at_mnm ? unit.clips_at_mnm : (mnm < -unit.clips_at_mnm ? -unit.clips_at_mnm : mnm);
    const float counts = clipped / unit.mnm_per_count;
    return static_cast<std::int16_t>(counts + (counts < 0.0F ? -0.5F : 0.5F));
}

/// Torque as counts, tick after tick. A count of a Moteus is 4.8 mNm, so that the nearest one is wrong by 1.4 mNm rms. What
/// a tick rounds off is therefore added to the next: the error moves to frequencies far above 100 Hz (`test/boards.cpp` has
/// the figures).
class CountRounding {
  public:
    /// Never beyond `ceiling_mnm` nor what the board takes. No torque, and what is no number, is 0 counts at once.
    std::int16_t counts(float mnm, float ceiling_mnm, const TorqueUnit& unit) {
        if (!is_finite(mnm) || mnm == 0.0F) {
            owed_ = 0.0F;
            return 0;
        }
        const float ceiling = ceiling_mnm < unit.clips_at_mnm ? ceiling_mnm : unit.clips_at_mnm;
        const auto most = static_cast<std::int16_t>(ceiling / unit.mnm_per_count + 1e-3F);  // cut: below the ceiling
        const float wanted = mnm / unit.mnm_per_count + owed_;
        const std::int16_t nearest = wanted > 30000.0F    ? std::int16_t{30000}
                                     : wanted < -30000.0F ? std::int16_t{-30000}
                                                          : static_cast<std::int16_t>(wanted + (wanted < 0.0F ? -0.5F : 0.5F));
        const auto least = static_cast<std::int16_t>(-most);
        const std::int16_t given = nearest > most ? most : (nearest < least ? least : nearest);
        const float rest = wanted - static_cast<float>(given);
        // What the ceiling takes is not owed.
        owed_ = rest > 0.5F ? 0.5F : (rest < -0.5F ? -0.5F : rest);
        return given;
    }

  private:
    float owed_ = 0.0F;
};

inline float mnm_of(std::int16_t counts, const TorqueUnit& unit) {
    return static_cast<float>(counts) * unit.mnm_per_count;
}

}  // namespace chalumeau

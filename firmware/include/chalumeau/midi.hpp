// MIDI binding: frames as SysEx, breath and angle as controllers. `docs/protocol.md`, "MIDI binding".
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "frame.hpp"

namespace chalumeau {

constexpr std::uint8_t SYSEX_HEAD[] = {0xF0, 0x7D, 0x54, 0x54, 0x01};
constexpr std::size_t PACKED_MAX = FRAME_MAX + (FRAME_MAX + 6) / 7;
constexpr std::size_t SYSEX_MAX = sizeof SYSEX_HEAD + PACKED_MAX + 1;

constexpr std::uint8_t CC_BREATH = 2;
constexpr std::uint8_t CC_ANGLE = 17;
constexpr std::uint8_t CC_BUTTON = 80;
constexpr std::uint8_t CC_FINE = 32;  // the controller that refines another lies 32 above it

/// Writes type..crc as one SysEx to `out` (SYSEX_MAX bytes). Returns the length.
inline std::size_t sysex_encode(const std::uint8_t* frame, std::size_t length, std::uint8_t* out) {
    std::memcpy(out, SYSEX_HEAD, sizeof SYSEX_HEAD);
    std::size_t end = sizeof SYSEX_HEAD;
    for (std::size_t start = 0; start < length; start += 7) {
        std::uint8_t& tops = out[end++];
        tops = 0;
        for (std::size_t i = 0; i < 7 && start + i < length; ++i) {
            const std::uint8_t byte = frame[start + i];
            tops = static_cast<std::uint8_t>(tops | ((byte >> 7U) << i));
            out[end++] = byte & 0x7FU;
        }
    }
    out[end++] = 0xF7;
    return end;
}

/// MIDI bytes to frames. Channel messages, foreign SysEx and damage are passed over.
class MidiDecoder {
  public:
    /// True when this byte completes a frame.
    bool push(std::uint8_t byte, Frame& frame) {
        if (byte >= 0xF8) {
            return false;  // clock and its like may stand anywhere, even inside a SysEx
        }
        if (byte == 0xF0) {
            if (inside_) {
                ++reader.counts.junk;
            }
            inside_ = true;
            foreign_ = false;
            length_ = 0;
            return false;
        }
        if (byte < 0x80) {
            if (inside_) {
                if (length_ < sizeof buffer_) {
                    buffer_[length_++] = byte;
                } else {
                    foreign_ = true;
                }
            }
            return false;
        }
        const bool complete = inside_ && byte == 0xF7;
        if (inside_ && !complete) {
            ++reader.counts.junk;
        }
        inside_ = false;
        return complete && finish(frame);
    }

    FrameReader reader;

  private:
    bool finish(Frame& frame) {
        constexpr std::size_t HEAD = sizeof SYSEX_HEAD - 1;
        // A group is at least the byte of top bits and one more.
        if (foreign_ || length_ < HEAD || (length_ - HEAD) % 8 == 1 ||
            std::memcmp(buffer_, SYSEX_HEAD + 1, HEAD) != 0) {
            ++reader.counts.junk;
            return false;
        }
        static_assert(FRAME_MAX == PACKED_MAX - (PACKED_MAX + 7) / 8,
                      "what fits the buffer unpacks to a frame at most");
        std::size_t written = 0;
        for (std::size_t start = HEAD; start < length_; start += 8) {
            const std::uint8_t tops = buffer_[start];
            for (std::size_t i = 1; i < 8 && start + i < length_; ++i) {
                const unsigned top = (static_cast<unsigned>(tops) >> (i - 1)) & 1U;
                unpacked_[written++] = static_cast<std::uint8_t>(buffer_[start + i] | (top << 7U));
            }
        }
        return reader.read(unpacked_, written, frame);
    }

    std::uint8_t buffer_[sizeof SYSEX_HEAD - 1 + PACKED_MAX] = {};
    std::uint8_t unpacked_[FRAME_MAX] = {};
    std::size_t length_ = 0;
    bool inside_ = false;
    bool foreign_ = false;
};

/// The two messages of a 14-bit controller, most significant first. Returns 6.
inline std::size_t controller_14bit(std::uint8_t controller, std::uint16_t value, std::uint8_t* out) {
    const std::uint8_t message[] = {0xB0,
                                    controller,
                                    static_cast<std::uint8_t>((value >> 7U) & 0x7FU),
                                    0xB0,
                                    static_cast<std::uint8_t>(controller + CC_FINE),
                                    static_cast<std::uint8_t>(value & 0x7FU)};
    std::memcpy(out, message, sizeof message);
    return sizeof message;
}

}  // namespace chalumeau

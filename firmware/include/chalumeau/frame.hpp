// Frames of TTLink 1: type, sequence number, payload and checksum, between zeros. `docs/protocol.md`, "Frame".
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "cobs.hpp"
#include "crc32.hpp"

namespace chalumeau {

constexpr std::size_t FRAME_MAX = 64;                        // type..crc
constexpr std::size_t PAYLOAD_MAX = FRAME_MAX - 6;           // without type, seq, crc
constexpr std::size_t SERIAL_FRAME_MAX = FRAME_MAX + 1 + 2;  // stuffed, between two zeros

/// What a decoder has seen.
struct FrameCounts {
    std::uint32_t frames = 0;      // good ones
    std::uint32_t junk = 0;        // stretches between zeros that were no frame (boot messages, overlong, bad COBS)
    std::uint32_t crc_errors = 0;  // had the shape of a frame
    std::uint32_t gaps = 0;        // frames missing by their numbers
    std::uint32_t duplicates = 0;  // the same number twice in a row
};

/// A good frame; `payload` points into the decoder until its next byte.
struct Frame {
    std::uint8_t type = 0;
    std::uint8_t seq = 0;
    const std::uint8_t* payload = nullptr;
    std::size_t length = 0;
};

/// Writes type..crc to `out` (FRAME_MAX bytes). Returns the length, 0 when the payload is too long.
inline std::size_t frame_encode(std::uint8_t type, std::uint8_t seq, const std::uint8_t* payload, std::size_t length,
                                std::uint8_t* out) {
    if (length > PAYLOAD_MAX) {
        return 0;
    }
    out[0] = type;
    out[1] = seq;
    if (length > 0) {
        std::memcpy(out + 2, payload, length);
    }
    const std::uint32_t crc = crc32(out, length + 2);
    for (std::size_t i = 0; i < 4; ++i) {
        out[length + 2 + i] = static_cast<std::uint8_t>(crc >> (8 * i));
    }
    return length + 6;
}

/// Writes type..crc stuffed and between zeros to `out` (SERIAL_FRAME_MAX bytes). Returns the length.
inline std::size_t serial_encode(const std::uint8_t* frame, std::size_t length, std::uint8_t* out) {
    out[0] = 0;
    const std::size_t stuffed = cobs_encode(frame, length, out + 1);
    out[stuffed + 1] = 0;
    return stuffed + 2;
}

/// Checks type..crc and keeps count of the numbers; shared by the serial and the MIDI binding.
class FrameReader {
  public:
    /// True when `bytes` are a frame, which is then in `frame`.
    bool read(const std::uint8_t* bytes, std::size_t length, Frame& frame) {
        if (length < 6 || length > FRAME_MAX) {
            ++counts.junk;
            return false;
        }
        std::uint32_t crc = 0;
        for (std::size_t i = 0; i < 4; ++i) {
            crc |= static_cast<std::uint32_t>(bytes[length - 4 + i]) << (8 * i);
        }
        if (crc != crc32(bytes, length - 4)) {
            ++counts.crc_errors;
            return false;
        }
        ++counts.frames;
        frame = Frame{bytes[0], bytes[1], bytes + 2, length - 6};
        if (begun_) {
            const auto ahead = static_cast<std::uint8_t>(frame.seq - last_);
            if (ahead == 0) {
                ++counts.duplicates;
            } else {
                counts.gaps += ahead - 1U;
            }
        }
        begun_ = true;
        last_ = frame.seq;
        return true;
    }

    /// A new host counts anew.
    void forget() { begun_ = false; }

    FrameCounts counts;

  private:
    bool begun_ = false;
    std::uint8_t last_ = 0;
};

/// Serial bytes to frames. Takes any bytes at any time; never looks back further than one frame.
class SerialDecoder {
  public:
    /// True when this byte completes a frame.
    bool push(std::uint8_t byte, Frame& frame) {
        if (byte != 0) {
            if (length_ < sizeof buffer_) {
                buffer_[length_++] = byte;
            } else {
                overlong_ = true;
            }
            return false;
        }
        const std::size_t length = length_;
        const bool overlong = overlong_;
        length_ = 0;
        overlong_ = false;
        if (length == 0) {
            return false;
        }
        const int decoded = overlong ? -1 : cobs_decode(buffer_, length);
        if (decoded < 0) {
            ++reader.counts.junk;
            return false;
        }
        return reader.read(buffer_, static_cast<std::size_t>(decoded), frame);
    }

    FrameReader reader;

  private:
    std::uint8_t buffer_[FRAME_MAX + 1] = {};
    std::size_t length_ = 0;
    bool overlong_ = false;
};

}  // namespace chalumeau

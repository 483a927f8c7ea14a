// Consistent Overhead Byte Stuffing (Cheshire and Baker 1999): bytes without a zero, so that zero can end a frame.
#pragma once

#include <cstddef>
#include <cstdint>

namespace chalumeau {

/// Writes `length` bytes (at most 254) stuffed to `out`, which holds `length + 1`. Returns the bytes written.
inline std::size_t cobs_encode(const std::uint8_t* bytes, std::size_t length, std::uint8_t* out) {
    std::size_t code_at = 0;
    std::size_t end = 1;
    std::uint8_t code = 1;
    for (std::size_t i = 0; i < length; ++i) {
        if (bytes[i] == 0) {
            out[code_at] = code;
            code_at = end++;
            code = 1;
        } else {
            out[end++] = bytes[i];
            ++code;
        }
    }
    out[code_at] = code;
    return end;
}

/// Unstuffs in place. Returns the length, or -1 when the bytes are no COBS; `length` at most 254, without zeros.
inline int cobs_decode(std::uint8_t* bytes, std::size_t length) {
    std::size_t read = 0;
    std::size_t written = 0;
    while (read < length) {
        const std::uint8_t code = bytes[read++];
        if (code == 0 || read + code - 1 > length) {
            return -1;
        }
        for (std::uint8_t i = 1; i < code; ++i) {
            if (bytes[read] == 0) {
                return -1;
            }
            bytes[written++] = bytes[read++];
        }
        if (read < length) {
            bytes[written++] = 0;
        }
    }
    return static_cast<int>(written);
}

}  // namespace chalumeau

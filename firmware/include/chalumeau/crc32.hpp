// CRC-32/ISO-HDLC: polynomial 04C11DB7 reflected, initial and final FFFFFFFF; of "123456789" it is CBF43926.
#pragma once

#include <cstddef>
#include <cstdint>

namespace chalumeau {

struct CrcTable {
    std::uint32_t of[256];
};

constexpr CrcTable make_crc_table() {
    CrcTable table{};
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
        std::uint32_t crc = byte;
        for (int bit = 0; bit < 8; ++bit) {
            crc = (crc >> 1) ^ ((crc & 1U) != 0U ? 0xEDB88320U : 0U);
        }
        table.of[byte] = crc;
    }
    return table;
}

/// A kilobyte of flash: a bytewise table is what lets a 500 Hz STATE cost nothing noticeable.
inline constexpr CrcTable CRC_TABLE = make_crc_table();

/// Checksum of `length` bytes.
inline std::uint32_t crc32(const std::uint8_t* bytes, std::size_t length) {
    std::uint32_t crc = 0xFFFFFFFFU;
    for (std::size_t i = 0; i < length; ++i) {
        crc = (crc >> 8) ^ CRC_TABLE.of[(crc ^ bytes[i]) & 0xFFU];
    }
    return ~crc;
}

}  // namespace chalumeau

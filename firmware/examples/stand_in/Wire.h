// As `Arduino.h` beside it.
#pragma once

#include <cstddef>
#include <cstdint>

struct TwoWire {
    bool begin(int sda, int scl, std::uint32_t frequency);
    void setTimeOut(std::uint16_t ms);
    std::uint8_t requestFrom(std::uint8_t address, std::uint8_t length);
    int available();
    int read();
    void beginTransmission(std::uint8_t address);
    std::size_t write(const std::uint8_t* bytes, std::size_t length);
    std::uint8_t endTransmission();
};
extern TwoWire Wire;

// Names of the Arduino core for ESP32 that the example uses, so that a plain compiler can check its types. No behaviour.
#pragma once

#include <cstddef>
#include <cstdint>

constexpr int INPUT_PULLUP = 5;
constexpr int LOW = 0;

void pinMode(int pin, int mode);
int digitalRead(int pin);
std::uint32_t micros();

struct HardwareSerial {
    std::size_t setRxBufferSize(std::size_t size);
    std::size_t setTxBufferSize(std::size_t size);
    void begin(unsigned long baud);
    int available();
    int availableForWrite();
    std::size_t readBytes(std::uint8_t* buffer, std::size_t length);
    std::size_t write(const std::uint8_t* buffer, std::size_t length);
};
extern HardwareSerial Serial;

struct EspClass {
    std::uint64_t getEfuseMac();
};
extern EspClass ESP;

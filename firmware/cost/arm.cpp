// The core as a microcontroller without operating system sees it: compiled freestanding and linked without a C++ library,
// to show that it needs none, and what it takes of flash and RAM. Not a program anybody runs.

#include <new>

#include "../include/chalumeau/device.hpp"
#include "../include/chalumeau/i2c.hpp"

using namespace chalumeau;

alignas(Device) static unsigned char memory[sizeof(Device)];
static Device* device;
static CountRounding rounding;

extern "C" {

void knob_begin(const Config* config) { device = new (memory) Device(*config); }
void knob_receive(const std::uint8_t* bytes, std::size_t length) { device->receive(bytes, length); }
void knob_receive_midi(const std::uint8_t* bytes, std::size_t length) { device->receive_midi(bytes, length); }
std::size_t knob_transmit(std::uint8_t* out, std::size_t room) { return device->transmit(out, room); }

/// One tick with a Moteus board: frame read in, frame to write out.
void knob_tick(std::uint32_t t_us, const std::uint8_t* read, std::uint8_t* write) {
    Reading reading;
    MotorReading motor;
    reading.bus_ok = decode_reading(MotorBoard::Moteus, read, motor);
    reading.counts = motor.angle;
    reading.velocity_rpm = motor.rpm;
    MotorCommand command;
    const float torque = device->tick(t_us, reading);
    command.torque_counts = rounding.counts(torque, device->ceiling_mnm(), MOTEUS_UNIT);
    encode_command(command, write);
}

/// Nothing calls it; the linker wants a beginning.
void start() {
    static const Config config;
    static std::uint8_t frame[I2C_FRAME];
    knob_begin(&config);
    for (std::uint32_t t_us = 0;; t_us += 500) {
        std::uint8_t bytes[64];
        knob_receive(bytes, knob_transmit(bytes, sizeof bytes));
        knob_receive_midi(bytes, sizeof bytes);
        knob_tick(t_us, frame, frame);
    }
}
}

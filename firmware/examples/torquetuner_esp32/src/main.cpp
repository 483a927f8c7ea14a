// Chalumeau's firmware in a TorqueTuner: ESP32, motor board on I2C, host on the USB serial line. Written from public
// sources of the stock firmware and never tried on hardware: read ../../SAFETY.md first.
//
// The stock firmware's serial monitor, Wi-Fi, OSC and display are not here on purpose: the line carries frames only, and a
// radio's power save or a display's I2C transfer would cost whole ticks. Nothing may be printed but what `transmit` gives.

#include <Arduino.h>
#include <Wire.h>

#include "chalumeau/device.hpp"
#include "chalumeau/i2c.hpp"

using namespace chalumeau;

namespace {

// Wiring of the TorqueTuner with a TinyPICO, as its public sources have it.
constexpr int SDA_PIN = 21;
constexpr int SCL_PIN = 22;
constexpr int BUTTON_PIN = 0;  // to ground
constexpr std::uint8_t MOTOR_ADDRESS = 8;

// Two transfers of 12 bytes and an address take 235 us at 1 MHz, and 585 us, more than a tick, at 400 kHz.
constexpr std::uint32_t I2C_HZ = 1000000;
constexpr std::uint16_t I2C_TIMEOUT_MS = 2;
constexpr std::uint32_t SERIAL_BAUD = 921600;
constexpr std::uint32_t TICK_US = 1000000 / LOOP_HZ;

// Which board is built in. A Mechaduino needs its torque per ampere measured: see ../../README.md.
constexpr MotorBoard BOARD = MotorBoard::Moteus;
constexpr TorqueUnit UNIT = MOTEUS_UNIT;

Config knob_config() {
    Config config;
    const char name[] = "TorqueTuner";
    std::memcpy(config.name, name, sizeof name);
    std::memset(config.name + sizeof name, 0, sizeof config.name - sizeof name);
    config.serial = ESP.getEfuseMac() | 1U;  // from the factory address, never 0
    config.wraps_at = 3600;                  // the board tells an angle within one turn
    // What the board itself would clip is not promised to the host. Raise it together with the board's own limit.
    config.ceiling_mnm = static_cast<std::uint16_t>(UNIT.clips_at_mnm);
    // knob_damping_nms stays at its cautious default until somebody has measured this knob.
    return config;
}

/// Made when first asked for, when the chip can already tell its address.
Device& device() {
    static Device knob(knob_config());
    return knob;
}

Reading reading;
std::uint32_t next_us = 0;

/// Reads angle and speed; false when the frame is short or its sum is wrong.
bool read_motor() {
    std::uint8_t frame[I2C_FRAME];
    std::size_t length = Wire.requestFrom(MOTOR_ADDRESS, static_cast<std::uint8_t>(sizeof frame));
    if (length != sizeof frame) {
        while (Wire.available() > 0) {
            Wire.read();
        }
        return false;
    }
    for (std::uint8_t& byte : frame) {
        byte = static_cast<std::uint8_t>(Wire.read());
    }
    MotorReading motor;
    if (!decode_reading(BOARD, frame, motor)) {
        return false;
    }
    reading.counts = motor.angle;
    reading.velocity_rpm = motor.rpm;
    return true;
}

/// Writes the torque; false when the board does not answer.
bool write_motor(float torque_mnm) {
    MotorCommand command;
    command.torque_counts = counts_of(torque_mnm, UNIT);
    std::uint8_t frame[I2C_FRAME];
    encode_command(command, frame);
    Wire.beginTransmission(MOTOR_ADDRESS);
    Wire.write(frame, sizeof frame);
    return Wire.endTransmission() == 0;
}

void listen() {
    std::uint8_t bytes[128];
    const int waiting = Serial.available();
    if (waiting > 0) {
        const std::size_t room = sizeof bytes;
        const std::size_t count = static_cast<std::size_t>(waiting) < room ? static_cast<std::size_t>(waiting) : room;
        device().receive(bytes, Serial.readBytes(bytes, count));
    }
}

/// Hands over what the line takes without waiting.
void speak() {
    std::uint8_t bytes[128];
    const int free = Serial.availableForWrite();
    if (free > 0) {
        const std::size_t room = sizeof bytes;
        const std::size_t count = static_cast<std::size_t>(free) < room ? static_cast<std::size_t>(free) : room;
        Serial.write(bytes, device().transmit(bytes, count));
    }
}

}  // namespace

void setup() {
    pinMode(BUTTON_PIN, INPUT_PULLUP);
    Serial.setRxBufferSize(1024);
    Serial.setTxBufferSize(1024);
    Serial.begin(SERIAL_BAUD);
    Wire.begin(SDA_PIN, SCL_PIN, I2C_HZ);
    Wire.setTimeOut(I2C_TIMEOUT_MS);
    write_motor(0.0F);  // whatever the board was told before
    next_us = micros();
}

void loop() {
    const std::uint32_t now = micros();
    if (static_cast<std::int32_t>(now - next_us) < 0) {
        return;
    }
    // A tick that came late does not make the next ones hurry.
    next_us = now - next_us > TICK_US ? now + TICK_US : next_us + TICK_US;
    listen();
    const bool was_told = reading.bus_ok;
    reading.bus_ok = read_motor() && was_told;
    reading.button = digitalRead(BUTTON_PIN) == LOW;
    // supply_ok stays true: this board cannot measure the motor's supply. Its own brown-out detector resets the chip, and
    // the next lines command 0 until somebody arms again.
    const float torque_mnm = device().tick(now, reading);
    // A command that does not arrive is a failure of the next tick.
    reading.bus_ok = write_motor(torque_mnm);
    speak();
}

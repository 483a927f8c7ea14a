// Chalumeau's firmware in a TorqueTuner: ESP32, motor board on I2C, host on the USB serial line. Written from public
// sources of the stock firmware and never tried on hardware: read ../../SAFETY.md first.
//
// The stock firmware's serial monitor, Wi-Fi, OSC and display are not here on purpose: the line carries frames only, and a
// radio's power save or a display's I2C transfer would cost whole ticks. Nothing may be printed but what `transmit` gives.
//
// A hardware timer wakes one task, pinned to the core that nothing else uses. The task watchdog restarts the chip if that
// task hangs; until then the motor board's own timeout has to end the torque (../../motor_board/README.md).

#include <Arduino.h>
#include <Preferences.h>
#include <Wire.h>
#include <esp_system.h>
#include <esp_task_wdt.h>
#include <esp_timer.h>

#include "chalumeau/calibration.hpp"
#include "chalumeau/device.hpp"
#include "chalumeau/i2c.hpp"

using namespace chalumeau;

namespace {

// Wiring of the TorqueTuner with a TinyPICO, as its public sources have it.
constexpr int SDA_PIN = 21;
constexpr int SCL_PIN = 22;
constexpr int BUTTON_PIN = 0;  // to ground
// The local stop, to ground: FREE while it is pressed. The knob's own button, until a button of its own is wired to another
// pin; -1: none. A switch that opens when pressed belongs into the motor's supply instead.
constexpr int STOP_PIN = BUTTON_PIN;
constexpr std::uint8_t MOTOR_ADDRESS = 8;

// Two transfers of 12 bytes and an address take 235 us at 1 MHz, and 585 us, more than a tick, at 400 kHz.
constexpr std::uint32_t I2C_HZ = 1000000;
constexpr std::uint16_t I2C_TIMEOUT_MS = 2;
constexpr std::uint32_t SERIAL_BAUD = 921600;
constexpr std::uint64_t TICK_US = 1000000 / LOOP_HZ;

// The haptic task: alone on core 1, above everything that Arduino runs there.
constexpr BaseType_t HAPTIC_CORE = 1;
constexpr UBaseType_t HAPTIC_PRIORITY = configMAX_PRIORITIES - 1;
constexpr std::uint32_t HAPTIC_STACK = 8192;
constexpr std::uint32_t TASK_WATCHDOG_S = 1;  // the least that the chip's task watchdog counts

// Which board is built in. A Mechaduino needs its torque per ampere measured: see ../../README.md.
constexpr MotorBoard BOARD = MotorBoard::Moteus;
constexpr float BOARD_CLIPS_MNM = MOTEUS_UNIT.clips_at_mnm;

// Where the calibration is stored.
constexpr char STORE[] = "chalumeau";
constexpr char KEY[] = "calibration";

Calibration calibration;

/// Reads what was measured; false if nothing valid is stored.
bool load_calibration() {
    Preferences store;
    if (!store.begin(STORE, true)) {
        return false;
    }
    std::uint8_t bytes[CALIBRATION_SIZE] = {};
    const std::size_t length = store.getBytes(KEY, bytes, sizeof bytes);
    store.end();
    return calibration.decode(bytes, length);
}

#ifdef CALIBRATION_DAMPING_NMS
/// `pio run -e calibrate -t upload` stores what its build flags say. What is out of range is not stored.
void store_calibration() {
    Calibration measured;
    measured.damping_nms = CALIBRATION_DAMPING_NMS;
    measured.mnm_per_count = CALIBRATION_MNM_PER_COUNT;
    measured.torque_sign = CALIBRATION_TORQUE_SIGN;
    measured.rpm_per_unit = CALIBRATION_RPM_PER_UNIT;
    std::uint8_t bytes[CALIBRATION_SIZE];
    measured.encode(bytes);
    Preferences store;
    if (measured.is_sane() && store.begin(STORE, false)) {
        store.putBytes(KEY, bytes, sizeof bytes);
        store.end();
    }
}
#endif

Config knob_config() {
    Config config;
    const char name[] = "TorqueTuner";
    std::memcpy(config.name, name, sizeof name);
    std::memset(config.name + sizeof name, 0, sizeof config.name - sizeof name);
    config.serial = ESP.getEfuseMac() | 1U;  // from the factory address, never 0
    config.wraps_at = 3600;                  // the board tells an angle within one turn
    // What the board itself would clip is not promised to the host. Raise it together with the board's own limit.
    config.ceiling_mnm = static_cast<std::uint16_t>(BOARD_CLIPS_MNM);
    config.epoch = static_cast<std::uint16_t>(esp_random());
    config.calibrated = load_calibration();
    if (config.calibrated) {
        config.knob_damping_nms = calibration.damping_nms;
    }
    return config;
}

/// Made when first asked for, when the chip can already tell its address.
Device& device() {
    static Device knob(knob_config());
    return knob;
}

TaskHandle_t haptic_task = nullptr;
CountRounding rounding;
Reading reading;

/// Reads angle and speed; false when the frame is short, its sum is wrong or all of it is 0.
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
    reading.velocity_rpm = calibration.rpm_per_unit * motor.rpm;
    return true;
}

/// Writes the torque; false when the board does not answer.
bool write_motor(float torque_mnm) {
    const TorqueUnit unit{calibration.mnm_per_count, BOARD_CLIPS_MNM};
    const std::int16_t counts = rounding.counts(torque_mnm, device().ceiling_mnm(), unit);
    MotorCommand command;
    command.torque_counts = static_cast<std::int16_t>(calibration.torque_sign * counts);
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

void tick() {
    listen();
    const bool was_told = reading.bus_ok;
    reading.bus_ok = read_motor() && was_told;
    reading.button = digitalRead(BUTTON_PIN) == LOW;
    reading.stop = STOP_PIN >= 0 && digitalRead(STOP_PIN) == LOW;
    // supply_ok stays true: this board cannot measure the motor's supply. Its own brown-out detector resets the chip, and
    // the next lines command 0 until somebody arms again.
    const float torque_mnm = device().tick(micros(), reading);
    // A command that does not arrive is a failure of the next tick.
    reading.bus_ok = write_motor(torque_mnm);
    speak();
}

void wake(void*) { xTaskNotifyGive(haptic_task); }

void haptic(void*) {
    esp_task_wdt_add(nullptr);
    for (;;) {
        // Ticks that were missed are not made up for; the device counts them as overruns.
        ulTaskNotifyTake(pdTRUE, portMAX_DELAY);
        esp_task_wdt_reset();
        tick();
    }
}

}  // namespace

void setup() {
#ifdef CALIBRATION_DAMPING_NMS
    store_calibration();
#endif
    pinMode(BUTTON_PIN, INPUT_PULLUP);
    if (STOP_PIN >= 0) {
        pinMode(STOP_PIN, INPUT_PULLUP);
    }
    Serial.setRxBufferSize(1024);
    Serial.setTxBufferSize(1024);
    Serial.begin(SERIAL_BAUD);
    Wire.begin(SDA_PIN, SCL_PIN, I2C_HZ);
    Wire.setTimeOut(I2C_TIMEOUT_MS);
    write_motor(0.0F);  // whatever the board was told before
    esp_task_wdt_init(TASK_WATCHDOG_S, true);
    xTaskCreatePinnedToCore(haptic, "haptic", HAPTIC_STACK, nullptr, HAPTIC_PRIORITY, &haptic_task, HAPTIC_CORE);
    esp_timer_create_args_t every = {};
    every.callback = wake;
    every.name = "haptic";
    esp_timer_handle_t timer = nullptr;
    esp_timer_create(&every, &timer);
    esp_timer_start_periodic(timer, TICK_US);
}

void loop() { vTaskDelay(portMAX_DELAY); }

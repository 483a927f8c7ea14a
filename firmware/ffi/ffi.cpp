// The firmware core behind C functions, for the Rust crate. Every pointer is the caller's to keep valid.

#include <new>

#include "chalumeau/device.hpp"

using namespace chalumeau;

static_assert(alignof(Device) <= 8, "the Rust side stores it in u64 words");

extern "C" {

struct FwSetup {
    std::uint64_t serial;
    std::uint8_t name[16];
    float knob_damping_nms;
    std::uint32_t counts_per_turn;
    std::uint16_t ceiling_mnm;
    std::uint8_t midi;
    std::uint8_t major;
};

struct FwReading {
    std::int64_t counts;
    float velocity_rpm;
    std::uint8_t bus_ok;
    std::uint8_t supply_ok;
    std::uint8_t button;
};

struct FwCounts {
    std::uint32_t frames, junk, crc_errors, gaps, duplicates;
};

struct FwVerdict {
    std::uint8_t code;
    float value;
};

std::size_t fw_size() { return sizeof(Device); }

void fw_init(void* memory, const FwSetup* setup) {
    Config config;
    config.serial = setup->serial;
    std::memcpy(config.name, setup->name, sizeof config.name);
    config.binding = setup->midi != 0 ? Binding::Midi : Binding::Serial;
    config.major = setup->major;
    config.capabilities = static_cast<std::uint16_t>(config.capabilities | capability::SIMULATED);
    config.counts_per_turn = setup->counts_per_turn;
    config.knob_damping_nms = setup->knob_damping_nms;
    config.ceiling_mnm = setup->ceiling_mnm;
    new (memory) Device(config);
}

void fw_receive(Device* device, const std::uint8_t* bytes, std::size_t length) { device->receive(bytes, length); }

void fw_receive_midi(Device* device, const std::uint8_t* bytes, std::size_t length) {
    device->receive_midi(bytes, length);
}

std::size_t fw_transmit(Device* device, std::uint8_t* out, std::size_t room) { return device->transmit(out, room); }

float fw_tick(Device* device, std::uint64_t t_us, const FwReading* reading) {
    Reading sensed;
    sensed.counts = static_cast<std::int32_t>(static_cast<std::uint64_t>(reading->counts));
    sensed.velocity_rpm = reading->velocity_rpm;
    sensed.bus_ok = reading->bus_ok != 0;
    sensed.supply_ok = reading->supply_ok != 0;
    sensed.button = reading->button != 0;
    return device->tick(static_cast<std::uint32_t>(t_us), sensed);
}

std::uint8_t fw_armed(const Device* device) { return device->armed() ? 1 : 0; }
std::uint8_t fw_fault(const Device* device) { return static_cast<std::uint8_t>(device->fault()); }
std::uint32_t fw_dropped(const Device* device) { return device->dropped(); }

void fw_state(const Device* device, std::uint8_t* payload) {
    std::memcpy(payload, device->state().encode().bytes, State::LENGTH);
}

void fw_info(const Device* device, std::uint8_t* payload) {
    std::memcpy(payload, device->info().encode().bytes, Info::LENGTH);
}

static FwCounts counts_of_reader(const FrameCounts& counts) {
    return FwCounts{counts.frames, counts.junk, counts.crc_errors, counts.gaps, counts.duplicates};
}

FwCounts fw_counts(const Device* device) { return counts_of_reader(device->counts()); }

float fw_law(const std::uint8_t* payload, float angle_deg) {
    Feel feel;
    feel.decode(payload, Feel::LENGTH);
    return Curve(feel).at_rest(angle_deg);
}

float fw_torque(const std::uint8_t* payload, float angle_deg, float velocity) {
    Feel feel;
    feel.decode(payload, Feel::LENGTH);
    return Curve(feel).torque(angle_deg, velocity);
}

FwVerdict fw_check(const std::uint8_t* payload, float knob_damping_nms, std::uint16_t ceiling_mnm) {
    Config config;
    config.knob_damping_nms = knob_damping_nms;
    config.ceiling_mnm = ceiling_mnm;
    Feel feel;
    feel.decode(payload, Feel::LENGTH);
    const Verdict verdict = check_feel(feel, Device(config).allowed());
    return FwVerdict{static_cast<std::uint8_t>(verdict.code), verdict.value};
}

FwCounts fw_decode(const std::uint8_t* bytes, std::size_t length) {
    SerialDecoder decoder;
    Frame frame;
    for (std::size_t i = 0; i < length; ++i) {
        decoder.push(bytes[i], frame);
    }
    return counts_of_reader(decoder.reader.counts);
}

FwCounts fw_decode_midi(const std::uint8_t* bytes, std::size_t length) {
    MidiDecoder decoder;
    Frame frame;
    for (std::size_t i = 0; i < length; ++i) {
        decoder.push(bytes[i], frame);
    }
    return counts_of_reader(decoder.reader.counts);
}

float fw_seed_flow(std::uint16_t index, float h, float k) { return seed_flow(index, h, k); }
float fw_physical_flow(float index, float h, float k) { return physical_flow(index, h, k); }
}

// The firmware core behind C functions, for the Rust crate. Every pointer is the caller's to keep valid.

#include <new>

#include "chalumeau/device.hpp"
#include "chalumeau/i2c.hpp"

using namespace chalumeau;

/// The device, and the rounding of its torque to the motor board's counts.
struct Knob {
    Device device;
    CountRounding rounding;
    TorqueUnit unit;  // 0 mNm per count: a board that takes any torque
};

static_assert(alignof(Knob) <= 8, "the Rust side stores it in u64 words");

extern "C" {

struct FwSetup {
    std::uint64_t serial;
    std::uint8_t name[16];
    float knob_damping_nms;
    std::uint32_t counts_per_turn;
    std::uint16_t ceiling_mnm;
    std::uint8_t midi;
    std::uint8_t major;
    std::uint16_t epoch;
    float mnm_per_count;
    float board_clips_mnm;
    std::uint8_t probes;
    std::uint8_t calibrated;
};

struct FwReading {
    std::int64_t counts;
    float velocity_rpm;
    std::uint8_t bus_ok;
    std::uint8_t supply_ok;
    std::uint8_t button;
    std::uint8_t stop;
    std::uint8_t tells_velocity;
};

struct FwCounts {
    std::uint32_t frames, junk, crc_errors, gaps, duplicates;
};

struct FwVerdict {
    std::uint8_t code;
    float value;
};

std::size_t fw_size() { return sizeof(Knob); }

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
    config.epoch = setup->epoch;
    config.probe_mnm = setup->probes != 0 ? PROBE_MNM : 0.0F;
    config.calibrated = setup->calibrated != 0;
    new (memory) Knob{Device(config), CountRounding{}, TorqueUnit{setup->mnm_per_count, setup->board_clips_mnm}};
}

void fw_receive(Knob* knob, const std::uint8_t* bytes, std::size_t length) { knob->device.receive(bytes, length); }

void fw_receive_midi(Knob* knob, const std::uint8_t* bytes, std::size_t length) {
    knob->device.receive_midi(bytes, length);
}

std::size_t fw_transmit(Knob* knob, std::uint8_t* out, std::size_t room) { return knob->device.transmit(out, room); }

float fw_tick(Knob* knob, std::uint64_t t_us, const FwReading* reading) {
    Reading sensed;
    sensed.counts = static_cast<std::int32_t>(static_cast<std::uint64_t>(reading->counts));
    sensed.velocity_rpm = reading->velocity_rpm;
    sensed.bus_ok = reading->bus_ok != 0;
    sensed.supply_ok = reading->supply_ok != 0;
    sensed.button = reading->button != 0;
    sensed.stop = reading->stop != 0;
    sensed.has_velocity = reading->tells_velocity != 0;
    return knob->device.tick(static_cast<std::uint32_t>(t_us), sensed);
}

/// The torque of a tick as the motor board is told it, mNm.
float fw_command(Knob* knob, float torque_mnm) {
    if (!(knob->unit.mnm_per_count > 0.0F)) {
        return torque_mnm;
    }
    return mnm_of(knob->rounding.counts(torque_mnm, knob->device.ceiling_mnm(), knob->unit), knob->unit);
}

std::uint8_t fw_armed(const Knob* knob) { return knob->device.armed() ? 1 : 0; }
std::uint8_t fw_fault(const Knob* knob) { return static_cast<std::uint8_t>(knob->device.fault()); }
std::uint32_t fw_dropped(const Knob* knob) { return knob->device.dropped(); }

void fw_state(const Knob* knob, std::uint8_t* payload) {
    std::memcpy(payload, knob->device.state().encode().bytes, State::STAMPED_LENGTH);
}

void fw_info(const Knob* knob, std::uint8_t* payload) {
    std::memcpy(payload, knob->device.info().encode().bytes, Info::COUNTED_LENGTH);
}

static FwCounts counts_of_reader(const FrameCounts& counts) {
    return FwCounts{counts.frames, counts.junk, counts.crc_errors, counts.gaps, counts.duplicates};
}

FwCounts fw_counts(const Knob* knob) { return counts_of_reader(knob->device.counts()); }

float fw_law(const std::uint8_t* payload, float angle_deg) {
    Feel feel;
    feel.decode(payload, Feel::LENGTH);
    return Curve(feel).at_rest(angle_deg);
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

float fw_seed_flow(std::uint16_t index, float h, float k) { return seed_flow(index, h, k); }
float fw_physical_flow(float index, float h, float k) { return physical_flow(index, h, k); }
}

// The messages of TTLink 1 as values, and their payloads. Offsets, units and ranges: `docs/protocol.md`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>

namespace chalumeau {

constexpr std::uint8_t PROTOCOL_MAJOR = 1;
constexpr std::uint8_t PROTOCOL_MINOR = 1;

enum class Type : std::uint8_t {
    Hello = 0x01,
    Feel = 0x02,
    Arm = 0x03,
    Alive = 0x04,
    Free = 0x05,
    Zero = 0x06,
    Rate = 0x07,
    Bye = 0x08,
    Info = 0x81,
    State = 0x82,
    Event = 0x83,
};

enum class Law : std::uint8_t { Free = 0, Flow = 1, Pressure = 2 };

enum class EventKind : std::uint8_t { Slap = 1, Button = 2, Limit = 3, Fault = 4, Refused = 5, Disarmed = 6 };

/// Codes of the events `fault` and `disarmed`.
enum class Cause : std::uint8_t {
    None = 0,
    Watchdog = 1,
    OverSpeed = 2,
    I2c = 3,
    BrownOut = 4,
    NotFinite = 5,
    Free = 6,
    Bye = 7,
    NewSession = 8,
    Version = 9,
    Speed = 10,
    Angle = 11,
    Stop = 12,
    Slow = 13,
    Sign = 14,
};

/// Codes of the event `refused`.
enum class Refusal : std::uint8_t {
    None = 0,
    Closure = 1,
    Stiffness = 2,
    Push = 3,
    Scale = 4,
    NotFinite = 5,
    Range = 6,
    Law = 7,
    Fault = 8,
    Moving = 9,
    ZeroWhileArmed = 10,
    Session = 11,
    Version = 12,
    // 13 was a repeated ARM in version 1.0; a stale one includes it.
    Stale = 14,
    Unmoved = 15,
};

namespace capability {
constexpr std::uint16_t FLOW = 1U << 0U;
constexpr std::uint16_t PRESSURE = 1U << 1U;
constexpr std::uint16_t SLAP = 1U << 2U;
constexpr std::uint16_t DETENT = 1U << 3U;
constexpr std::uint16_t BUTTON = 1U << 4U;
constexpr std::uint16_t MOTOR = 1U << 5U;
constexpr std::uint16_t SIMULATED = 1U << 6U;
constexpr std::uint16_t CALIBRATED = 1U << 7U;
}  // namespace capability

namespace flag {
constexpr std::uint16_t ARMED = 1U << 0U;
constexpr std::uint16_t LIMITED = 1U << 1U;
constexpr std::uint16_t FAULT = 1U << 2U;
constexpr std::uint16_t SLAP = 1U << 3U;
constexpr std::uint16_t BUTTON = 1U << 4U;
constexpr std::uint16_t FADING = 1U << 5U;
constexpr std::uint16_t MORPHING = 1U << 6U;
constexpr std::uint16_t THERMAL = 1U << 7U;
constexpr std::uint16_t PROBING = 1U << 8U;
}  // namespace flag

/// Finite, told from the bits, so that no compiler option (-ffast-math) can remove the question.
inline bool is_finite(float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    return (bits & 0x7F800000U) != 0x7F800000U;
}

constexpr std::uint16_t CEILING_MOST_MNM = 450;
constexpr float CLOSURE_MAX = 10.0F;  // most H k

/// Why something is refused, and the number that is to blame.
struct Verdict {
    Refusal code = Refusal::None;
    float value = 0.0F;
};

/// Little-endian reading; every call site has checked the length.
class Bytes {
  public:
    explicit Bytes(const std::uint8_t* at) : at_(at) {}
    std::uint8_t u8() { return *at_++; }
    std::uint16_t u16() { return static_cast<std::uint16_t>(whole(2)); }
    std::uint32_t u32() { return static_cast<std::uint32_t>(whole(4)); }
    std::uint64_t u64() { return whole(8); }
    std::int16_t i16() { return static_cast<std::int16_t>(u16()); }
    std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
    float f32() {
        const std::uint32_t bits = u32();
        float value;
        std::memcpy(&value, &bits, sizeof value);
        return value;
    }
    void copy(std::uint8_t* to, std::size_t length) {
        std::memcpy(to, at_, length);
        at_ += length;
    }

  private:
    std::uint64_t whole(unsigned length) {
        std::uint64_t value = 0;
        for (unsigned i = 0; i < length; ++i) {
            value |= static_cast<std::uint64_t>(*at_++) << (8U * i);
        }
        return value;
    }
    const std::uint8_t* at_;
};

/// Little-endian writing into a payload.
class Payload {
  public:
    Payload& u8(std::uint8_t value) { return whole(value, 1); }
    Payload& u16(std::uint16_t value) { return whole(value, 2); }
    Payload& u32(std::uint32_t value) { return whole(value, 4); }
    Payload& u64(std::uint64_t value) { return whole(value, 8); }
    Payload& i16(std::int16_t value) { return u16(static_cast<std::uint16_t>(value)); }
    Payload& i32(std::int32_t value) { return u32(static_cast<std::uint32_t>(value)); }
    Payload& f32(float value) {
        std::uint32_t bits;
        std::memcpy(&bits, &value, sizeof bits);
        return u32(bits);
    }
    Payload& copy(const std::uint8_t* from, std::size_t count) {
        std::memcpy(bytes + length, from, count);
        length += count;
        return *this;
    }

    std::uint8_t bytes[58] = {};
    std::size_t length = 0;

  private:
    Payload& whole(std::uint64_t value, unsigned count) {
        for (unsigned i = 0; i < count; ++i) {
            bytes[length++] = static_cast<std::uint8_t>(value >> (8U * i));
        }
        return *this;
    }
};

struct Hello {
    static constexpr std::size_t LENGTH = 12;
    std::uint8_t major = PROTOCOL_MAJOR;
    std::uint8_t minor = PROTOCOL_MINOR;
    std::uint32_t session = 0;

    bool magic = true;

    /// False when too short.
    bool decode(const std::uint8_t* payload, std::size_t length) {
        if (length < LENGTH) {
            return false;
        }
        magic = std::memcmp(payload, "TTLK", 4) == 0;
        Bytes bytes(payload + 4);
        major = bytes.u8();
        minor = bytes.u8();
        bytes.u16();
        session = bytes.u32();
        return true;
    }
    Verdict ranges() const { return magic ? Verdict{} : Verdict{Refusal::Range, 0.0F}; }
    Payload encode() const {
        Payload to;
        to.copy(reinterpret_cast<const std::uint8_t*>("TTLK"), 4).u8(major).u8(minor).u16(0).u32(session);
        return to;
    }
};

/// The whole state of the feel; fields, units and ranges as in the protocol. The default is no torque.
struct Feel {
    static constexpr std::size_t LENGTH = 56;
    std::uint8_t feel_id = 0;
    std::uint8_t law = 0;
    std::uint16_t morph_ms = 50;
    float h = 2.598076211F;
    float k = 0.384900179F;
    float scale_mnm = 0.0F;
    float stretch = 1.0F;
    float offset_deg = 0.0F;
    float a_on_deg = 120.0F;
    float a_off_deg = 0.0F;
    float a_beat_deg = 180.0F;
    float wall_deg = 360.0F;
    float wall_mnm_per_deg = 0.0F;
    float slap_mnm_per_deg = 0.0F;
    float damping_mnms = 0.0F;
    std::uint16_t friction = 0;
    std::uint16_t detent = 0;

    /// False when too short.
    bool decode(const std::uint8_t* payload, std::size_t length) {
        if (length < LENGTH) {
            return false;
        }
        Bytes bytes(payload);
        feel_id = bytes.u8();
        law = bytes.u8();
        morph_ms = bytes.u16();
        for (float* field : {&h, &k, &scale_mnm, &stretch, &offset_deg, &a_on_deg, &a_off_deg, &a_beat_deg, &wall_deg,
                             &wall_mnm_per_deg, &slap_mnm_per_deg, &damping_mnms}) {
            *field = bytes.f32();
        }
        friction = bytes.u16();
        detent = bytes.u16();
        return true;
    }
    /// Ranges of the protocol.
    Verdict ranges() const {
        struct Field {
            float value, low, high;
        };
        const Field fields[] = {
            {h, 0.5F, 10.0F},
            {k, 0.01F, 20.0F},
            {scale_mnm, 0.0F, 450.0F},
            {stretch, 0.1F, 30.0F},
            {offset_deg, -360.0F, 360.0F},
            {a_on_deg, 0.0F, 3600.0F},
            {a_off_deg, 0.0F, 36000.0F},
            {a_beat_deg, 0.0F, 3600.0F},
            {wall_deg, 10.0F, 36000.0F},
            {wall_mnm_per_deg, 0.0F, 100.0F},
            {slap_mnm_per_deg, 0.0F, 20.0F},
            {damping_mnms, 0.0F, 20.0F},
            {static_cast<float>(morph_ms), 20.0F, 1000.0F},
            {static_cast<float>(friction), 0.0F, 1000.0F},
            {static_cast<float>(detent), 0.0F, 1000.0F},
        };
        for (const Field& field : fields) {
            if (!is_finite(field.value)) {
                return {Refusal::NotFinite, 0.0F};  // the wire carries no other number for it
            }
        }
        if (law > 2) {
            return {Refusal::Law, static_cast<float>(law)};
        }
        for (const Field& field : fields) {
            if (field.value < field.low || field.value > field.high) {
                return {Refusal::Range, field.value};
            }
        }
        if (h * k > CLOSURE_MAX) {
            return {Refusal::Closure, h * k};
        }
        return {};
    }
    Payload encode() const {
        Payload to;
        to.u8(feel_id).u8(law).u16(morph_ms);
        for (float field : {h, k, scale_mnm, stretch, offset_deg, a_on_deg, a_off_deg, a_beat_deg, wall_deg,
                            wall_mnm_per_deg, slap_mnm_per_deg, damping_mnms}) {
            to.f32(field);
        }
        to.u16(friction).u16(detent);
        return to;
    }
};

/// ARM and ALIVE.
struct Arm {
    static constexpr std::size_t LENGTH = 8;
    static constexpr std::size_t STAMPED_LENGTH = 12;
    std::uint32_t session = 0;
    std::uint16_t ceiling_mnm = 0;
    std::uint16_t epoch = 0;
    std::uint32_t heard_us = 0;
    bool stamped = false;  // a host of version 1.0 sends neither epoch nor time

    bool decode(const std::uint8_t* payload, std::size_t length) {
        if (length < LENGTH) {
            return false;
        }
        Bytes bytes(payload);
        session = bytes.u32();
        ceiling_mnm = bytes.u16();
        stamped = length >= STAMPED_LENGTH;
        epoch = stamped ? bytes.u16() : std::uint16_t{0};
        heard_us = stamped ? bytes.u32() : 0;
        return true;
    }
    Verdict ranges() const {
        return ceiling_mnm > CEILING_MOST_MNM ? Verdict{Refusal::Range, static_cast<float>(ceiling_mnm)} : Verdict{};
    }
    Payload encode() const {
        Payload to;
        to.u32(session).u16(ceiling_mnm).u16(epoch);
        return stamped ? to.u32(heard_us) : to;
    }
};

struct Zero {
    static constexpr std::size_t LENGTH = 4;
    std::int32_t angle = 0;  // 0.01 degrees

    bool decode(const std::uint8_t* payload, std::size_t length) {
        if (length < LENGTH) {
            return false;
        }
        angle = Bytes(payload).i32();
        return true;
    }
    Verdict ranges() const {
        return angle < -360000 || angle > 360000 ? Verdict{Refusal::Range, static_cast<float>(angle)} : Verdict{};
    }
    Payload encode() const {
        Payload to;
        to.i32(angle);
        return to;
    }
};

struct Rate {
    static constexpr std::size_t LENGTH = 2;
    std::uint16_t hz = 0;

    bool decode(const std::uint8_t* payload, std::size_t length) {
        if (length < LENGTH) {
            return false;
        }
        hz = Bytes(payload).u16();
        return true;
    }
    Verdict ranges() const {
        return hz < 10 || hz > 1000 ? Verdict{Refusal::Range, static_cast<float>(hz)} : Verdict{};
    }
    Payload encode() const {
        Payload to;
        to.u16(hz);
        return to;
    }
};

struct Bye {
    static constexpr std::size_t LENGTH = 4;
    std::uint32_t session = 0;

    bool decode(const std::uint8_t* payload, std::size_t length) {
        if (length < LENGTH) {
            return false;
        }
        session = Bytes(payload).u32();
        return true;
    }
    Payload encode() const {
        Payload to;
        to.u32(session);
        return to;
    }
};

struct Info {
    static constexpr std::size_t LENGTH = 52;
    static constexpr std::size_t COUNTED_LENGTH = 56;
    std::uint8_t major = PROTOCOL_MAJOR;
    std::uint8_t minor = PROTOCOL_MINOR;
    std::uint16_t capabilities = 0;
    std::uint8_t firmware_major = 0;
    std::uint8_t firmware_minor = 0;
    std::uint16_t firmware_patch = 0;
    std::uint8_t name[16] = {};
    std::uint64_t serial = 0;
    std::uint32_t counts_per_turn = 0;
    std::uint16_t loop_hz = 0;
    std::uint16_t watchdog_ms = 0;
    std::uint16_t fade_ms = 0;
    std::uint16_t ceiling_mnm = 0;
    std::uint32_t session = 0;
    std::uint16_t stiffness_limit = 0;
    std::uint16_t push_limit = 0;
    std::uint16_t overruns = 0;
    std::uint16_t bus_errors = 0;
    bool counted = false;  // a device of version 1.0 sends no counters

    bool decode(const std::uint8_t* payload, std::size_t length) {
        if (length < LENGTH) {
            return false;
        }
        Bytes bytes(payload);
        major = bytes.u8();
        minor = bytes.u8();
        capabilities = bytes.u16();
        firmware_major = bytes.u8();
        firmware_minor = bytes.u8();
        firmware_patch = bytes.u16();
        bytes.copy(name, sizeof name);
        serial = bytes.u64();
        counts_per_turn = bytes.u32();
        for (std::uint16_t* field : {&loop_hz, &watchdog_ms, &fade_ms, &ceiling_mnm}) {
            *field = bytes.u16();
        }
        session = bytes.u32();
        stiffness_limit = bytes.u16();
        push_limit = bytes.u16();
        counted = length >= COUNTED_LENGTH;
        overruns = counted ? bytes.u16() : std::uint16_t{0};
        bus_errors = counted ? bytes.u16() : std::uint16_t{0};
        return true;
    }
    Verdict ranges() const { return serial == 0 ? Verdict{Refusal::Range, 0.0F} : Verdict{}; }
    Payload encode() const {
        Payload to;
        to.u8(major).u8(minor).u16(capabilities).u8(firmware_major).u8(firmware_minor).u16(firmware_patch);
        to.copy(name, sizeof name).u64(serial).u32(counts_per_turn);
        to.u16(loop_hz).u16(watchdog_ms).u16(fade_ms).u16(ceiling_mnm);
        to.u32(session).u16(stiffness_limit).u16(push_limit);
        return counted ? to.u16(overruns).u16(bus_errors) : to;
    }
};

struct State {
    static constexpr std::size_t LENGTH = 18;
    static constexpr std::size_t STAMPED_LENGTH = 20;
    std::uint32_t t_us = 0;
    std::int32_t angle = 0;
    std::int16_t velocity = 0;
    std::int16_t torque = 0;
    std::uint16_t flags = 0;
    std::uint8_t feel_id = 0;
    std::uint8_t slaps = 0;
    std::uint8_t events = 0;
    std::uint8_t fault = 0;
    std::uint16_t epoch = 0;
    bool stamped = false;  // a device of version 1.0 sends no epoch

    bool decode(const std::uint8_t* payload, std::size_t length) {
        if (length < LENGTH) {
            return false;
        }
        Bytes bytes(payload);
        t_us = bytes.u32();
        angle = bytes.i32();
        velocity = bytes.i16();
        torque = bytes.i16();
        flags = bytes.u16();
        feel_id = bytes.u8();
        slaps = bytes.u8();
        events = bytes.u8();
        fault = bytes.u8();
        stamped = length >= STAMPED_LENGTH;
        epoch = stamped ? bytes.u16() : std::uint16_t{0};
        return true;
    }
    Payload encode() const {
        Payload to;
        to.u32(t_us).i32(angle).i16(velocity).i16(torque).u16(flags).u8(feel_id).u8(slaps).u8(events).u8(fault);
        return stamped ? to.u16(epoch) : to;
    }
};

struct Event {
    static constexpr std::size_t LENGTH = 12;
    std::uint8_t kind = 0;
    std::uint8_t counter = 0;
    std::uint8_t code = 0;
    std::uint8_t feel_id = 0;
    std::uint32_t t_us = 0;
    float value = 0.0F;

    bool decode(const std::uint8_t* payload, std::size_t length) {
        if (length < LENGTH) {
            return false;
        }
        Bytes bytes(payload);
        kind = bytes.u8();
        counter = bytes.u8();
        code = bytes.u8();
        feel_id = bytes.u8();
        t_us = bytes.u32();
        value = bytes.f32();
        return true;
    }
    Verdict ranges() const {
        if (kind < 1 || kind > 6) {
            return {Refusal::Range, static_cast<float>(kind)};
        }
        return is_finite(value) ? Verdict{} : Verdict{Refusal::NotFinite, 0.0F};
    }
    Payload encode() const {
        Payload to;
        to.u8(kind).u8(counter).u8(code).u8(feel_id).u32(t_us).f32(value);
        return to;
    }
};

}  // namespace chalumeau

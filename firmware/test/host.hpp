// The other end of the line, for tests: a host that speaks, and a bench that turns the knob and listens.
#pragma once

#include <cstdint>
#include <vector>

#include "../include/chalumeau/device.hpp"

namespace test {

using namespace chalumeau;

constexpr std::uint32_t SESSION = 0x1234ABCD;

/// A flow law with the reference reed: 90 units at the peak, closure at 360 degrees.
inline Feel reference_feel() {
    Feel feel;
    feel.feel_id = 1;
    feel.law = static_cast<std::uint8_t>(Law::Flow);
    feel.scale_mnm = 90.0F;
    feel.wall_deg = 400.0F;
    feel.wall_mnm_per_deg = 20.0F;
    return feel;
}

inline Feel pressure_feel() {
    Feel feel = reference_feel();
    feel.law = static_cast<std::uint8_t>(Law::Pressure);
    feel.detent = 100;
    return feel;
}

/// A knob that damps well, so that the stiff feels of these tests are allowed: 2 N m/rad. Its shaft obeys no motor, so
/// that it has no sign to probe.
inline Config damped() {
    Config config;
    config.knob_damping_nms = 2e-3F;
    config.probe_mnm = 0.0F;
    return config;
}

class Bench {
  public:
    explicit Bench(const Config& config = damped()) : config_(config), device(config) {}

    void send(Type type, const Payload& payload) { send_numbered(type, payload, seq_++); }
    void send_numbered(Type type, const Payload& payload, std::uint8_t seq) {
        std::uint8_t frame[FRAME_MAX];
        std::uint8_t wire[SYSEX_MAX];
        const std::size_t length =
            frame_encode(static_cast<std::uint8_t>(type), seq, payload.bytes, payload.length, frame);
        if (config_.binding == Binding::Serial) {
            device.receive(wire, serial_encode(frame, length, wire));
        } else {
            device.receive_midi(wire, sysex_encode(frame, length, wire));
        }
    }
    void hello(std::uint32_t session = SESSION, std::uint8_t major = 1) {
        Hello hello;
        hello.major = major;
        hello.session = session;
        send(Type::Hello, hello.encode());
    }
    void feel(const Feel& feel) { send(Type::Feel, feel.encode()); }
    void arm(std::uint16_t ceiling_mnm = 450, std::uint32_t session = SESSION) {
        send(Type::Arm, permission(session, ceiling_mnm).encode());
    }
    void alive(std::uint16_t ceiling_mnm = 450, std::uint32_t session = SESSION) {
        send(Type::Alive, permission(session, ceiling_mnm).encode());
    }
    /// ARM or ALIVE of a host that hears the knob without delay.
    Arm permission(std::uint32_t session, std::uint16_t ceiling_mnm) const {
        const State now = device.state();
        return Arm{session, ceiling_mnm, now.epoch, now.t_us, true};
    }

    /// One tick of 0.5 ms with what is in `reading`; hears what the device says.
    float tick() {
        t_us += 500;
        reading.counts += counts_per_tick;
        const float torque = device.tick(t_us, reading);
        listen();
        return torque;
    }
    /// Ticks with a living host.
    float run(int ticks) {
        float torque = 0.0F;
        for (int i = 0; i < ticks; ++i) {
            if (beats && ++since_alive_ >= 40) {
                since_alive_ = 0;
                alive(ceiling_mnm);
            }
            torque = tick();
        }
        return torque;
    }
    /// Turns at `counts_per_tick` to a position.
    void turn_to(std::int32_t counts, std::int32_t counts_per_tick = 4) {
        while (reading.counts != counts) {
            const std::int32_t left = counts - reading.counts;
            const std::int32_t step =
                left > counts_per_tick ? counts_per_tick : (left < -counts_per_tick ? -counts_per_tick : left);
            reading.counts += step;
            reading.velocity_rpm = static_cast<float>(step) * 2000.0F * 60.0F / 3600.0F;
            run(1);
        }
        reading.velocity_rpm = 0.0F;
        run(200);
    }
    /// Hello, feel, turn to a place, arm, wait for the soft start.
    void ready(const Feel& wanted, std::int32_t counts = 0, std::uint16_t ceiling = 450) {
        ceiling_mnm = ceiling;
        run(1);
        hello();
        feel(wanted);
        turn_to(counts);
        arm(ceiling);
        run(600);
    }
    std::size_t count(EventKind kind) const {
        std::size_t found = 0;
        for (const Event& event : events) {
            found += event.kind == static_cast<std::uint8_t>(kind) ? 1U : 0U;
        }
        return found;
    }
    const Event* last(EventKind kind) const {
        for (std::size_t i = events.size(); i-- > 0;) {
            if (events[i].kind == static_cast<std::uint8_t>(kind)) {
                return &events[i];
            }
        }
        return nullptr;
    }
    bool refused(Refusal code) const {
        const Event* event = last(EventKind::Refused);
        return event != nullptr && event->code == static_cast<std::uint8_t>(code);
    }
    bool disarmed_by(Cause cause) const {
        const Event* event = last(EventKind::Disarmed);
        return event != nullptr && event->code == static_cast<std::uint8_t>(cause);
    }

    void listen() {
        std::uint8_t bytes[1024];
        const std::size_t count = device.transmit(bytes, sizeof bytes);
        raw.insert(raw.end(), bytes, bytes + (keep_raw ? count : 0));
        Frame frame;
        for (std::size_t i = 0; i < count; ++i) {
            const bool whole =
                config_.binding == Binding::Serial ? serial_.push(bytes[i], frame) : midi_.push(bytes[i], frame);
            if (!whole) {
                continue;
            }
            if (frame.type == static_cast<std::uint8_t>(Type::Event)) {
                Event event;
                event.decode(frame.payload, frame.length);
                events.push_back(event);
            } else if (frame.type == static_cast<std::uint8_t>(Type::State)) {
                state.decode(frame.payload, frame.length);
                ++states;
            } else if (frame.type == static_cast<std::uint8_t>(Type::Info)) {
                info.decode(frame.payload, frame.length);
                ++infos;
            }
        }
    }
    const FrameCounts& heard() const {
        return config_.binding == Binding::Serial ? serial_.reader.counts : midi_.reader.counts;
    }

  private:
    Config config_;
    SerialDecoder serial_;
    MidiDecoder midi_;
    std::uint8_t seq_ = 0;
    int since_alive_ = 0;

  public:
    Device device;
    Reading reading;
    std::int32_t counts_per_tick = 0;
    std::uint32_t t_us = 0;
    std::uint16_t ceiling_mnm = 450;
    bool beats = true;
    bool keep_raw = false;
    std::vector<Event> events;
    std::vector<std::uint8_t> raw;
    State state;
    Info info;
    int states = 0;
    int infos = 0;
};

}  // namespace test

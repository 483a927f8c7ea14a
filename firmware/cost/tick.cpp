// A knob at work, for callgrind to count: `tick average N` runs N ticks with the traffic of play (FEEL 100 a second, ALIVE
// 50, STATE 500), `tick busy N` with a FEEL in every single tick and a STATE in every second, the most there can be.

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "../include/chalumeau/device.hpp"

using namespace chalumeau;

namespace {

std::size_t wire_of(Type type, std::uint8_t seq, const Payload& payload, std::uint8_t* wire) {
    std::uint8_t frame[FRAME_MAX];
    return serial_encode(
        frame, frame_encode(static_cast<std::uint8_t>(type), seq, payload.bytes, payload.length, frame), wire);
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 3) {
        std::fprintf(stderr, "tick average|busy TICKS\n");
        return 2;
    }
    const bool busy = std::strcmp(arguments[1], "busy") == 0;
    const long ticks = std::strtol(arguments[2], nullptr, 10);
    Config config;
    config.knob_damping_nms = 2e-3F;  // so that the wall below is allowed
    config.probe_mnm = 0.0F;          // no motor moves this shaft
    Device device{config};
    std::uint8_t wire[SERIAL_FRAME_MAX];
    Feel feel;
    feel.law = static_cast<std::uint8_t>(Law::Flow);
    feel.scale_mnm = 90.0F;
    feel.wall_deg = 400.0F;
    feel.wall_mnm_per_deg = 20.0F;
    feel.slap_mnm_per_deg = 1.0F;
    feel.damping_mnms = 1.0F;
    feel.friction = 20;
    feel.detent = 30;
    // Made beforehand: the host's work is not the knob's. Their numbers repeat, which only counts as gaps.
    std::uint8_t feels[2][SERIAL_FRAME_MAX];
    std::size_t feel_length[2];
    for (int i = 0; i < 2; ++i) {
        feel.scale_mnm = i == 0 ? 90.0F : 80.0F;
        feel_length[i] = wire_of(Type::Feel, static_cast<std::uint8_t>(2 + i), feel.encode(), feels[i]);
    }
    device.receive(wire, wire_of(Type::Hello, 0, Hello{}.encode(), wire));
    Reading reading;
    device.tick(0, reading);
    const auto permission = [&device] {
        const State now = device.state();
        return Arm{0, 450, now.epoch, now.t_us, true}.encode();
    };
    device.receive(wire, wire_of(Type::Arm, 1, permission(), wire));
    std::uint8_t rate[SERIAL_FRAME_MAX];
    if (busy) {
        device.receive(rate, wire_of(Type::Rate, 4, Rate{1000}.encode(), rate));
    }
    std::uint8_t out[256];
    std::uint32_t t_us = 0;
    float sum = 0.0F;
    for (long i = 0; i < ticks; ++i) {
        t_us += 500;
        // To and fro over the whole law, 0 to 360 degrees.
        const long phase = i % 7200;
        reading.counts = static_cast<std::int32_t>(phase < 3600 ? phase : 7200 - phase);
        reading.velocity_rpm = phase < 3600 ? 33.3F : -33.3F;
        if (busy || i % 20 == 0) {
            const long which = busy ? i % 2 : i / 20 % 2;
            device.receive(feels[which], feel_length[which]);
        }
        if (i % 40 == 0) {
            device.receive(wire, wire_of(Type::Alive, 5, permission(), wire));
        }
        sum += device.tick(t_us, reading);
        device.transmit(out, sizeof out);
    }
    std::printf("%s, mean torque %.3f mNm\n", device.armed() ? "armed" : "disarmed",
                static_cast<double>(sum) / static_cast<double>(ticks > 0 ? ticks : 1));
    return device.armed() && device.feel().law == static_cast<std::uint8_t>(Law::Flow) ? 0 : 1;
}

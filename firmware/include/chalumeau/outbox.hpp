// Bytes on their way to the host. What does not fit is dropped whole and counted, never cut.
#pragma once

#include <cstddef>
#include <cstdint>

#include "frame.hpp"
#include "messages.hpp"
#include "midi.hpp"

namespace chalumeau {

enum class Binding : std::uint8_t { Serial, Midi };

class Outbox {
  public:
    explicit Outbox(Binding binding) : binding_(binding) {}

    /// Queues one message in the binding's clothes.
    void send(Type type, const Payload& payload) {
        std::uint8_t frame[FRAME_MAX];
        const std::size_t length =
            frame_encode(static_cast<std::uint8_t>(type), seq_, payload.bytes, payload.length, frame);
        std::uint8_t dressed[SYSEX_MAX];
        static_assert(SYSEX_MAX >= SERIAL_FRAME_MAX, "the larger of the two");
        const std::size_t end =
            binding_ == Binding::Serial ? serial_encode(frame, length, dressed) : sysex_encode(frame, length, dressed);
        if (put(dressed, end)) {
            ++seq_;
        }
    }

    /// Queues bytes as they are.
    bool put(const std::uint8_t* bytes, std::size_t length) {
        if (length > SIZE - held_) {
            ++dropped_;
            return false;
        }
        for (std::size_t i = 0; i < length; ++i) {
            ring_[(first_ + held_++) % SIZE] = bytes[i];
        }
        return true;
    }

    /// Takes up to `room` bytes for the wire.
    std::size_t take(std::uint8_t* out, std::size_t room) {
        const std::size_t count = room < held_ ? room : held_;
        for (std::size_t i = 0; i < count; ++i) {
            out[i] = ring_[first_];
            first_ = (first_ + 1) % SIZE;
        }
        held_ -= count;
        return count;
    }

    std::uint32_t dropped() const { return dropped_; }

  private:
    static constexpr std::size_t SIZE = 1024;  // 11 ms at 921600 baud
    std::uint8_t ring_[SIZE] = {};
    std::size_t first_ = 0;
    std::size_t held_ = 0;
    std::uint32_t dropped_ = 0;
    std::uint8_t seq_ = 0;
    Binding binding_;
};

}  // namespace chalumeau

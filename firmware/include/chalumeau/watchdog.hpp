// The watchdog: how long a host may be silent before torque fades. `docs/protocol.md`, "Safety", rule 1.
#pragma once

#include <cstdint>

namespace chalumeau {

constexpr std::uint32_t WATCHDOG_SERIAL_MS = 80;
constexpr std::uint32_t WATCHDOG_MIDI_MS = 330;  // with the fade 380: leaves 20 of the promised 400 for lateness

/// Only a valid ALIVE (and the first ARM) feeds it. Times are differences of a microsecond clock that wraps.
class Watchdog {
  public:
    explicit Watchdog(std::uint32_t timeout_ms) : timeout_us_(timeout_ms * 1000) {}

    void feed(std::uint32_t now_us) { fed_us_ = now_us; }

    /// Whether the host has been silent for too long. Only means something once it has been fed.
    bool expired(std::uint32_t now_us) const { return now_us - fed_us_ > timeout_us_; }

  private:
    std::uint32_t timeout_us_;
    std::uint32_t fed_us_ = 0;
};

}  // namespace chalumeau

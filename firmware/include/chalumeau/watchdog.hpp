// The watchdog: how long a host may be silent before torque fades. `docs/protocol.md`, "Safety", rule 1.
#pragma once

#include <cstdint>

namespace chalumeau {

constexpr std::uint32_t WATCHDOG_SERIAL_MS = 80;
constexpr std::uint32_t WATCHDOG_MIDI_MS = 330;  // with the fade 380: leaves 20 of the promised 400 for lateness

/// Only a fresh ALIVE (and the first ARM) feeds it, with the time at which the knob said what the host answers: a late line
/// does not lengthen the host's life. Times are differences of a microsecond clock that wraps.
class Watchdog {
  public:
    explicit Watchdog(std::uint32_t timeout_ms) : timeout_us_(timeout_ms * 1000) {}

    void start(std::uint32_t at_us) { fed_us_ = at_us; }

    /// The host lived at `at_us`; what is older than the last feeding tells nothing.
    void feed(std::uint32_t at_us) {
        if (static_cast<std::int32_t>(at_us - fed_us_) > 0) {
            fed_us_ = at_us;
        }
    }

    /// Whether the host has been silent for too long. Only means something once it has been fed.
    bool expired(std::uint32_t now_us) const { return now_us - fed_us_ > timeout_us_; }

  private:
    std::uint32_t timeout_us_;
    std::uint32_t fed_us_ = 0;
};

}  // namespace chalumeau

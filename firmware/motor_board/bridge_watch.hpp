// For the motor controller's side of the TorqueTuner's I2C bridge: when to pass a torque on, and when to stop the motor. It
// knows no controller and no bus, only time in milliseconds; README.md beside it says where to call it. Our own code, under
// this project's licences. Never tried on hardware.
#pragma once

#include <cstdint>

namespace chalumeau {

/// Silence after which the motor is stopped, ms: below what a hand notices as a pull, fifty lost frames of the ESP32.
constexpr std::uint32_t BRIDGE_TIMEOUT_MS = 100;

/// What the bridge tells the motor controller.
enum class BridgeOrder : std::uint8_t {
    Nothing,
    Stop,           // motor off (moteus: mode 0, which also ends a position timeout)
    Torque,         // the torque of this frame
    StopAndTorque,  // first off, then the torque of this frame
};

class BridgeWatch {
  public:
    /// A frame with a good sum has arrived. Every one is passed on, the same torque as before too: it is the sign of life
    /// that the controller's own timeout waits for.
    BridgeOrder frame(std::uint32_t now_ms) {
        last_ms_ = now_ms;
        const bool was_silent = !lives_;
        lives_ = true;
        return was_silent ? BridgeOrder::StopAndTorque : BridgeOrder::Torque;
    }

    /// Call it at least every 5 ms. Frames with a wrong sum are silence.
    BridgeOrder poll(std::uint32_t now_ms) {
        if (lives_ && now_ms - last_ms_ >= BRIDGE_TIMEOUT_MS) {
            lives_ = false;
            return BridgeOrder::Stop;
        }
        return BridgeOrder::Nothing;
    }

  private:
    std::uint32_t last_ms_ = 0;
    bool lives_ = false;
};

}  // namespace chalumeau

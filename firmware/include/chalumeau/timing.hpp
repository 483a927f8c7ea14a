// Times of the haptic loop: its rate, and how torque comes and goes.
#pragma once

#include <cstdint>

namespace chalumeau {

/// Ticks of the haptic loop a second.
constexpr std::uint16_t LOOP_HZ = 2000;
constexpr float LOOP_S = 1.0F / LOOP_HZ;
/// Time over which torque rises after the knob was armed, ms.
constexpr std::uint32_t SOFT_START_MS = 250;
/// Time over which torque fades after the host fell silent, ms.
constexpr std::uint32_t FADE_MS = 50;

}  // namespace chalumeau

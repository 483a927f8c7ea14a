// As `Arduino.h` beside it.
#pragma once

#include <cstdint>

std::uint32_t esp_random();

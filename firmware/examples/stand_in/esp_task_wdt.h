// As `Arduino.h` beside it; of ESP-IDF 4.4, where the timeout is in seconds.
#pragma once

#include <cstdint>

#include "Arduino.h"

using esp_err_t = int;
esp_err_t esp_task_wdt_init(std::uint32_t timeout_s, bool panic);
esp_err_t esp_task_wdt_add(TaskHandle_t task);
esp_err_t esp_task_wdt_reset();

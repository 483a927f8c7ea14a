// As `Arduino.h` beside it.
#pragma once

#include <cstddef>

struct Preferences {
    bool begin(const char* name, bool read_only);
    void end();
    std::size_t getBytes(const char* key, void* buffer, std::size_t length);
    std::size_t putBytes(const char* key, const void* bytes, std::size_t length);
};

// The smallest test frame that does: claims register themselves, CHECK counts and names what failed.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

namespace test {

struct Claim {
    const char* name;
    void (*run)();
};

inline std::vector<Claim>& claims() {
    static std::vector<Claim> all;
    return all;
}

struct Register {
    Register(const char* name, void (*run)()) { claims().push_back({name, run}); }
};

/// From the command line.
struct Options {
    std::string golden = "firmware/golden";
    unsigned long long fuzz_bytes = 100000000;
    unsigned long anarchy = 1000000;  // ticks
    unsigned long trials = 100000;  // FEEL changes of the slew claim; others take a share of it
};

inline Options& options() {
    static Options all;
    return all;
}

inline int& failures() {
    static int count = 0;
    return count;
}

inline void fail(const char* file, int line, const char* what) {
    // One broken claim in a loop must not bury the others.
    if (++failures() <= 40) {
        std::printf("    %s:%d: not so: %s\n", file, line, what);
    }
}

/// Random numbers from a seed: xorshift64*.
class Random {
  public:
    explicit Random(std::uint64_t seed) : state_(seed * 2654435769U + 88172645463325252U) {}
    std::uint64_t next() {
        state_ ^= state_ >> 12U;
        state_ ^= state_ << 25U;
        state_ ^= state_ >> 27U;
        return state_ * 2685821657736338717U;
    }
    std::uint8_t byte() { return static_cast<std::uint8_t>(next() >> 56U); }
    std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>((next() >> 32U) * n >> 32U); }
    float between(float low, float high) {
        return low + (high - low) * static_cast<float>(next() >> 40U) * (1.0F / 16777216.0F);
    }

  private:
    std::uint64_t state_;
};

}  // namespace test

#define CHECK(condition)                                              \
    do {                                                              \
        if (!(condition)) test::fail(__FILE__, __LINE__, #condition); \
    } while (false)
#define CLAIM(name)                                           \
    static void name();                                       \
    static const test::Register register_##name{#name, name}; \
    static void name()

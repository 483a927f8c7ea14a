// Whether the knob can trust its own loop and bus: how late the ticks are, how many exchanges with the motor board fail.
#pragma once

#include <cstdint>

#include "timing.hpp"

namespace chalumeau {

/// A tick that comes this long after the one before is an overrun, us.
constexpr std::uint32_t OVERRUN_US = 750;
/// The limits of the slopes hold for this mean period, us: K < 2 b / (3 T) against the b / (2 T) that is accepted, and the
/// 500 us that they were computed for (Colgate and Brown 1994).
constexpr float SLOWEST_MEAN_US = 600.0F;
/// One tick counts as this much at most, us: a single pause is an overrun and no slow loop.
constexpr std::uint32_t PAUSE_US = 5000;
/// Ticks over which the mean is formed.
constexpr float MEAN_TICKS = 128.0F;

/// Adds one, up to the end.
inline void count_up(std::uint16_t& counter) { counter = counter == UINT16_MAX ? counter : static_cast<std::uint16_t>(counter + 1); }

class Pace {
  public:
    void tick(std::uint32_t passed_us) {
        if (passed_us > OVERRUN_US) {
            count_up(overruns_);
        }
        const std::uint32_t counted = passed_us > PAUSE_US ? PAUSE_US : passed_us;
        mean_us_ += (static_cast<float>(counted) - mean_us_) * (1.0F / MEAN_TICKS);
    }
    /// The loop is slower than the limits of the slopes assume.
    bool slow() const { return mean_us_ > SLOWEST_MEAN_US; }
    std::uint16_t overruns() const { return overruns_; }

  private:
    float mean_us_ = 1e6F * LOOP_S;
    std::uint16_t overruns_ = 0;
};

/// Three failures in a row are a fault, and so is one exchange in four for long: a failure weighs four successes.
constexpr std::uint8_t BUS_FAILURES = 3;
constexpr std::uint8_t BUS_FAILURE_WEIGHT = 4;
constexpr std::uint8_t BUS_FAULT_WEIGHT = 48;
constexpr std::uint8_t BUS_WELL_WEIGHT = 8;

class BusHealth {
  public:
    void exchange(bool ok) {
        if (ok) {
            in_row_ = 0;
            weight_ = weight_ > 0 ? static_cast<std::uint8_t>(weight_ - 1) : weight_;
        } else {
            count_up(errors_);
            in_row_ = in_row_ < BUS_FAILURES ? static_cast<std::uint8_t>(in_row_ + 1) : in_row_;
            weight_ = weight_ + BUS_FAILURE_WEIGHT > BUS_FAULT_WEIGHT
                          ? BUS_FAULT_WEIGHT
                          : static_cast<std::uint8_t>(weight_ + BUS_FAILURE_WEIGHT);
        }
        ill_ = in_row_ >= BUS_FAILURES || weight_ >= BUS_FAULT_WEIGHT || (ill_ && weight_ > BUS_WELL_WEIGHT);
    }
    bool ill() const { return ill_; }
    std::uint8_t in_row() const { return in_row_; }
    std::uint16_t errors() const { return errors_; }

  private:
    std::uint16_t errors_ = 0;
    std::uint8_t in_row_ = 0;
    std::uint8_t weight_ = 0;
    bool ill_ = false;
};

}  // namespace chalumeau

// A change of parameters changes what the hand feels only slowly: the torque the new law lacks is added back and fades.
#pragma once

#include "law.hpp"

namespace chalumeau {

/// Fastest change of torque by a change of parameters, mNm/s (5 N m/s).
constexpr float SLEW_MNM_PER_S = 5000.0F;

/// The torque still owed to the hand.
class Morph {
  public:
    /// The law has changed where the hand is: `before` and `after` are the two laws' torques there, as the ceiling cuts them.
    /// Several changes in a row add up, so that what is felt stays continuous; and so do their rates, so that a later change never
    /// slows an earlier one: each is over after its own `morph_ms`, but where the slew rate forbids.
    void begin(float before, float after, std::uint16_t morph_ms) {
        const float change = before - after;
        const float size = change < 0.0F ? -change : change;
        const float rate = active() ? rate_ : 0.0F;
        owed_ += change;
        rate_ = least(SLEW_MNM_PER_S, rate + size * 1000.0F / static_cast<float>(morph_ms));
    }

    /// What to add to the law's torque in this tick, mNm.
    float tick(float dt_s) {
        const float fall = rate_ * dt_s;
        if (owed_ > fall) {
            owed_ -= fall;
        } else if (owed_ < -fall) {
            owed_ += fall;
        } else {
            owed_ = 0.0F;
        }
        return owed_;
    }

    void clear() { owed_ = 0.0F; }
    bool active() const { return owed_ != 0.0F; }

  private:
    float owed_ = 0.0F;
    float rate_ = 0.0F;  // mNm/s
};

}  // namespace chalumeau

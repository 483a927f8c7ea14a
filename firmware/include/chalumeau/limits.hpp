// Limits of torque and speed. Torque is clamped last, between the law and the motor: by the ceiling of the user, of the
// device, of the compiler, and of heat.
#pragma once

#include "law.hpp"
#include "morph.hpp"

namespace chalumeau {

/// 45 Ncm, whatever anybody asks.
constexpr float HARD_CAP_MNM = CEILING_MOST_MNM;
/// Speed above which the motor is switched off, rad/s.
constexpr float OVER_SPEED = 60.0F;
/// A knob that turns faster than this is not armed, rad/s.
constexpr float ARM_SPEED = 2.0F;
/// Heat is a mean of the squared torque over this time.
constexpr float THERMAL_S = 10.0F;
/// How fast the ceiling sinks to the continuous rating and rises again, mNm/s: not to be felt as a step (judgement).
constexpr float THERMAL_SLEW = 100.0F;
/// The rating applies until the mean has fallen to this share of it, so that the ceiling does not flutter.
constexpr float THERMAL_RELEASE = 0.9F;

class Limits {
  public:
    Limits(float device_mnm, float rating_mnm)
        : device_(least(device_mnm, HARD_CAP_MNM)), rating_(least(rating_mnm, device_)), thermal_(device_) {}

    /// What another ARM allows; lower at once, higher at the slew rate of rule 5: see `clamp`.
    void allow(float user_mnm) { user_ = least(user_mnm, device_); }

    /// What ALIVE allows: never more than before, since no act of the user stands behind it.
    void lower(float user_mnm) { user_ = least(user_mnm, user_); }

    void disarm() {
        now_ = 0.0F;
        user_ = 0.0F;
    }
    /// The soft start takes care of the rise.
    void arm(float user_mnm) { user_ = now_ = least(user_mnm, device_); }

    /// The torque allowed, mNm, of a law's torque and of what is owed to the hand where parameters change. Call once per tick. The law is cut before it is
    /// added, too: the hand has never felt more of it than this, so that is all a change of parameters owes.
    float clamp(float law, float owed, bool is_changing, float dt_s) {
        // A ceiling rises after a change of parameters is over: both at once would be twice as fast.
        now_ = least(user_, is_changing ? now_ : now_ + SLEW_MNM_PER_S * dt_s);
        const float wanted = cut(law) + owed;
        const float allowed = cut(wanted);
        limited_ = cut(law) != law || allowed != wanted;
        return allowed;
    }

    /// As much of a torque as the present ceiling allows, mNm.
    float cut(float torque) const {
        const float ceiling = ceiling_mnm();
        return torque > ceiling ? ceiling : (torque < -ceiling ? -ceiling : torque);
    }

    /// What was really commanded heats the motor.
    void heat(float torque, float dt_s) {
        mean_square_ += (torque * torque - mean_square_) * least(1.0F, dt_s / THERMAL_S);
        const float rated = rating_ * rating_;
        if (mean_square_ > rated) {
            hot_ = true;
        } else if (mean_square_ < THERMAL_RELEASE * THERMAL_RELEASE * rated) {
            hot_ = false;
        }
        const float step = THERMAL_SLEW * dt_s;
        thermal_ = hot_ ? most(rating_, thermal_ - step) : least(device_, thermal_ + step);
    }

    /// The present ceiling of all but the board.
    float ceiling_mnm() const { return least(now_, thermal_); }
    bool limited() const { return limited_; }
    bool hot() const { return hot_ || thermal_ < device_; }
    float device_mnm() const { return device_; }

  private:
    float device_;
    float rating_;
    float thermal_;
    float user_ = 0.0F;
    float now_ = 0.0F;
    float mean_square_ = 0.0F;
    bool hot_ = false;
    bool limited_ = false;
};

}  // namespace chalumeau

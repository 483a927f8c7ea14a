// Torque against angle: the reference flow, the monotone pressure law, walls, slap spring, marks. Restoring torque is
// negative at positive angles; mNm, degrees, and indices of the reference table (3600 to the reference closing pressure).
//
// The reference flow: u(p) = H sqrt(p) - p^1.5 / k for p of 0 to H k, and nothing past closure. Its infinite slope at the origin
// makes an undamped knob swing about it, so below p0 the root gives way to
//     sqrt(p0) (1.25 s - 0.25 s^3), s = p / p0,
// which meets it with equal value and slope; from p0 on the law is exact. p0 is 6 degrees of the hand, at most a quarter
// of the way to the peak.
#pragma once

#include "../pressure_table_values.h"
#include "messages.hpp"

namespace chalumeau {

constexpr float INDEX_PER_P = 3600.0F;
constexpr float DEG_PER_RAD = 57.2957795F;
constexpr float START_DEG = 6.0F;                 // width of the regularised origin: a tremor's size, by judgement
constexpr float START_OF_CLOSURE = 1.0F / 12.0F;  // and at most this share of H k: a quarter of the way to the peak
constexpr float START_SLOPE = 1.25F;              // of 1.25 s - 0.25 s^3 at 0
constexpr float MARK_DEG = 6.0F;                  // half width of mark and step: felt as one thing, by judgement
constexpr float MARK_SLOPE = 1.5396007F;          // steepest of (1 - x^2)^2: 8 / (3 sqrt 3)
constexpr float STEP_SLOPE = 0.75F;               // steepest of the step, per half width
constexpr float SLAP_DEG = -100.0F;               // TorqueTuner's -1000 counts
constexpr float WALL_SOFT_DEG = 1.0F;             // the wall's damping sets in over this depth
constexpr float WALL_DAMPING_MNMS = 2.0F;         // takes the rebound, by judgement
constexpr float FRICTION_SPEED = 0.5F;            // rad/s at which Coulomb friction begins to be itself, by judgement
constexpr float VISCOUS_MAX_MNMS = 20.0F;         // slope of damping and friction at rest: more shakes a light knob

/// A table between its points. An index that is no number counts as one beyond the end.
inline float table_at(const float* table, float index) {
    if (!(index < INDEX_PER_P)) {
        return table[3600];
    }
    const auto below = static_cast<int>(index);
    return table[below] + (index - static_cast<float>(below)) * (table[below + 1] - table[below]);
}

/// Square root of p = index / 3600 from the table; past its end by sqrt(p) = 4 sqrt(p / 16), so up to p = 16.
inline float root_at(float index) {
    return index <= INDEX_PER_P ? table_at(rp_table, index) : 4.0F * table_at(rp_table, index * (1.0F / 16.0F));
}

/// p to the power of 1.5, likewise.
inline float power_at(float index) {
    return index <= INDEX_PER_P ? table_at(rp_B_table, index) : 64.0F * table_at(rp_B_table, index * (1.0F / 16.0F));
}

/// The reference flow at a whole index of its table, nothing else.
inline float seed_flow(std::uint16_t index, float h, float k) {
    const std::uint16_t at = index > 3600 ? std::uint16_t{3600} : index;
    return (h * rp_table[at] - rp_B_table[at] / k) * static_cast<float>(rp_sgn_table[at]);
}

/// The physical flow at an index of either sign. With a negative pressure difference the opening grows,
/// -(H sqrt|p| + |p|^1.5 / k), where the notebook's odd form would close at -1. |index| up to 57600.
inline float physical_flow(float index, float h, float k) {
    if (index < 0.0F) {
        return -(h * root_at(-index) + power_at(-index) / k);
    }
    return index >= h * k * INDEX_PER_P ? 0.0F : h * root_at(index) - power_at(index) / k;
}

/// Smooth sign: tanh by its Pade form, which reaches 1 with slope 0 at 3.
inline float smooth_sign(float x) {
    if (x >= 3.0F) {
        return 1.0F;
    }
    if (x <= -3.0F) {
        return -1.0F;
    }
    const float xx = x * x;
    return x * (27.0F + xx) / (27.0F + 9.0F * xx);
}

/// A root by Newton, for what is computed once per FEEL; no libm in the core.
inline float square_root(float x) {
    if (!(x > 0.0F)) {
        return 0.0F;
    }
    std::uint32_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    bits = (bits >> 1U) + 0x1FBD1DF5U;  // halves the exponent: within 4 %
    float root;
    std::memcpy(&root, &bits, sizeof root);
    for (int i = 0; i < 3; ++i) {
        root = 0.5F * (root + x / root);
    }
    return root;
}

inline float least(float a, float b) { return a < b ? a : b; }
inline float most(float a, float b) { return a > b ? a : b; }

/// A FEEL that has passed `check_feel`, compiled into what a tick needs.
class Curve {
  public:
    Curve() : Curve(Feel{}) {}
    explicit Curve(const Feel& feel) {
        law_ = feel.law <= 2 ? static_cast<Law>(feel.law) : Law::Free;
        h_ = feel.h;
        inverse_k_ = 1.0F / feel.k;
        scale_ = feel.scale_mnm;
        offset_ = feel.offset_deg;
        index_per_deg_ = 10.0F * feel.stretch;
        closure_index_ = feel.h * feel.k * INDEX_PER_P;
        start_index_ = least(START_DEG * index_per_deg_, START_OF_CLOSURE * closure_index_);
        const float start_root = square_root(start_index_ / INDEX_PER_P);
        start_h_ = feel.h * start_root;
        origin_slope_ = START_SLOPE * start_h_ / start_index_;
        spring_ = scale_ / closure_index_;
        slap_edge_ = SLAP_DEG + least(offset_, 0.0F);
        slap_ = feel.slap_mnm_per_deg;
        wall_at_ = feel.wall_deg;
        wall_ = feel.wall_mnm_per_deg;
        // A mark that would begin before the origin is moved to begin there, so that torque at the origin is 0.
        mark_at_ = most(feel.a_on_deg, offset_ + MARK_DEG);
        mark_ = 0.1F * static_cast<float>(feel.detent);
        damping_ = feel.damping_mnms;
        friction_ = 0.1F * static_cast<float>(feel.friction);
        const float viscous_left = most(VISCOUS_MAX_MNMS - damping_, 0.2F * VISCOUS_MAX_MNMS);
        inverse_friction_speed_ = 1.0F / most(FRICTION_SPEED, friction_ / viscous_left);
    }

    /// Torque at rest, mNm.
    float at_rest(float angle_deg) const {
        if (law_ == Law::Free) {
            return 0.0F;
        }
        float torque = 0.0F;
        const float index = (angle_deg - offset_) * index_per_deg_;
        if (index > 0.0F) {
            torque = law_ == Law::Flow ? -scale_ * flow(index) - mark_ * bump(angle_deg)
                                       : -spring_ * least(index, closure_index_) - mark_ * step(angle_deg);
        }
        if (angle_deg < slap_edge_) {
            torque += least(slap_ * (slap_edge_ - angle_deg), scale_);
        }
        if (angle_deg > wall_at_) {
            torque -= wall_ * (angle_deg - wall_at_);
        }
        return torque;
    }

    /// What movement adds, mNm; velocity in rad/s.
    float of_motion(float angle_deg, float velocity) const {
        float torque = -damping_ * velocity - friction_ * smooth_sign(velocity * inverse_friction_speed_);
        if (law_ != Law::Free && wall_ > 0.0F && angle_deg > wall_at_ && velocity > 0.0F) {
            // One-sided: the wall takes the blow and does not stick to the hand on its way out.
            torque -= WALL_DAMPING_MNMS * velocity * least(1.0F, (angle_deg - wall_at_) / WALL_SOFT_DEG);
        }
        return torque;
    }

    float torque(float angle_deg, float velocity) const { return at_rest(angle_deg) + of_motion(angle_deg, velocity); }

    /// The flow law's u, regularised at the origin and closed past H k; index above 0.
    float flow(float index) const {
        if (index >= closure_index_) {
            return 0.0F;
        }
        const float closing = power_at(index) * inverse_k_;
        if (index < start_index_) {
            const float s = index / start_index_;
            return start_h_ * s * (1.25F - 0.25F * s * s) - closing;
        }
        return h_ * root_at(index) - closing;
    }

    /// Steepest restoring slope, N m/rad.
    float stiffness() const {
        if (law_ == Law::Free) {
            return 0.0F;
        }
        const bool is_flow = law_ == Law::Flow;
        const float mark = mark_ / MARK_DEG * (is_flow ? MARK_SLOPE : STEP_SLOPE);
        float law;
        float at_wall = 0.0F;
        if (is_flow) {
            law = most(scale_ * origin_slope_ * index_per_deg_, restoring_at(mark_at_ - MARK_DEG) + mark);
            at_wall = restoring_at(wall_at_);
        } else {
            const float spring = spring_ * index_per_deg_;
            law = spring + mark;
            at_wall = wall_at_ < closure_deg() ? spring : 0.0F;
        }
        const float wall = wall_ + at_wall + (wall_at_ < mark_at_ + MARK_DEG ? mark : 0.0F);
        return 1e-3F * DEG_PER_RAD * most(law, most(wall, slap_));
    }

    /// Steepest positive feedback (torque that grows with being followed), N m/rad.
    float push() const {
        if (law_ != Law::Flow) {
            return 0.0F;
        }
        const float mark = mark_ / MARK_DEG * MARK_SLOPE;
        const float end = closure_deg();
        const float behind_mark = -slope_at(least(mark_at_ + MARK_DEG, end));
        return 1e-3F * DEG_PER_RAD * most(most(0.0F, -slope_at(end)), mark + most(0.0F, behind_mark));
    }

    float closure_deg() const { return offset_ + closure_index_ / index_per_deg_; }
    float slap_edge_deg() const { return slap_edge_; }
    float wall_deg() const { return wall_at_; }
    /// Where the flow law becomes exact, degrees.
    float exact_from_deg() const { return offset_ + start_index_ / index_per_deg_; }

  private:
    float bump(float angle_deg) const {
        const float x = (angle_deg - mark_at_) / MARK_DEG;
        const float rest = 1.0F - x * x;
        return rest > 0.0F ? rest * rest : 0.0F;
    }
    float step(float angle_deg) const {
        const float x = (angle_deg - mark_at_) / MARK_DEG;
        if (x <= -1.0F) {
            return 0.0F;
        }
        return x >= 1.0F ? 1.0F : 0.5F + x * (0.75F - 0.25F * x * x);
    }
    /// Slope of the flow law's magnitude, mNm per degree, up to closure; before the origin as at it.
    float slope_at(float angle_deg) const {
        const float index = (angle_deg - offset_) * index_per_deg_;
        if (index <= start_index_) {
            return scale_ * origin_slope_ * index_per_deg_;
        }
        const float root = square_root(index / INDEX_PER_P);
        return scale_ * (0.5F * h_ / root - 1.5F * root * inverse_k_) / INDEX_PER_P * index_per_deg_;
    }
    float restoring_at(float angle_deg) const {
        return angle_deg >= closure_deg() ? 0.0F : most(0.0F, slope_at(angle_deg));
    }

    Law law_;
    float h_, inverse_k_, scale_, offset_, index_per_deg_, closure_index_, start_index_, start_h_, origin_slope_;
    float spring_, slap_edge_, slap_, wall_at_, wall_, mark_at_, mark_, damping_, friction_, inverse_friction_speed_;
};

/// What a device allows.
struct FeelLimits {
    float stiffness = 0.5F;  // N m/rad
    float push = 0.2F;       // N m/rad
    float ceiling_mnm = 450.0F;
};

constexpr float CLOSURE_MAX_DEG = 3600.0F;
constexpr float SLIP_H = 3.67423461F;   // sqrt(27 / 2), written in the notebook's last line for sqrt(27) / 2
constexpr float SLIP_K = 0.136082763F;  // 27 / (4 H^3): with it H k = 0.5
constexpr float SLIP_NEAR = 1e-4F;      // as near as somebody types it

inline bool is_near(float a, float b) { return a - b <= SLIP_NEAR * b && b - a <= SLIP_NEAR * b; }

/// Ranges of the protocol, then what would shake or push.
inline Verdict check_feel(const Feel& feel, const FeelLimits& limits) {
    const Verdict ranges = feel.ranges();
    if (ranges.code != Refusal::None) {
        return ranges;
    }
    if (feel.law == static_cast<std::uint8_t>(Law::Free)) {
        return {};
    }
    if (feel.scale_mnm > limits.ceiling_mnm) {
        return {Refusal::Scale, feel.scale_mnm};
    }
    const Curve curve(feel);
    if ((is_near(feel.h, SLIP_H) && is_near(feel.k, SLIP_K)) || curve.closure_deg() > CLOSURE_MAX_DEG) {
        return {Refusal::Closure, feel.h * feel.k};
    }
    if (curve.stiffness() > limits.stiffness) {
        return {Refusal::Stiffness, curve.stiffness()};
    }
    if (curve.push() > limits.push) {
        return {Refusal::Push, curve.push()};
    }
    return {};
}

}  // namespace chalumeau

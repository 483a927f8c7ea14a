// Decides whether the motor may turn: session, arming, freshness, standing faults and the share of torque they leave.
// `docs/protocol.md`, "Session" and "Safety". The watchdog is in `watchdog.hpp`, the sign probe in `probe.hpp`.
#pragma once

#include "limits.hpp"
#include "messages.hpp"
#include "timing.hpp"
#include "watchdog.hpp"

namespace chalumeau {

/// What the host answers, ARM or ALIVE, may be this old: a knob that hears an old permission must not follow it.
constexpr std::uint32_t FRESH_US = 100000;

/// Faults that last as long as their cause does, each one bit.
class StandingFaults {
  public:
    void set(Cause cause, bool stands) {
        const auto bit = static_cast<std::uint16_t>(1U << static_cast<unsigned>(cause));
        bits_ = static_cast<std::uint16_t>(stands ? bits_ | bit : bits_ & ~bit);
    }
    bool any() const { return bits_ != 0; }
    bool has(Cause cause) const { return (bits_ >> static_cast<unsigned>(cause) & 1U) != 0; }
    Cause first() const {
        for (std::uint8_t cause = 1; cause < 16; ++cause) {
            if (has(static_cast<Cause>(cause))) {
                return static_cast<Cause>(cause);
            }
        }
        return Cause::None;
    }

  private:
    std::uint16_t bits_ = 0;
};

enum class Phase : std::uint8_t { Disarmed, Probing, Armed, Fading };

class Session {
  public:
    /// `epoch` is where the count of disarmings begins: at random, so that a recording of another day does not fit.
    Session(std::uint8_t major, std::uint32_t watchdog_ms, std::uint16_t epoch)
        : major_(major), watchdog_(watchdog_ms), epoch_(epoch) {}

    /// A host sends HELLO. Returns why an armed session ended: None, NewSession or Version.
    Cause hello(const Hello& hello) {
        const bool fits = hello.major == major_;
        const bool same = known_ && hello.session == id_;
        const bool held = phase_ != Phase::Disarmed;
        known_ = true;
        id_ = hello.session;
        version_fits_ = fits;
        begins_ = !same;
        if (begins_) {
            standing.set(Cause::Watchdog, false);  // the silence was another host's
            probed_ = false;
            ++epoch_;
        }
        if (!fits && held) {
            return Cause::Version;
        }
        return !same && held ? Cause::NewSession : Cause::None;
    }

    /// Whether the last HELLO began a session.
    bool begins() const { return begins_; }
    bool knows(std::uint32_t session) const { return known_ && session == id_; }
    bool version_fits() const { return version_fits_; }
    std::uint32_t id() const { return id_; }

    /// Changes with each disarming. A permission for an earlier epoch is void.
    std::uint16_t epoch() const { return epoch_; }

    /// Age of a permission given at the knob's time `t_us`; more than FRESH_US if it is none of this epoch.
    std::uint32_t age_us(const Arm& permission, std::uint32_t t_us) const {
        const bool is_ours = permission.stamped && permission.epoch == epoch_;
        return is_ours ? t_us - permission.heard_us : UINT32_MAX;
    }

    /// A permission was given before one of this epoch that was heeded: the line repeats itself. What was heeded longer ago
    /// than FRESH_US cannot overtake a fresh one.
    bool is_overtaken(const Arm& permission, std::uint32_t now_us) const {
        return heeded_ && heeded_epoch_ == epoch_ && now_us - heeded_at_us_ <= FRESH_US &&
               static_cast<std::int32_t>(permission.heard_us - heeded_us_) < 0;
    }

    /// Arms, or says why not. `speed` is a magnitude, rad/s; `probes`: this knob probes its signs first.
    Refusal arm(const Arm& arm, std::uint32_t age_us, float speed, std::uint32_t now_us, bool probes) {
        if (!version_fits_) {
            return known_ ? Refusal::Version : Refusal::Session;
        }
        if (!knows(arm.session)) {
            return Refusal::Session;
        }
        if (!arm.stamped) {
            return Refusal::Version;  // a host that cannot say when it heard the knob
        }
        if (age_us > FRESH_US || is_overtaken(arm, now_us)) {
            return Refusal::Stale;
        }
        if (standing.any() || phase_ == Phase::Fading) {
            return Refusal::Fault;
        }
        if (phase_ == Phase::Armed || phase_ == Phase::Probing) {
            heed(arm, now_us);
            return Refusal::None;  // a second ARM sets its ceiling, but does not feed the watchdog
        }
        if (!(speed < ARM_SPEED)) {
            return Refusal::Moving;
        }
        heed(arm, now_us);
        phase_ = probes && !probed_ ? Phase::Probing : Phase::Armed;
        gain_ = 0.0F;
        watchdog_.start(now_us - age_us);
        return Refusal::None;
    }

    /// The probe has found both signs right.
    void probed() {
        probed_ = true;
        phase_ = Phase::Armed;
        gain_ = 0.0F;
    }

    /// A fresh ALIVE of this session, which nothing has overtaken.
    void alive(const Arm& alive, std::uint32_t age_us, std::uint32_t now_us) {
        heed(alive, now_us);
        watchdog_.feed(now_us - age_us);
        standing.set(Cause::Watchdog, false);
    }

    /// Torque off within this tick.
    void cut() {
        phase_ = Phase::Disarmed;
        gain_ = 0.0F;
        ++epoch_;
    }
    void forget() { known_ = false; }

    /// Torque fades from here. Returns true if it ends at once: a probe has none to fade.
    bool fade() {
        if (phase_ == Phase::Armed) {
            phase_ = Phase::Fading;
            ++epoch_;
        } else if (phase_ == Phase::Probing) {
            cut();
            return true;
        }
        return false;
    }

    bool silent(std::uint32_t now_us) const {
        return (phase_ == Phase::Armed || phase_ == Phase::Probing) && watchdog_.expired(now_us);
    }

    /// The share of torque this tick may have, 0 to 1. Returns true in the tick a fade ends.
    bool tick(float dt_s) {
        if (phase_ == Phase::Armed) {
            gain_ += dt_s * (1000.0F / static_cast<float>(SOFT_START_MS));
            gain_ = gain_ > 1.0F ? 1.0F : gain_;
        } else if (phase_ == Phase::Fading) {
            gain_ -= dt_s * (1000.0F / static_cast<float>(FADE_MS));
            if (gain_ <= 0.0F) {
                cut();
                return true;
            }
        }
        return false;
    }

    float gain() const { return gain_; }
    Phase phase() const { return phase_; }

    StandingFaults standing;

  private:
    void heed(const Arm& permission, std::uint32_t now_us) {
        heeded_ = true;
        heeded_at_us_ = now_us;
        heeded_epoch_ = permission.epoch;
        heeded_us_ = permission.heard_us;
    }

    std::uint8_t major_;
    Watchdog watchdog_;
    std::uint32_t id_ = 0;
    std::uint32_t heeded_us_ = 0;     // what the newest permission heeded answers
    std::uint32_t heeded_at_us_ = 0;  // and when it was heeded
    std::uint16_t heeded_epoch_ = 0;
    bool heeded_ = false;
    std::uint16_t epoch_;
    bool known_ = false;
    bool begins_ = false;
    bool version_fits_ = false;
    bool probed_ = false;
    Phase phase_ = Phase::Disarmed;
    float gain_ = 0.0F;
};

}  // namespace chalumeau

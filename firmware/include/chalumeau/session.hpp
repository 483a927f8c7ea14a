// Decides whether the motor may turn: session, arming, standing faults and the share of torque they leave.
// `docs/protocol.md`, "Session" and "Safety". The watchdog is in `watchdog.hpp`.
#pragma once

#include "limits.hpp"
#include "messages.hpp"
#include "timing.hpp"
#include "watchdog.hpp"

namespace chalumeau {


/// Faults that last as long as their cause does, each one bit of a byte.
class StandingFaults {
  public:
    void set(Cause cause, bool stands) {
        const auto bit = static_cast<std::uint8_t>(1U << static_cast<unsigned>(cause));
        bits_ = static_cast<std::uint8_t>(stands ? bits_ | bit : bits_ & ~bit);
    }
    bool any() const { return bits_ != 0; }
    bool has(Cause cause) const { return (bits_ >> static_cast<unsigned>(cause) & 1U) != 0; }
    Cause first() const {
        for (std::uint8_t cause = 1; cause < 8; ++cause) {
            if (has(static_cast<Cause>(cause))) {
                return static_cast<Cause>(cause);
            }
        }
        return Cause::None;
    }

  private:
    std::uint8_t bits_ = 0;
};

enum class Phase : std::uint8_t { Disarmed, Armed, Fading };

class Session {
  public:
    Session(std::uint8_t major, std::uint32_t watchdog_ms) : major_(major), watchdog_(watchdog_ms) {}

    /// A host sends HELLO. Returns why an armed session ended: None, NewSession or Version.
    Cause hello(const Hello& hello) {
        const bool fits = hello.major == major_;
        const bool same = known_ && hello.session == id_;
        const bool held = phase_ != Phase::Disarmed;
        known_ = true;
        id_ = hello.session;
        version_fits_ = fits;
        fresh_ = !same;
        if (fresh_) {
            standing.set(Cause::Watchdog, false);  // the silence was another host's
        }
        if (!fits && held) {
            return Cause::Version;
        }
        return !same && held ? Cause::NewSession : Cause::None;
    }

    /// Whether the last HELLO began a session.
    bool fresh() const { return fresh_; }
    bool knows(std::uint32_t session) const { return known_ && session == id_; }
    bool version_fits() const { return version_fits_; }
    std::uint32_t id() const { return id_; }

    /// Arms, or says why not. `speed` is a magnitude, rad/s.
    Refusal arm(const Arm& arm, float speed, std::uint32_t now_us) {
        if (!version_fits_) {
            return known_ ? Refusal::Version : Refusal::Session;
        }
        if (!knows(arm.session)) {
            return Refusal::Session;
        }
        if (standing.any() || phase_ == Phase::Fading) {
            return Refusal::Fault;
        }
        if (phase_ == Phase::Armed) {
            return Refusal::None;  // a second ARM sets its ceiling, but does not feed the watchdog
        }
        if (!(speed < ARM_SPEED)) {
            return Refusal::Moving;
        }
        phase_ = Phase::Armed;
        gain_ = 0.0F;
        watchdog_.feed(now_us);
        return Refusal::None;
    }

    /// A valid ALIVE of this session.
    void alive(std::uint32_t now_us) {
        watchdog_.feed(now_us);
        standing.set(Cause::Watchdog, false);
    }

    /// Torque off within this tick.
    void cut() {
        phase_ = Phase::Disarmed;
        gain_ = 0.0F;
    }
    void forget() { known_ = false; }

    /// Torque fades from here.
    void fade() {
        if (phase_ == Phase::Armed) {
            phase_ = Phase::Fading;
        }
    }

    bool silent(std::uint32_t now_us) const { return phase_ == Phase::Armed && watchdog_.expired(now_us); }

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
    std::uint8_t major_;
    Watchdog watchdog_;
    std::uint32_t id_ = 0;
    bool known_ = false;
    bool fresh_ = false;
    bool version_fits_ = false;
    Phase phase_ = Phase::Disarmed;
    float gain_ = 0.0F;
};

}  // namespace chalumeau

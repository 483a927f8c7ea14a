// Anarchy: a host that says anything at any time over a line that does anything, sensors that lie, a clock that staggers;
// and beside the device a judge that knows three rules only. No torque without a permission that was valid when it came;
// never more than the least ceiling in force; none later than 150 ms after the last thing a living host said.

#include <algorithm>

#include "check.hpp"
#include "host.hpp"

using namespace chalumeau;
using test::SESSION;

namespace {

/// What the device may do, judged from outside: from what was sent and what the device says of itself in STATE.
struct Judge {
    bool permitted = false;      // an ARM was accepted in this epoch
    float ceiling = 0.0F;
    std::uint64_t lived_us = 0;  // when the knob sent what the last fresh permission answers
    float worst_over = 0.0F;
    std::uint64_t worst_late_us = 0;
    unsigned long torques = 0;
    unsigned long without = 0;
};

class Anarchy {
  public:
    explicit Anarchy(std::uint64_t seed) : random_(seed), device_(config(random_)) {}

    Judge judge;

    void tick() {
        if (random_.below(3) == 0) {
            speak();
        }
        move();
        const std::uint32_t before = device_.epoch();
        const std::uint32_t passed = stagger();
        real_us_ += passed;
        t_us_ += passed;
        const float torque = device_.tick(t_us_, reading_);
        if (device_.epoch() != static_cast<std::uint16_t>(before)) {
            epoch_changed();
        }
        weigh(torque);
        std::uint8_t bytes[256];
        device_.transmit(bytes, sizeof bytes);
    }

  private:
    static Config config(test::Random& random) {
        Config config = test::damped();
        config.ceiling_mnm = static_cast<std::uint16_t>(random.below(600));
        config.probe_mnm = random.below(2) == 0 ? 0.0F : PROBE_MNM;
        config.epoch = static_cast<std::uint16_t>(random.below(65536));
        config.calibrated = random.below(4) != 0;
        return config;
    }

    std::uint32_t stagger() {
        switch (random_.below(400)) {
            case 0: return random_.below(30000);
            case 1: return 0;
            case 2: return random_.below(2000);
            default: return 480 + random_.below(41);
        }
    }

    /// A hand that does anything, on a knob whose sensors are mostly right.
    void move() {
        if (random_.below(3000) == 0) {
            step_ = static_cast<std::int32_t>(random_.below(25)) - 12;
        } else if (random_.below(1500) == 0) {
            step_ = 0;
        }
        reading_.counts += step_;
        reading_.velocity_rpm = static_cast<float>(step_) * 33.3333F;
        reading_.bus_ok = random_.below(200) != 0;
        reading_.supply_ok = random_.below(20000) != 0;
        reading_.stop = random_.below(15000) == 0;
        switch (random_.below(12000)) {
            case 0: reading_.counts += static_cast<std::int32_t>(random_.below(4000)) - 2000; break;
            case 1: reading_.velocity_rpm = NAN; break;
            case 2: reading_.velocity_rpm = random_.between(-1e30F, 1e30F); break;
            default: break;
        }
    }

    void speak() {
        const std::uint32_t what = random_.below(100);
        if (what < 4) {
            Hello hello;
            hello.session = random_.below(20) == 0 ? SESSION + 1 : SESSION;
            hello.major = random_.below(40) == 0 ? 2 : 1;
            has_host_ = send(Type::Hello, hello.encode()) || has_host_;
        } else if (what < 30) {
            send(Type::Feel, feel().encode());
        } else if (what < 80) {
            permit(what < 45 ? Type::Arm : Type::Alive);
        } else if (what == 80 && random_.below(40) == 0) {
            send(Type::Free, Payload{});
        } else if (what == 81 && random_.below(40) == 0) {
            const bool is_ours = device_.info().session == SESSION;
            has_host_ = !(send(Type::Bye, Bye{SESSION}.encode()) && is_ours) && has_host_;
        } else if (what == 82) {
            send(Type::Zero, Zero{static_cast<std::int32_t>(random_.below(800000)) - 400000}.encode());
        } else if (what == 83) {
            send(Type::Rate, Rate{static_cast<std::uint16_t>(random_.below(1200))}.encode());
        } else if (what < 88) {
            std::uint8_t noise[40];
            for (std::uint8_t& byte : noise) {
                byte = random_.byte();
            }
            device_.receive(noise, sizeof noise);
        }
    }

    Feel feel() {
        Feel feel = test::reference_feel();
        feel.feel_id = random_.byte();
        feel.law = static_cast<std::uint8_t>(random_.below(4));
        feel.scale_mnm = random_.between(0.0F, 460.0F);
        feel.stretch = random_.between(0.1F, 4.0F);
        feel.wall_deg = random_.between(10.0F, 300.0F);
        feel.wall_mnm_per_deg = random_.between(0.0F, 40.0F);
        feel.damping_mnms = random_.between(0.0F, 21.0F);
        feel.friction = static_cast<std::uint16_t>(random_.below(1010));
        feel.detent = static_cast<std::uint16_t>(random_.below(300));
        if (random_.below(500) == 0) {
            feel.h = NAN;
        }
        return feel;
    }

    /// ARM or ALIVE: of now, or of any time and epoch, whole or as version 1.0 has it.
    void permit(Type type) {
        const State now = device_.state();
        Arm permission{SESSION, static_cast<std::uint16_t>(random_.below(470)), now.epoch, now.t_us, true};
        switch (random_.below(8)) {
            case 0: permission.heard_us -= random_.below(200000); break;
            case 1: permission.epoch = static_cast<std::uint16_t>(permission.epoch - random_.below(3)); break;
            case 2: permission.heard_us = static_cast<std::uint32_t>(random_.next()); break;
            case 3: permission.stamped = random_.below(2) == 0; break;
            case 4: permission.session += random_.below(2); break;
            default: break;
        }
        const std::uint32_t age = now.t_us - permission.heard_us;
        const bool is_overtaken = has_heeded_ && heeded_epoch_ == now.epoch && static_cast<std::int32_t>(permission.heard_us - heeded_us_) < 0;
        const bool is_fresh = permission.stamped && permission.epoch == now.epoch && !is_overtaken &&
                              has_host_ && permission.session == device_.info().session && age <= FRESH_US && permission.ceiling_mnm <= CEILING_MOST_MNM;
        const bool held = (now.flags & (flag::ARMED | flag::PROBING)) != 0;
        const bool arrived = send(type, permission.encode());
        if (!is_fresh || !arrived) {
            return;
        }
        const bool holds = (device_.state().flags & (flag::ARMED | flag::PROBING)) != 0;
        if (type == Type::Arm && holds) {
            judge.permitted = true;
        }
        if (type == Type::Alive || (holds && !held)) {
            // A permission may only lengthen life by what it is worth.
            judge.lived_us = std::max(judge.lived_us, real_us_ > age ? real_us_ - age : 0);
        }
        if (holds || type == Type::Alive) {
            // Only ARM raises it.
            const auto ceiling = static_cast<float>(permission.ceiling_mnm);
            judge.ceiling = type == Type::Arm ? ceiling : std::min(judge.ceiling, ceiling);
            has_heeded_ = true;
            heeded_epoch_ = permission.epoch;
            heeded_us_ = permission.heard_us;
        }
    }

    /// Whether the frame arrived whole.
    bool send(Type type, const Payload& payload) {
        std::uint8_t frame[FRAME_MAX];
        std::uint8_t wire[SERIAL_FRAME_MAX];
        const std::size_t length =
            frame_encode(static_cast<std::uint8_t>(type), seq_++, payload.bytes, payload.length, frame);
        const std::size_t end = serial_encode(frame, length, wire);
        // Some frames are struck, some come twice.
        if (random_.below(30) == 0) {
            wire[1 + random_.below(static_cast<std::uint32_t>(end - 2))] ^= static_cast<std::uint8_t>(1U + random_.below(255));
        }
        const std::uint16_t before = device_.epoch();
        const std::uint32_t frames = device_.counts().frames;
        device_.receive(wire, end);
        if (random_.below(30) == 0) {
            device_.receive(wire, end);
        }
        if (device_.epoch() != before) {
            epoch_changed();
        }
        return device_.counts().frames != frames;
    }

    /// The device has disarmed; a fade of what was permitted may follow.
    void epoch_changed() { judge.permitted = false; }

    void weigh(float torque) {
        if (torque == 0.0F) {
            return;
        }
        ++judge.torques;
        const std::uint16_t flags = device_.state().flags;
        const bool fades = (flags & flag::FADING) != 0;
        if (!judge.permitted && !fades) {
            ++judge.without;
        }
        const float ceiling = std::min(judge.ceiling, static_cast<float>(device_.info().ceiling_mnm));
        judge.worst_over = std::max(judge.worst_over, std::fabs(torque) - ceiling);
        judge.worst_late_us = std::max(judge.worst_late_us, real_us_ - judge.lived_us);
    }

    test::Random random_;
    Device device_;
    Reading reading_;
    std::int32_t step_ = 0;
    bool has_host_ = false;
    bool has_heeded_ = false;
    std::uint16_t heeded_epoch_ = 0;
    std::uint32_t heeded_us_ = 0;
    std::uint32_t t_us_ = 0;
    std::uint64_t real_us_ = 0;
    std::uint8_t seq_ = 0;
};

}  // namespace

CLAIM(anarchy_no_torque_above_the_ceiling_none_without_a_permission_none_after_150_ms) {
    const unsigned long total = test::options().anarchy;
    const unsigned long life = 20000;
    Judge all;
    for (unsigned long seed = 1; seed * life <= total; ++seed) {
        Anarchy anarchy(seed);
        for (unsigned long i = 0; i < life; ++i) {
            anarchy.tick();
        }
        all.torques += anarchy.judge.torques;
        all.without += anarchy.judge.without;
        all.worst_over = std::max(all.worst_over, anarchy.judge.worst_over);
        all.worst_late_us = std::max(all.worst_late_us, anarchy.judge.worst_late_us);
    }
    std::printf("    %lu ticks, %lu with torque: %lu without permission, at most %.3f mNm above a ceiling, %.1f ms late\n",
                total, all.torques, all.without, static_cast<double>(all.worst_over),
                1e-3 * static_cast<double>(all.worst_late_us));
    CHECK(all.torques > total / 50);
    CHECK(all.without == 0);
    CHECK(all.worst_over <= 0.0F);
    CHECK(all.worst_late_us <= 150000);
}

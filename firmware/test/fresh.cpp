// Freshness: a permission that is old, recorded, or late on the line arms nothing and keeps nothing armed. The host here
// hears and speaks through a line that delays by as much as a test wants.

#include <algorithm>
#include <deque>
#include <utility>

#include "check.hpp"
#include "host.hpp"

using namespace chalumeau;
using test::SESSION;

namespace {

using WireBytes = std::vector<std::uint8_t>;

/// One direction of a line, which never overtakes itself.
class LateLine {
  public:
    void send(std::uint32_t arrives, const WireBytes& bytes) {
        if (!bytes.empty()) {
            const std::uint32_t last = waiting_.empty() ? arrives : waiting_.back().first;
            waiting_.push_back({std::max(arrives, last), bytes});
        }
    }
    WireBytes take(std::uint32_t tick) {
        WireBytes all;
        while (!waiting_.empty() && waiting_.front().first <= tick) {
            all.insert(all.end(), waiting_.front().second.begin(), waiting_.front().second.end());
            waiting_.pop_front();
        }
        return all;
    }

  private:
    std::deque<std::pair<std::uint32_t, WireBytes>> waiting_;
};

/// A host as the protocol wants it, a knob under a hand at 120 degrees, and the line between them. Times in ticks.
class LateSession {
  public:
    LateSession(bool midi, std::uint16_t epoch) : midi_(midi), device_(config(midi, epoch)) { turn(1200); }

    std::uint32_t to_knob = 0;  // delays
    std::uint32_t to_host = 0;
    bool alive = false;
    bool wants_arm = false;
    std::uint32_t session = SESSION;
    std::vector<std::pair<std::uint32_t, WireBytes>> recorded;

    std::uint32_t now() const { return tick_; }
    Device& device() { return device_; }
    bool armed() const { return device_.armed() || (device_.state().flags & flag::PROBING) != 0; }

    void say(Type type, const Payload& payload) {
        std::uint8_t frame[FRAME_MAX];
        std::uint8_t wire[SYSEX_MAX];
        const std::size_t length =
            frame_encode(static_cast<std::uint8_t>(type), seq_++, payload.bytes, payload.length, frame);
        const std::size_t end = midi_ ? sysex_encode(frame, length, wire) : serial_encode(frame, length, wire);
        put(WireBytes(wire, wire + end));
    }
    void put(const WireBytes& bytes) {
        recorded.push_back({tick_, bytes});
        line_to_knob_.send(tick_ + to_knob, bytes);
    }
    Payload permission() const { return Arm{session, 450, heard_.epoch, heard_.t_us, true}.encode(); }
    void greet() {
        Hello hello;
        hello.session = session;
        say(Type::Hello, hello.encode());
        say(Type::Feel, test::reference_feel().encode());
    }

    /// One tick; the torque of it.
    float step() {
        if (alive && has_heard_ && tick_ % (midi_ ? 200U : 40U) == 0) {
            say(Type::Alive, permission());
            if (wants_arm && tick_ % 200 == 0 && !armed()) {
                say(Type::Arm, permission());
            }
        }
        const WireBytes arrived = line_to_knob_.take(tick_);
        if (midi_) {
            device_.receive_midi(arrived.data(), arrived.size());
        } else {
            device_.receive(arrived.data(), arrived.size());
        }
        const float torque = device_.tick(500 * tick_, reading_);
        std::uint8_t bytes[1024];
        const std::size_t count = device_.transmit(bytes, sizeof bytes);
        line_to_host_.send(tick_ + to_host, WireBytes(bytes, bytes + count));
        for (std::uint8_t byte : line_to_host_.take(tick_)) {
            Frame frame;
            if ((midi_ ? midi_ears_.push(byte, frame) : ears_.push(byte, frame)) &&
                frame.type == static_cast<std::uint8_t>(Type::State)) {
                heard_.decode(frame.payload, frame.length);
                has_heard_ = true;
            }
        }
        ++tick_;
        return torque;
    }
    float run(std::uint32_t ticks) {
        float torque = 0.0F;
        for (std::uint32_t i = 0; i < ticks; ++i) {
            torque = step();
        }
        return torque;
    }

  private:
    static Config config(bool midi, std::uint16_t epoch) {
        Config config = test::damped();
        config.binding = midi ? Binding::Midi : Binding::Serial;
        config.epoch = epoch;
        return config;
    }
    void turn(std::int32_t counts) {
        reading_.has_velocity = false;
        for (; reading_.counts < counts; reading_.counts += 4) {
            step();
        }
        run(100);
    }

    bool midi_;
    Device device_;
    Reading reading_;
    LateLine line_to_knob_;
    LateLine line_to_host_;
    SerialDecoder ears_;
    MidiDecoder midi_ears_;
    State heard_;
    bool has_heard_ = false;
    std::uint32_t tick_ = 0;
    std::uint8_t seq_ = 0;
};

/// Greets over a line without delay, arms, and plays.
void play(LateSession& host) {
    host.greet();
    host.alive = true;
    host.wants_arm = true;
    host.run(800);
    host.wants_arm = false;
    CHECK(host.armed() && host.run(1) < -80.0F);
}

}  // namespace

CLAIM(fresh_an_arm_of_an_earlier_epoch_is_refused_at_any_age) {
    for (bool midi : {false, true}) {
        LateSession host(midi, 7);
        host.greet();
        host.alive = true;
        host.run(60);
        const Payload old = host.permission();
        host.say(Type::Arm, old);
        host.run(1);
        CHECK(host.armed());
        host.say(Type::Free, Payload{});
        // At once, after the host has heard of it, and 2.1 s later.
        for (std::uint32_t wait : {0U, 20U, 4200U}) {
            host.run(wait);
            host.say(Type::Arm, old);
            for (int i = 0; i < 400; ++i) {
                CHECK(host.step() == 0.0F && !host.armed());
            }
        }
        host.say(Type::Arm, host.permission());
        host.run(1);
        CHECK(host.armed());
    }
}

CLAIM(fresh_a_free_voids_an_arm_that_was_sent_before_it_even_if_it_found_nothing_to_free) {
    LateSession host(false, 0);
    host.greet();
    host.alive = true;
    host.run(60);
    const Payload old = host.permission();
    host.say(Type::Free, Payload{});
    host.say(Type::Arm, old);
    host.run(10);
    CHECK(!host.armed());
}

CLAIM(fresh_a_recorded_session_arms_nothing) {
    test::Random random(31);
    for (int trial = 0; trial < 1000; ++trial) {
        const auto epoch = static_cast<std::uint16_t>(random.next() >> 48U);
        LateSession host(trial % 4 == 0, epoch);
        play(host);
        const auto recorded = host.recorded;
        const std::uint32_t began = recorded.front().first;
        host.alive = false;
        if (trial % 3 == 0) {
            host.say(Type::Bye, Bye{SESSION}.encode());
        }
        host.run(1 + random.below(3000));
        while (host.run(1) != 0.0F || host.armed()) {
        }
        // On the same knob, a moment later; or on the knob after a new start, with or without the recording's own times.
        const bool restarts = trial % 2 == 1;
        const auto other = static_cast<std::uint16_t>(epoch + 1 + random.below(65000));
        LateSession again(trial % 4 == 0, other);
        LateSession& target = restarts ? again : host;
        const std::uint32_t start = restarts && random.below(2) == 0 ? 0 : target.now() + random.below(100);
        target.recorded.clear();
        std::size_t next = 0;
        for (int i = 0; i < 1600; ++i) {
            while (next < recorded.size() && target.now() >= start + recorded[next].first - (start == 0 ? 0 : began)) {
                target.put(recorded[next++].second);
            }
            CHECK(target.step() == 0.0F && !target.armed());
        }
        CHECK(next == recorded.size());
    }
}

CLAIM(fresh_a_late_line_never_keeps_torque_150_ms_after_the_host_has_died) {
    test::Random random(32);
    std::uint32_t longest = 0;
    for (int trial = 0; trial < 1000; ++trial) {
        LateSession host(false, 0);
        play(host);
        // The line becomes late, by 0 to 200 ms or by 1, 5, 30 s, in one direction or both.
        const std::uint32_t lates[] = {2000, 10000, 60000};
        const std::uint32_t late = random.below(4) == 0 ? lates[random.below(3)] : random.below(400);
        const std::uint32_t way = random.below(3);
        host.to_knob = way == 1 ? 0 : late;
        host.to_host = way == 0 ? 0 : late;
        host.wants_arm = random.below(2) == 0;  // a user who insists
        host.run(random.below(2 * late + 800));
        host.alive = false;  // the host dies; what it said is still on the line
        const std::uint32_t died = host.now();
        std::uint32_t last = died;
        const std::uint32_t until = died + late + 800;
        while (host.now() < until) {
            const std::uint32_t now = host.now();
            if (host.step() != 0.0F) {
                last = now;
            }
        }
        longest = std::max(longest, last - died);
    }
    std::printf("    1000 late lines: torque ends at most %.1f ms after the host\n", 0.5 * longest);
    CHECK(longest <= 300);
}

CLAIM(fresh_a_line_of_10_ms_each_way_plays_and_one_of_60_is_refused_with_its_age) {
    for (bool midi : {false, true}) {
        LateSession host(midi, 0);
        host.to_knob = host.to_host = 20;
        play(host);
        host.run(4000);
        CHECK(host.armed());
    }
    LateSession host(false, 0);
    host.to_knob = host.to_host = 120;
    host.greet();
    host.alive = host.wants_arm = true;
    for (int i = 0; i < 8000; ++i) {
        CHECK(host.step() == 0.0F && !host.armed());
    }
}

CLAIM(fresh_a_host_of_version_1_0_is_answered_and_never_armed) {
    test::Bench bench;
    bench.run(1);
    bench.hello();
    bench.send(Type::Arm, Arm{SESSION, 100}.encode());
    bench.run(1);
    CHECK(bench.infos == 1 && bench.refused(Refusal::Version) && !bench.device.armed());
    bench.run(400);
    CHECK(bench.states > 90);
}

CLAIM(fresh_an_alive_that_is_late_is_told_with_its_age) {
    test::Bench bench;
    bench.ready(test::reference_feel(), 1200);
    bench.run(2000);
    bench.beats = false;
    Arm late = bench.permission(SESSION, 450);
    late.heard_us -= 130000;
    bench.send(Type::Alive, late.encode());
    bench.run(1);
    CHECK(bench.refused(Refusal::Stale) && std::fabs(bench.last(EventKind::Refused)->value - 130.0F) < 0.01F);
    // And one from the future is as old as can be.
    late.heard_us += 260000;
    bench.send(Type::Alive, late.encode());
    bench.run(170);
    CHECK((bench.device.state().flags & flag::ARMED) == 0);
}

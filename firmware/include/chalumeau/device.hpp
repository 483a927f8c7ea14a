// The knob: bytes and sensor readings in, torque and bytes out. One object, no heap, one thread; call `tick` 2,000 times
// a second.
#pragma once

#include "encoder.hpp"
#include "frame.hpp"
#include "health.hpp"
#include "law.hpp"
#include "limits.hpp"
#include "messages.hpp"
#include "midi.hpp"
#include "morph.hpp"
#include "outbox.hpp"
#include "probe.hpp"
#include "session.hpp"
#include "timing.hpp"
#include "watchdog.hpp"

namespace chalumeau {

constexpr std::uint8_t FIRMWARE_MAJOR = 0;
constexpr std::uint8_t FIRMWARE_MINOR = 3;
constexpr std::uint16_t FIRMWARE_PATCH = 0;

constexpr std::uint16_t STATE_HZ_SERIAL = 500;
constexpr std::uint16_t STATE_HZ_MIDI = 100;        // SysEx; the controllers carry the breath
constexpr std::uint32_t CONTROLLER_US = 2000;       // controllers no faster than STATE on serial
constexpr std::uint32_t TICK_LONGEST_US = 1000000;  // a longer pause counts as this: the watchdogs have long fired
constexpr std::uint32_t BUTTON_US = 5000;           // contacts bounce for less (judgement)
constexpr std::uint32_t LIMIT_EVENT_US = 1000000;   // a limit is told once a second at most
constexpr std::uint32_t STALE_EVENT_US = 1000000;   // and a stale ALIVE likewise
constexpr float SLAP_LEAVES_DEG = 1.0F;             // hysteresis of the slap region's edge
/// A knob nobody has measured is not trusted with more, mNm: a finger holds it (judgement).
constexpr std::uint16_t UNCALIBRATED_MNM = 50;

/// What is built in, and what was measured on the knob.
struct Config {
    std::uint64_t serial = 1;  // identity, never 0
    char name[16] = {'C', 'h', 'a', 'l', 'u', 'm', 'e', 'a', 'u', ' ', 'k', 'n', 'o', 'b', 0, 0};
    Binding binding = Binding::Serial;
    std::uint8_t major = PROTOCOL_MAJOR;  // anything else only to test a mismatch
    std::uint16_t capabilities = capability::FLOW | capability::PRESSURE | capability::SLAP | capability::DETENT |
                                 capability::BUTTON | capability::MOTOR;
    std::uint32_t counts_per_turn = 3600;
    std::uint32_t wraps_at = 0;      // raw reading wraps here; 0: a 32-bit counter
    float knob_damping_nms = 5e-4F;  // N m s/rad, the knob's own; within 2e-4..2e-3 for knobs
    std::uint16_t ceiling_mnm = 450;
    std::uint16_t rating_mnm = 200;  // may be held for ever (judgement: not measured on a motor)
    float push_limit = 0.2F;         // N m/rad (judgement: less than a relaxed grip's stiffness)
    float probe_mnm = PROBE_MNM;     // torque of the sign probe; 0: none, only for a bench without a motor
    std::uint16_t epoch = 0;         // where the count of disarmings begins; draw it at random at each start
    bool calibrated = true;          // false: damping, signs and torque per count are guesses, and the ceiling is low
};

/// Of one tick.
struct Reading {
    std::int32_t counts = 0;
    float velocity_rpm = 0.0F;
    bool has_velocity = true;  // false: the counts tell the speed
    bool bus_ok = true;        // the last exchange with the motor board succeeded
    bool supply_ok = true;
    bool button = false;
    bool stop = false;  // the local stop is pressed: FREE, and no arming until it is released
};

class Device {
  public:
    explicit Device(const Config& config)
        : config_(config), encoder_(config.counts_per_turn, config.wraps_at),
          limits_(config.calibrated ? config.ceiling_mnm : least(config.ceiling_mnm, UNCALIBRATED_MNM), config.rating_mnm),
          session_(config.major, config.binding == Binding::Serial ? WATCHDOG_SERIAL_MS : WATCHDOG_MIDI_MS, config.epoch),
          outbox_(config.binding), state_hz_(config.binding == Binding::Serial ? STATE_HZ_SERIAL : STATE_HZ_MIDI) {
        // Sampling alone allows 2 b / T; a period of delay on the bus leaves a third of it (Colgate and Brown 1994,
        // b > K (T/2 + delay)); a quarter is calm under any load (docs/simulator.md).
        allowed_.stiffness = 0.5F * config.knob_damping_nms / LOOP_S;
        allowed_.push = config.push_limit;
        allowed_.ceiling_mnm = limits_.device_mnm();
    }

    /// Bytes from the host, serial binding.
    void receive(const std::uint8_t* bytes, std::size_t length) {
        Frame frame;
        for (std::size_t i = 0; i < length; ++i) {
            if (serial_.push(bytes[i], frame)) {
                take(frame);
            }
        }
    }

    /// Bytes from the host, MIDI binding.
    void receive_midi(const std::uint8_t* bytes, std::size_t length) {
        Frame frame;
        for (std::size_t i = 0; i < length; ++i) {
            if (midi_.push(bytes[i], frame)) {
                take(frame);
            }
        }
    }

    /// Bytes for the host, of the binding configured. Returns how many.
    std::size_t transmit(std::uint8_t* out, std::size_t room) { return outbox_.take(out, room); }

    /// One turn of the haptic loop. Returns the torque to command, mNm.
    float tick(std::uint32_t t_us, const Reading& reading) {
        const float dt_s = advance(t_us);
        sense(reading, dt_s);
        watch();
        stop(reading.stop);
        if (session_.tick(dt_s)) {
            released(fault_);
        }
        torque_ = command(dt_s);
        limits_.heat(torque_, dt_s);
        feel_slap();
        feel_button(reading.button);
        report();
        return torque_;
    }

    bool armed() const { return session_.phase() == Phase::Armed; }
    Cause fault() const { return session_.standing.any() ? session_.standing.first() : fault_; }
    const FrameCounts& counts() const {
        return config_.binding == Binding::Serial ? serial_.reader.counts : midi_.reader.counts;
    }
    std::uint32_t dropped() const { return outbox_.dropped(); }
    /// What the torque of the last tick must not exceed, in counts of the board too.
    float ceiling_mnm() const {
        const float most = limits_.ceiling_mnm();
        // Counts too must stay below what the probe may use.
        return session_.phase() == Phase::Probing ? least(probe_.most_mnm(), most) : most;
    }
    const Feel& feel() const { return feel_; }
    std::uint16_t epoch() const { return session_.epoch(); }
    std::uint16_t overruns() const { return pace_.overruns(); }
    std::uint16_t bus_errors() const { return bus_.errors(); }
    std::uint16_t glitches() const { return encoder_.glitches(); }
    float angle_deg() const { return encoder_.degrees(); }
    float velocity() const { return encoder_.velocity(); }
    const FeelLimits& allowed() const { return allowed_; }

    Info info() const {
        Info info;
        info.major = config_.major;
        info.capabilities = static_cast<std::uint16_t>(
            config_.calibrated ? config_.capabilities | capability::CALIBRATED
                               : config_.capabilities & ~static_cast<unsigned>(capability::CALIBRATED));
        info.firmware_major = FIRMWARE_MAJOR;
        info.firmware_minor = FIRMWARE_MINOR;
        info.firmware_patch = FIRMWARE_PATCH;
        std::memcpy(info.name, config_.name, sizeof info.name);
        info.serial = config_.serial;
        info.counts_per_turn = config_.counts_per_turn;
        info.loop_hz = LOOP_HZ;
        info.watchdog_ms =
            static_cast<std::uint16_t>(config_.binding == Binding::Serial ? WATCHDOG_SERIAL_MS : WATCHDOG_MIDI_MS);
        info.fade_ms = static_cast<std::uint16_t>(FADE_MS);
        info.ceiling_mnm = static_cast<std::uint16_t>(limits_.device_mnm());
        info.session = session_.id();
        info.stiffness_limit = thousandths(allowed_.stiffness);
        info.push_limit = thousandths(allowed_.push);
        info.overruns = pace_.overruns();
        info.bus_errors = bus_.errors();
        info.counted = true;
        return info;
    }

    State state() const {
        State state;
        state.t_us = t_us_;
        state.angle = encoder_.hundredths();
        state.velocity = saturated(encoder_.told() * (10.0F / RAD_PER_S_PER_RPM));
        state.torque = saturated(torque_);
        const auto when = [](bool on, std::uint16_t bit) { return on ? static_cast<unsigned>(bit) : 0U; };
        state.flags = static_cast<std::uint16_t>(
            when(armed(), flag::ARMED) | when(limits_.limited() && session_.gain() > 0.0F, flag::LIMITED) |
            when(session_.standing.any(), flag::FAULT) | when(in_slap_, flag::SLAP) | when(button_, flag::BUTTON) |
            when(session_.phase() == Phase::Fading, flag::FADING) | when(morph_.active(), flag::MORPHING) |
            when(limits_.hot(), flag::THERMAL) | when(session_.phase() == Phase::Probing, flag::PROBING));
        state.feel_id = feel_.feel_id;
        state.slaps = slaps_;
        state.events = events_;
        state.fault = static_cast<std::uint8_t>(fault());
        state.epoch = session_.epoch();
        state.stamped = true;
        return state;
    }

  private:
    // ---- time and sensors

    float advance(std::uint32_t t_us) {
        std::uint32_t passed = begun_ ? t_us - t_us_ : 500;
        if (passed == 0) {
            passed = 500;  // a clock that stands still must not stop the watchdogs
        }
        passed = passed > TICK_LONGEST_US ? TICK_LONGEST_US : passed;
        begun_ = true;
        t_us_ = t_us;
        clock_us_ += passed;
        passed_us_ = passed;
        pace_.tick(passed);
        return static_cast<float>(passed) * 1e-6F;
    }

    void sense(const Reading& reading, float dt_s) {
        const bool finite = !reading.has_velocity || is_finite(reading.velocity_rpm);
        bus_.exchange(reading.bus_ok);
        Look look = Look::Taken;
        if (reading.bus_ok && finite) {
            look = encoder_.read(reading.counts, reading.has_velocity, reading.velocity_rpm, dt_s);
        } else {
            encoder_.miss(dt_s);
        }
        stand(Cause::I2c, bus_.ill(), static_cast<float>(bus_.in_row()));
        stand(Cause::BrownOut, !reading.supply_ok, 0.0F);
        not_finite_ = not_finite_ || (reading.bus_ok && !finite);
        stand(Cause::NotFinite, not_finite_, 0.0F);
        // Spinning a disarmed knob is nobody's fault; it only keeps ARM away.
        const bool held = session_.phase() != Phase::Disarmed;
        stand(Cause::OverSpeed, encoder_.speed() > OVER_SPEED && held, encoder_.speed());
        stand(Cause::Speed, encoder_.contradicts(), encoder_.told());
        stand(Cause::Angle, look == Look::Jump || encoder_.frozen(), encoder_.degrees());
        stand(Cause::Slow, pace_.slow(), static_cast<float>(passed_us_));
    }

    /// A condition that ends torque begins or ends.
    void stand(Cause cause, bool stands, float value) {
        if (stands && !session_.standing.has(cause)) {
            // The reason of a disarming is the first.
            fault_ = session_.phase() == Phase::Fading ? fault_ : cause;
            send_event(EventKind::Fault, static_cast<std::uint8_t>(cause), value);
            if (session_.fade()) {
                released(cause);
            }
        }
        session_.standing.set(cause, stands);
    }

    /// The local stop is FREE, and keeps ARM away while it is pressed.
    void stop(bool pressed) {
        session_.standing.set(Cause::Stop, pressed);
        if (pressed && session_.phase() != Phase::Disarmed) {
            fault_ = Cause::Stop;
            cut(Cause::Stop);
        }
    }

    void watch() {
        if (session_.silent(clock_us_)) {
            stand(Cause::Watchdog, true, 0.0F);
        }
    }

    // ---- torque

    float command(float dt_s) {
        const bool is_changing = morph_.active();
        const float owed = morph_.tick(dt_s);
        if (session_.phase() == Phase::Disarmed) {
            return 0.0F;
        }
        if (session_.phase() == Phase::Probing) {
            return probe(dt_s);
        }
        const float law = curve_.torque(encoder_.degrees(), encoder_.velocity());
        if (!is_finite(law + owed)) {
            // Nothing to fade from.
            not_finite_ = true;
            stand(Cause::NotFinite, true, 0.0F);
            session_.cut();
            released(Cause::NotFinite);
            return 0.0F;
        }
        const float allowed = limits_.clamp(law, owed, is_changing, dt_s);
        if (limits_.limited() && session_.gain() >= 1.0F && clock_us_ - limit_told_us_ > LIMIT_EVENT_US) {
            limit_told_us_ = clock_us_;
            send_event(EventKind::Limit, 0, law + owed);
        }
        return allowed * session_.gain();
    }

    /// The sign probe's torque of this tick, mNm, until it has found something.
    float probe(float dt_s) {
        switch (probe_.tick(encoder_, dt_s)) {
            case Finding::Probing: return limits_.clamp(probe_.torque_mnm(), 0.0F, false, dt_s);
            case Finding::Right: session_.probed(); break;
            case Finding::Reversed: fail(Cause::Sign); break;
            case Finding::SpeedReversed: fail(Cause::Speed); break;
            case Finding::Unmoved:
                session_.cut();
                limits_.disarm();
                refuse({Refusal::Unmoved, config_.probe_mnm});
                break;
        }
        return 0.0F;
    }

    /// The probe shows that this motor must not be used.
    void fail(Cause cause) {
        fault_ = cause;
        send_event(EventKind::Fault, static_cast<std::uint8_t>(cause), 0.0F);
        cut(cause);
    }

    /// Torque has ended.
    void released(Cause cause) {
        limits_.disarm();
        morph_.clear();
        send_event(EventKind::Disarmed, static_cast<std::uint8_t>(cause), 0.0F);
    }

    void cut(Cause cause) {
        const bool held = session_.phase() != Phase::Disarmed;
        session_.cut();
        if (held) {
            released(cause);
        }
    }

    // ---- what the hand does

    void feel_slap() {
        const float angle = encoder_.degrees();
        const float edge = curve_.slap_edge_deg();
        if (!in_slap_ && angle < edge) {
            in_slap_ = true;
            slap_speed_ = 0.0F;
        }
        if (in_slap_) {
            const float velocity = encoder_.velocity();
            slap_speed_ = most(slap_speed_, velocity < 0.0F ? -velocity : velocity);
            if (angle > edge + SLAP_LEAVES_DEG) {
                in_slap_ = false;
                ++slaps_;
                send_event(EventKind::Slap, 0, slap_speed_);
            }
        }
    }

    void feel_button(bool pressed) {
        if (pressed == button_) {
            button_since_us_ = clock_us_;
        } else if (clock_us_ - button_since_us_ >= BUTTON_US) {
            button_ = pressed;
            send_event(EventKind::Button, 0, pressed ? 1.0F : 0.0F);
            if (config_.binding == Binding::Midi) {
                const std::uint8_t message[] = {0xB0, CC_BUTTON, static_cast<std::uint8_t>(pressed ? 127 : 0)};
                outbox_.put(message, sizeof message);
            }
        }
    }

    // ---- messages

    void take(const Frame& frame) {
        switch (static_cast<Type>(frame.type)) {
            case Type::Hello: return take_hello(frame);
            case Type::Feel: return take_feel(frame);
            case Type::Arm: return take_arm(frame);
            case Type::Alive: return take_alive(frame);
            case Type::Free: return cut(Cause::Free);
            case Type::Zero: return take_zero(frame);
            case Type::Rate: return take_rate(frame);
            case Type::Bye: return take_bye(frame);
            default: return;  // later minor versions
        }
    }

    void take_hello(const Frame& frame) {
        Hello hello;
        if (!hello.decode(frame.payload, frame.length) || hello.ranges().code != Refusal::None) {
            return;
        }
        const Cause ended = session_.hello(hello);
        if (ended != Cause::None) {
            cut(ended);
        }
        if (session_.begins()) {
            adopt(Feel{});  // the last host's feel is not this one's, nor is its rate
            morph_.clear();
            state_hz_ = config_.binding == Binding::Serial ? STATE_HZ_SERIAL : STATE_HZ_MIDI;
        }
        outbox_.send(Type::Info, info().encode());
    }

    void take_feel(const Frame& frame) {
        Feel feel;
        if (!feel.decode(frame.payload, frame.length)) {
            return;
        }
        if (!session_.version_fits()) {
            return refuse({Refusal::Version, static_cast<float>(config_.major)}, feel.feel_id);
        }
        const Verdict verdict = check_feel(feel, allowed_);
        if (verdict.code == Refusal::NotFinite) {
            not_finite_ = true;
        }
        if (verdict.code != Refusal::None) {
            return refuse(verdict, feel.feel_id);
        }
        not_finite_ = false;
        adopt(feel);
    }

    void adopt(const Feel& feel) {
        const float angle = encoder_.degrees();
        const float velocity = encoder_.velocity();
        const float before = limits_.cut(curve_.torque(angle, velocity));
        curve_ = Curve(feel);
        feel_ = feel;
        if (session_.phase() != Phase::Disarmed) {
            morph_.begin(before, limits_.cut(curve_.torque(angle, velocity)), feel.morph_ms);
        }
    }

    void take_arm(const Frame& frame) {
        Arm arm;
        if (!arm.decode(frame.payload, frame.length)) {
            return;
        }
        if (arm.ranges().code != Refusal::None) {
            return refuse(arm.ranges());
        }
        const bool was = session_.phase() != Phase::Disarmed;
        const std::uint32_t age_us = session_.age_us(arm, t_us_);
        switch (const Refusal why = session_.arm(arm, age_us, encoder_.speed(), clock_us_, config_.probe_mnm > 0.0F)) {
            case Refusal::None: break;
            case Refusal::Fault: return refuse({why, static_cast<float>(fault())});
            case Refusal::Moving: return refuse({why, encoder_.speed()});
            case Refusal::Stale: return refuse({why, milliseconds(age_us)});
            default: return refuse({why, static_cast<float>(config_.major)});
        }
        if (was) {
            limits_.allow(arm.ceiling_mnm);
            return;
        }
        fault_ = Cause::None;
        morph_.clear();
        limits_.arm(arm.ceiling_mnm);
        if (session_.phase() == Phase::Probing) {
            probe_.begin(encoder_.counts(), config_.probe_mnm);
        }
    }

    void take_alive(const Frame& frame) {
        Arm alive;
        if (!alive.decode(frame.payload, frame.length) || alive.ranges().code != Refusal::None ||
            !session_.knows(alive.session)) {
            return;  // fifty a second: silence, and with it the watchdog, is the answer
        }
        const std::uint32_t age_us = session_.age_us(alive, t_us_);
        if (age_us > FRESH_US) {
            // Of an armed knob the host should know why it will be let go. An ALIVE that crossed a disarming is usual.
            const bool is_late = alive.stamped && alive.epoch == session_.epoch() && session_.phase() == Phase::Armed;
            if (is_late && clock_us_ - stale_told_us_ > STALE_EVENT_US) {
                stale_told_us_ = clock_us_;
                refuse({Refusal::Stale, milliseconds(age_us)});
            }
            return;
        }
        if (session_.is_overtaken(alive, clock_us_)) {
            return;
        }
        session_.alive(alive, age_us, clock_us_);
        limits_.lower(alive.ceiling_mnm);
    }

    void take_zero(const Frame& frame) {
        Zero zero;
        if (!zero.decode(frame.payload, frame.length)) {
            return;
        }
        if (zero.ranges().code != Refusal::None) {
            return refuse(zero.ranges());
        }
        if (session_.phase() != Phase::Disarmed) {
            return refuse({Refusal::ZeroWhileArmed, static_cast<float>(zero.angle) * 0.01F});
        }
        encoder_.call(zero.angle);
        in_slap_ = false;
    }

    void take_rate(const Frame& frame) {
        Rate rate;
        if (!rate.decode(frame.payload, frame.length)) {
            return;
        }
        if (rate.ranges().code != Refusal::None) {
            return refuse(rate.ranges());
        }
        state_hz_ = rate.hz;
    }

    void take_bye(const Frame& frame) {
        Bye bye;
        if (!bye.decode(frame.payload, frame.length)) {
            return;
        }
        if (!session_.knows(bye.session)) {
            return refuse({Refusal::Session, 0.0F});
        }
        cut(Cause::Bye);
        session_.forget();
    }

    void refuse(Verdict verdict) { refuse(verdict, feel_.feel_id); }

    void refuse(Verdict verdict, std::uint8_t feel_id) {
        send(EventKind::Refused, static_cast<std::uint8_t>(verdict.code), feel_id, verdict.value);
    }

    void send_event(EventKind kind, std::uint8_t code, float value) { send(kind, code, feel_.feel_id, value); }

    void send(EventKind kind, std::uint8_t code, std::uint8_t feel_id, float value) {
        Event event;
        event.kind = static_cast<std::uint8_t>(kind);
        event.counter = ++events_;
        event.code = code;
        event.feel_id = feel_id;
        event.t_us = t_us_;
        event.value = value;
        outbox_.send(Type::Event, event.encode());
    }

    void report() {
        state_due_ += passed_us_ * state_hz_;
        if (state_due_ >= 1000000) {
            state_due_ = state_due_ >= 2000000 ? 0 : state_due_ - 1000000;
            outbox_.send(Type::State, state().encode());
        }
        if (config_.binding == Binding::Midi && clock_us_ - controllers_us_ >= CONTROLLER_US) {
            controllers_us_ = clock_us_;
            send_controllers();
        }
    }

    void send_controllers() {
        const float angle = encoder_.degrees();
        const float breath = 16383.0F * least(1.0F, most(0.0F, angle / curve_.wall_deg()));
        const float steps = least(16383.0F, most(0.0F, 8192.0F + 10.0F * angle + 0.5F));
        send_controller(CC_BREATH, static_cast<std::uint16_t>(breath + 0.5F), breath_sent_);
        send_controller(CC_ANGLE, static_cast<std::uint16_t>(steps), angle_sent_);
    }

    void send_controller(std::uint8_t controller, std::uint16_t value, std::uint16_t& sent) {
        std::uint8_t bytes[6];
        if (value != sent && outbox_.put(bytes, controller_14bit(controller, value, bytes))) {
            sent = value;
        }
    }

    static std::int16_t saturated(float value) {
        const float rounded = value + (value < 0.0F ? -0.5F : 0.5F);
        return static_cast<std::int16_t>(least(32767.0F, most(-32768.0F, rounded)));
    }

    static float milliseconds(std::uint32_t us) { return 1e-3F * static_cast<float>(us); }

    static std::uint16_t thousandths(float value) {
        return static_cast<std::uint16_t>(least(65535.0F, 1000.0F * value + 0.5F));
    }

    Config config_;
    Encoder encoder_;
    Pace pace_;
    BusHealth bus_;
    Probe probe_;
    Limits limits_;
    Session session_;
    Outbox outbox_;
    SerialDecoder serial_;
    MidiDecoder midi_;
    Feel feel_;
    Curve curve_;
    Morph morph_;
    FeelLimits allowed_;
    Cause fault_ = Cause::None;
    float torque_ = 0.0F;
    float slap_speed_ = 0.0F;
    std::uint32_t t_us_ = 0;
    std::uint32_t clock_us_ = 0;  // the sum of what passed: monotone, whatever the clock given does
    std::uint32_t passed_us_ = 500;
    std::uint32_t state_due_ = 0;
    std::uint32_t controllers_us_ = 0;
    std::uint32_t limit_told_us_ = 0;
    std::uint32_t stale_told_us_ = 0;
    std::uint32_t button_since_us_ = 0;
    std::uint16_t state_hz_;
    std::uint16_t breath_sent_ = 0xFFFF;
    std::uint16_t angle_sent_ = 0xFFFF;
    std::uint8_t slaps_ = 0;
    std::uint8_t events_ = 0;
    bool not_finite_ = false;  // until a FEEL is accepted: one refused for another reason proves nothing
    bool begun_ = false;
    bool in_slap_ = false;
    bool button_ = false;
};

}  // namespace chalumeau

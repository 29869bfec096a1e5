// pneuforce on CAN for a robot's program: its frames, what a force loop may believe of them and when, and who
// inflates. Header only, C++17, no I/O and no clock: time is an argument. The guide is docs/robot.md.

#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

namespace pneuforce {

constexpr std::uint32_t NODE_ID = 5, FORCE = 0x180 + NODE_ID, COMMAND = 0x200 + NODE_ID, STATE = 0x280 + NODE_ID,
                        STATUS = 0x380 + NODE_ID, ANSWER = 0x480 + NODE_ID;
enum Mode : std::uint8_t { VENT = 0, HOLD = 1, CLEAR_FAULTS = 2, ZERO_PRESSURE = 3 };
enum Result : std::uint8_t { ACCEPTED = 0, RENEWED = 4 };
// Of the condensed status in a Force frame.
constexpr std::uint8_t FORCE_LIMIT = 1 << 4, SIMULATED = 1 << 6, FORCE_VALID = 1 << 7;

struct Frame {
    std::uint32_t id = 0;
    std::size_t length = 0;
    std::array<std::uint8_t, 8> data{};
};

// A value is never to be had without the word whether it may be used.
struct Reading {
    double value = std::numeric_limits<double>::quiet_NaN();
    bool valid = false;
};

struct Force {
    Reading force_n, pressure_kpa, uncertainty_n;
    std::uint8_t condensed_status, counter;
};

struct State {
    Reading setpoint_kpa, initial_pressure_kpa, radius_mm, peak_force_n;
};

struct Status {
    std::uint32_t bits;
    std::uint8_t state, refusal, contact_counter, sample_counter;
};

struct Answer {
    std::uint8_t sequence, result;
    Reading setpoint_kpa;
};

inline std::uint16_t u16(const Frame &frame, std::size_t at)
{
    return static_cast<std::uint16_t>(frame.data[at] | frame.data[at + 1] << 8);
}

inline Reading of_i16(const Frame &frame, std::size_t at)
{
    auto code = static_cast<std::int16_t>(u16(frame, at));
    return code == 0x7FFF ? Reading{} : Reading{code / 1000.0, true};
}

inline Reading of_u16(const Frame &frame, std::size_t at)
{
    auto code = u16(frame, at);
    return code == 0xFFFF ? Reading{} : Reading{code / 1000.0, true};
}

inline bool is(const Frame &frame, std::uint32_t id, std::size_t length)
{
    return frame.id == id && frame.length == length;
}

inline std::optional<Force> decode_force(const Frame &frame)
{
    if (!is(frame, FORCE, 8))
        return {};
    Force force{of_i16(frame, 0), of_i16(frame, 2), of_u16(frame, 4), frame.data[6], frame.data[7]};
    force.force_n.valid = force.force_n.valid && (force.condensed_status & FORCE_VALID);
    return force;
}

inline std::optional<State> decode_state(const Frame &frame)
{
    if (!is(frame, STATE, 8))
        return {};
    return State{of_i16(frame, 0), of_i16(frame, 2), of_u16(frame, 4), of_i16(frame, 6)};
}

inline std::optional<Status> decode_status(const Frame &frame)
{
    if (!is(frame, STATUS, 8))
        return {};
    auto bits = u16(frame, 0) | static_cast<std::uint32_t>(u16(frame, 2)) << 16;
    return Status{bits, frame.data[4], frame.data[5], frame.data[6], frame.data[7]};
}

inline std::optional<Answer> decode_answer(const Frame &frame)
{
    if (!is(frame, ANSWER, 4))
        return {};
    return Answer{frame.data[0], frame.data[1], of_i16(frame, 2)};
}

inline Frame command(Mode mode, double setpoint_kpa, std::uint16_t lease_ms, std::uint8_t sequence)
{
    auto setpoint_pa = static_cast<std::uint16_t>(std::lround(setpoint_kpa * 1000));
    auto low = [](std::uint16_t word) { return static_cast<std::uint8_t>(word & 0xFF); };
    auto high = [](std::uint16_t word) { return static_cast<std::uint8_t>(word >> 8); };
    return {COMMAND, 8, {low(setpoint_pa), high(setpoint_pa), mode, sequence, low(lease_ms), high(lease_ms)}};
}

// ---- what a force loop may believe, and when

constexpr double FRESH_S = 0.1; // ten periods at 100 Hz: a frame may be lost, an old force not be used

class ForceInput {
  public:
    // A counter that stands still is an old frame, from a gateway or a driver that repeats its last one.
    void take(const Force &force, double now_s)
    {
        if (seen_ && force.counter == last_.counter)
            return;
        lost_ += seen_ ? static_cast<std::uint8_t>(force.counter - last_.counter - 1) : 0;
        seen_ = true;
        last_ = force;
        seen_s_ = now_s;
    }

    // Silence is judged by the receiver's own clock: a sender that is gone sets no bit.
    Reading force_n(double now_s) const
    {
        return seen_ && now_s - seen_s_ <= FRESH_S ? last_.force_n : Reading{};
    }

    bool above_limit() const { return seen_ && (last_.condensed_status & FORCE_LIMIT); }
    bool simulated() const { return seen_ && (last_.condensed_status & SIMULATED); }
    unsigned lost() const { return lost_; }

  private:
    Force last_{};
    bool seen_ = false;
    double seen_s_ = 0;
    unsigned lost_ = 0;
};

// ---- who inflates: vent, then hold, each until it is answered; then the same Command again renews the lease

constexpr std::uint16_t LEASE_MS = 1000;
constexpr double RETRY_S = 0.1, RENEW_S = LEASE_MS / 3000.0;

class Inflation {
  public:
    explicit Inflation(double setpoint_kpa) : setpoint_kpa_(setpoint_kpa) {}

    std::optional<Frame> due(double now_s)
    {
        if (step_ == Step::ended || now_s < next_s_)
            return {};
        next_s_ = now_s + (step_ == Step::held ? RENEW_S : RETRY_S);
        return command(step_ == Step::venting ? VENT : HOLD, setpoint_kpa_, LEASE_MS, sequence_);
    }

    void take(const Answer &answer)
    {
        if (answer.sequence != sequence_)
            return;
        result_ = answer.result;
        if (result_ != ACCEPTED && result_ != RENEWED)
            step_ = Step::ended; // never ask again blindly: somebody has to look
        else if (step_ == Step::venting)
            step_ = Step::asking, sequence_++, next_s_ = 0;
        else if (step_ == Step::asking)
            step_ = Step::held;
    }

    bool ended() const { return step_ == Step::ended; }
    int result() const { return result_; }
    // The lease goes too: one that is left to run out trips the rig.
    Frame leave() const { return command(VENT, 0, 0, static_cast<std::uint8_t>(sequence_ + 1)); }

  private:
    enum class Step { venting, asking, held, ended };
    double setpoint_kpa_, next_s_ = 0;
    std::uint8_t sequence_ = 1, result_ = ACCEPTED;
    Step step_ = Step::venting;
};

} // namespace pneuforce

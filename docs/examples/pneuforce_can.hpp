// CAN frames of pneuforce for the program of a robot: decoding, check of the validity of the force, and the
// Commands that inflate the balloon. Header only, C++17, without I/O and without a clock: the time is an argument.
// docs/robot.md describes the use of this header.

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

namespace pneuforce {

// Node id of the instrument by default. For another instrument, give its node id as the last argument.
constexpr std::uint32_t NODE_ID = 5;
// Identifiers of the frames, to which the node id is added.
constexpr std::uint32_t FORCE = 0x180, COMMAND = 0x200, STATE = 0x280, STATUS = 0x380, ANSWER = 0x480;
enum Mode : std::uint8_t { VENT = 0, HOLD = 1, CLEAR_FAULTS = 2, ZERO_PRESSURE = 3, LEASE = 4 };
enum ProofTests : std::uint8_t { ALLOWED = 0, FORBIDDEN = 1 };
enum Result : std::uint8_t { ACCEPTED = 0, RENEWED = 4, REJECTED_LEASE = 19 };
enum RigState : std::uint8_t { INFLATING = 2, SETTLING = 3, HOLDING = 4, VENTING = 5, TRIPPED = 6 };
constexpr std::array<const char *, 7> STATE_NAMES = {"boot",    "vented",  "inflating", "settling",
                                                     "holding", "venting", "tripped"};
// Return the name of a state of the rig.
inline const char *state_name(int state)
{
    auto index = static_cast<std::size_t>(state);
    return index < STATE_NAMES.size() ? STATE_NAMES[index] : "unknown";
}
// Bits of the condensed status in a Force frame. An interpolated force is valid, but approximate.
constexpr std::uint8_t INTERPOLATED = 1 << 2, FORCE_HIGH_ALARM = 1 << 4, SIMULATED = 1 << 6, FORCE_VALID = 1 << 7;

struct Frame {
    std::uint32_t id = 0;
    std::size_t length = 0;
    std::array<std::uint8_t, 8> data{};
};

// Value with its validity. `valid` is true if the value may be used.
struct Reading {
    double value = std::numeric_limits<double>::quiet_NaN();
    bool valid = false;
};

struct Force {
    Reading force_n, pressure_kpa, uncertainty_n;
    std::uint8_t condensed_status, counter;
};

struct State {
    Reading setpoint_kpa, baseline_pressure_kpa, radius_mm, peak_force_n;
};

struct Status {
    std::uint32_t bits;
    std::uint8_t state, reject_reason, contact_counter, sample_counter;
};

struct Answer {
    std::uint8_t sequence, result;
    Reading setpoint_kpa;
};

inline std::uint16_t read_code(const Frame &frame, std::size_t offset)
{
    return static_cast<std::uint16_t>(frame.data[offset] | frame.data[offset + 1] << 8);
}

inline Reading read_i16(const Frame &frame, std::size_t offset)
{
    auto code = static_cast<std::int16_t>(read_code(frame, offset));
    return code == 0x7FFF ? Reading{} : Reading{code / 1000.0, true};
}

inline Reading read_u16(const Frame &frame, std::size_t offset)
{
    auto code = read_code(frame, offset);
    return code == 0xFFFF ? Reading{} : Reading{code / 1000.0, true};
}

inline bool has_layout(const Frame &frame, std::uint32_t id, std::size_t length)
{
    return frame.id == id && frame.length == length;
}

inline std::optional<Force> decode_force(const Frame &frame, std::uint32_t node_id = NODE_ID)
{
    if (!has_layout(frame, FORCE + node_id, 8))
        return {};
    auto status = frame.data[6];
    return Force{status & FORCE_VALID ? read_i16(frame, 0) : Reading{}, read_i16(frame, 2), read_u16(frame, 4), status,
                 frame.data[7]};
}

inline std::optional<State> decode_state(const Frame &frame, std::uint32_t node_id = NODE_ID)
{
    if (!has_layout(frame, STATE + node_id, 8))
        return {};
    return State{read_i16(frame, 0), read_i16(frame, 2), read_u16(frame, 4), read_i16(frame, 6)};
}

inline std::optional<Status> decode_status(const Frame &frame, std::uint32_t node_id = NODE_ID)
{
    if (!has_layout(frame, STATUS + node_id, 8))
        return {};
    auto bits = read_code(frame, 0) | static_cast<std::uint32_t>(read_code(frame, 2)) << 16;
    return Status{bits, frame.data[4], frame.data[5], frame.data[6], frame.data[7]};
}

inline std::optional<Answer> decode_answer(const Frame &frame, std::uint32_t node_id = NODE_ID)
{
    if (!has_layout(frame, ANSWER + node_id, 4))
        return {};
    return Answer{frame.data[0], frame.data[1], read_i16(frame, 2)};
}

constexpr double MIN_SETPOINT_KPA = 2.0, MAX_SETPOINT_KPA = 12.0;
constexpr std::uint16_t INVALID_SETPOINT = 0xFFFF; // the instrument answers with the result 2, out_of_range

// Return the setpoint [Pa] of a Command hold. A setpoint out of range must not wrap to another valid setpoint.
inline std::uint16_t setpoint_code(double setpoint_kpa)
{
    bool in_range = setpoint_kpa >= MIN_SETPOINT_KPA && setpoint_kpa <= MAX_SETPOINT_KPA; // false for NaN
    return in_range ? static_cast<std::uint16_t>(std::lround(setpoint_kpa * 1000)) : INVALID_SETPOINT;
}

// Return a Command. The setpoint is used only by the mode hold. `proof_tests` is stored by the modes hold and vent.
inline Frame command(Mode mode, double setpoint_kpa, std::uint16_t lease_ms, std::uint8_t sequence,
                     ProofTests proof_tests = ALLOWED, std::uint32_t node_id = NODE_ID)
{
    std::uint16_t setpoint_pa = mode == HOLD ? setpoint_code(setpoint_kpa) : 0;
    auto low = [](std::uint16_t code) { return static_cast<std::uint8_t>(code & 0xFF); };
    auto high = [](std::uint16_t code) { return static_cast<std::uint8_t>(code >> 8); };
    return {COMMAND + node_id, 8,
            {low(setpoint_pa), high(setpoint_pa), mode, sequence, low(lease_ms), high(lease_ms), proof_tests}};
}

// ---- latest force for a control loop, and the checks of its validity

// Ten periods at 100 Hz: one frame may be lost, but an old force must not be used.
constexpr double MAX_AGE_S = 0.1;
// After a faster and larger fall of the force, do not move forward: the balloon may have burst.
constexpr double MAX_FALL_N_PER_S = 1.0, FALL_N = 0.1;

class ForceInput {
  public:
    // Store a Force frame. A frame with an unchanged counter is ignored: a gateway or a driver has repeated it.
    void take(const Force &force, double now_s)
    {
        if (received_ && force.counter == last_.counter)
            return;
        lost_ += received_ ? static_cast<std::uint8_t>(force.counter - last_.counter - 1) : 0;
        reference_n_ -= MAX_FALL_N_PER_S * std::max(0.0, now_s - received_s_);
        received_ = true;
        last_ = force;
        received_s_ = now_s;
        Reading now_n = force_n(now_s);
        if (now_n.valid)
            reference_n_ = std::max(now_n.value, reference_n_);
        falls_ = now_n.valid && now_n.value < reference_n_ - FALL_N;
    }

    // Return the force. This function checks the age of the force, because a stopped sender cannot report an error.
    Reading force_n(double now_s) const
    {
        double age_s = now_s - received_s_; // negative after a step of the clock: the age is then unknown
        return received_ && age_s >= 0 && age_s <= MAX_AGE_S ? last_.force_n : Reading{};
    }

    // Return true if the force falls as after a burst of the balloon, when it is valid at first: do not move forward.
    bool falls() const { return falls_; }

    bool above_limit() const { return received_ && (last_.condensed_status & FORCE_HIGH_ALARM); }
    bool interpolated() const { return received_ && (last_.condensed_status & INTERPOLATED); }
    bool simulated() const { return received_ && (last_.condensed_status & SIMULATED); }
    unsigned lost() const { return lost_; }

  private:
    Force last_{};
    bool received_ = false, falls_ = false;
    double received_s_ = 0;
    double reference_n_ = 0; // never below the force, and falls by at most MAX_FALL_N_PER_S
    unsigned lost_ = 0;
};

// ---- Commands that inflate the balloon and renew the lease. The Commands lease, vent and hold are sent in this order.
// Each is repeated until its Answer arrives, and the vent until the frame Status shows it: the first Status after the
// Answer may still show the balloon that was held before. The lease is the first, so that a rejected lease changes
// nothing: a vent would also vent the balloon of a client on another bus. After the hold, the Command lease renews the
// lease, until the balloon is vented: the lease of a vented balloon prevents that another client clears the faults.

constexpr std::uint16_t LEASE_MS = 1000;
constexpr double RETRY_S = 0.1, RENEW_S = LEASE_MS / 3000.0;

class Inflation {
  public:
    // Begin with another sequence number at each start of your program: the instrument rejects a hold that it already
    // had before the last vent.
    Inflation(double setpoint_kpa, std::uint8_t first_sequence, ProofTests proof_tests = ALLOWED,
              std::uint32_t node_id = NODE_ID)
        : setpoint_kpa_(setpoint_kpa), node_id_(node_id), sequence_(first_sequence), proof_tests_(proof_tests)
    {
    }

    // Return the Command to send now, or nothing.
    std::optional<Frame> due(double now_s)
    {
        if (step_ == Step::rejected || step_ == Step::ended || now_s < next_s_)
            return {};
        next_s_ = now_s + (step_ == Step::held ? RENEW_S : RETRY_S);
        Mode mode = step_ == Step::venting ? VENT : step_ == Step::inflating ? HOLD : LEASE;
        return command(mode, setpoint_kpa_, LEASE_MS, sequence_, proof_tests_, node_id_);
    }

    // Handle an Answer frame.
    void take(const Answer &answer)
    {
        if (answer.sequence != sequence_ || step_ == Step::rejected || step_ == Step::ended)
            return;
        result_ = answer.result;
        if (result_ != ACCEPTED && result_ != RENEWED)
            step_ = Step::rejected; // do not retry: a person must first remove the cause
        else if (step_ == Step::leasing)
            leased_ = true, begin(Step::venting);
        else if (step_ == Step::venting)
            vent_answered_ = true;
        else if (step_ == Step::inflating)
            begin(Step::held);
    }

    // Handle a Status frame.
    void take(const Status &status)
    {
        bool inflated = status.state == INFLATING || status.state == SETTLING || status.state == HOLDING;
        if (step_ == Step::venting && vent_answered_ && !inflated)
            begin(Step::inflating);
        if (step_ == Step::held && (status.state == TRIPPED || (inflated_ && !inflated)))
            step_ = Step::ended, end_state_ = status.state;
        inflated_ = step_ == Step::held && (inflated_ || inflated);
    }

    bool rejected() const { return step_ == Step::rejected; }
    int result() const { return result_; }
    // Return true if the balloon was vented after the Command hold was accepted. end_state() is the state in Status.
    bool ended() const { return step_ == Step::ended; }
    int end_state() const { return end_state_; }
    // Return the last Command, which vents and ends the lease, or nothing if another bus has the lease: a vent would
    // vent the balloon of the client there. Before the Answer to the Command lease, only the lease is ended. A lease
    // that expires trips the rig.
    std::optional<Frame> vent_and_release() const
    {
        if (step_ == Step::rejected && (!leased_ || result_ == REJECTED_LEASE))
            return {};
        return command(leased_ ? VENT : LEASE, 0, 0, static_cast<std::uint8_t>(sequence_ + 1), ALLOWED, node_id_);
    }

  private:
    enum class Step { leasing, venting, inflating, held, rejected, ended };

    void begin(Step step)
    {
        step_ = step;
        sequence_++;
        next_s_ = 0;
    }

    double setpoint_kpa_, next_s_ = 0;
    std::uint32_t node_id_;
    std::uint8_t sequence_, result_ = ACCEPTED, end_state_ = 0;
    ProofTests proof_tests_;
    bool leased_ = false, vent_answered_ = false, inflated_ = false;
    Step step_ = Step::leasing;
};

} // namespace pneuforce

// Force control loop of a robot on the CAN frames of pneuforce. Linux, C++17, no library.
// Needs pneuforce_can.hpp in the same folder.
//
//   g++ -std=c++17 -O2 -o robot_listener robot_listener.cpp
//   ./robot_listener can0          listens
//   ./robot_listener can0 8.0      takes the lease, vents, inflates to 8 kPa, and renews the lease; Ctrl-C vents
//   ./robot_listener can0 8.0 no-proof-tests   the same, and forbids proof tests during the hold
//   ./robot_listener - 8.0         the same without CAN in the kernel: reads frames as candump lines from stdin,
//                                  and writes frames as candump lines to stdout
//   ./robot_listener - < file      evaluates each line of a recorded file at the time in the line

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "pneuforce_can.hpp"

constexpr double TARGET_N = 1.5, GAIN_MM_PER_S_N = 2.0, BACK_OFF_MM_PER_S = -5.0;

// Return the speed of an admittance control: forward (+) if the force is too small, back (-) if the force is
// too large or unknown, and not forward if the force falls as after a burst. An interpolated force (bit 2 of the
// condensed status) is valid, but approximate: choose a TARGET_N above register 28, 1.23 N at 8 kPa.
double speed_mm_per_s(const pneuforce::ForceInput &input, double now_s)
{
    pneuforce::Reading force_n = input.force_n(now_s);
    if (!force_n.valid || input.above_limit())
        return BACK_OFF_MM_PER_S;
    double speed = GAIN_MM_PER_S_N * (TARGET_N - force_n.value);
    return input.falls() ? std::min(speed, 0.0) : speed;
}

// ---- access to the bus: SocketCAN, or candump lines

using pneuforce::Frame;
constexpr int WAIT_MS = 20;
constexpr double START_S = 2; // wait for the first frame without a report

double steady_s()
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Link {
    virtual ~Link() = default;
    virtual std::optional<Frame> receive(int wait_ms) = 0; // returns nothing if no frame arrives in this time
    virtual void send(const Frame &frame) = 0;             // returns no error: after an error, the Answer is missing
    virtual double now_s() const { return steady_s(); }
    bool open = true;
    bool recorded = false; // the frames come from a file, and each frame has its own time
};

class SocketCan : public Link {
  public:
    explicit SocketCan(const char *name) : socket_(::socket(PF_CAN, SOCK_RAW, CAN_RAW))
    {
        sockaddr_can address{};
        address.can_family = AF_CAN;
        address.can_ifindex = static_cast<int>(if_nametoindex(name));
        using namespace pneuforce;
        can_filter filters[] = {{FORCE + NODE_ID, EXACT}, {STATE + NODE_ID, EXACT},
                                {STATUS + NODE_ID, EXACT}, {ANSWER + NODE_ID, EXACT}};
        open = socket_ >= 0 && address.can_ifindex > 0 &&
               setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FILTER, filters, sizeof filters) == 0 &&
               bind(socket_, reinterpret_cast<sockaddr *>(&address), sizeof address) == 0;
        if (!open)
            std::perror(name);
    }
    ~SocketCan() override { close(socket_); }

    std::optional<Frame> receive(int wait_ms) override
    {
        pollfd events{socket_, POLLIN, 0};
        can_frame raw{};
        if (poll(&events, 1, wait_ms) < 1 || read(socket_, &raw, sizeof raw) != sizeof raw)
            return {};
        Frame frame{raw.can_id & CAN_SFF_MASK, raw.can_dlc, {}};
        std::memcpy(frame.data.data(), raw.data, sizeof raw.data);
        return frame;
    }

    void send(const Frame &frame) override
    {
        can_frame raw{};
        raw.can_id = frame.id;
        raw.can_dlc = static_cast<std::uint8_t>(frame.length);
        std::memcpy(raw.data, frame.data.data(), sizeof raw.data);
        if (write(socket_, &raw, sizeof raw) != sizeof raw)
            std::perror("frame not sent");
    }

  private:
    static constexpr canid_t EXACT = CAN_SFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG;
    int socket_;
};

class CandumpLines : public Link {
  public:
    CandumpLines()
    {
        struct stat input {};
        recorded = fstat(STDIN_FILENO, &input) == 0 && S_ISREG(input.st_mode);
    }

    std::optional<Frame> receive(int wait_ms) override
    {
        for (;;) {
            auto end = buffer_.find('\n');
            if (end == std::string::npos) {
                if (!read_more(wait_ms))
                    return {};
                continue;
            }
            std::string line = buffer_.substr(0, end);
            buffer_.erase(0, end + 1);
            if (auto frame = parse(line))
                return frame;
        }
    }

    void send(const Frame &frame) override
    {
        std::printf("(%.6f) can0 %03X#", now_s(), frame.id);
        for (std::size_t i = 0; i < frame.length; i++)
            std::printf("%02X", frame.data[i]);
        std::puts("");
    }

    double now_s() const override { return recorded ? stamp_s_ : steady_s(); }

  private:
    // Read more bytes. Return false if no byte arrives in this time.
    bool read_more(int wait_ms)
    {
        pollfd stdin_{STDIN_FILENO, POLLIN, 0};
        char bytes[4096];
        if (poll(&stdin_, 1, wait_ms) < 1)
            return false;
        auto length = read(STDIN_FILENO, bytes, sizeof bytes);
        open = length > 0;
        buffer_.append(bytes, open ? static_cast<std::size_t>(length) : 0);
        return open;
    }

    // Parse a line like "(1700000000.000000) can0 185#E803401F64008107". 29-bit and remote frames and more than 8 bytes
    // are ignored.
    std::optional<Frame> parse(const std::string &line)
    {
        double stamp_s = 0;
        char id[9] = "", text[18] = ""; // one character more than a frame can have
        if (std::sscanf(line.c_str(), "(%lf) %*s %8[0-9A-Fa-f]#%17[0-9A-Fa-f]", &stamp_s, id, text) < 2)
            return {};
        stamp_s_ = stamp_s;
        if (std::strlen(id) != 3 || std::strlen(text) > 16)
            return {};
        Frame frame{static_cast<std::uint32_t>(std::strtoul(id, nullptr, 16)), std::strlen(text) / 2, {}};
        for (std::size_t i = 0; i < frame.length; i++) {
            char byte[3] = {text[2 * i], text[2 * i + 1], 0};
            frame.data[i] = static_cast<std::uint8_t>(std::strtoul(byte, nullptr, 16));
        }
        return frame;
    }

    std::string buffer_;
    double stamp_s_ = 0;
};

// ---- the program

volatile std::sig_atomic_t stopped = 0;

void print(const Frame &frame)
{
    if (auto force = pneuforce::decode_force(frame))
        std::printf("Force force=%.3f pressure=%.3f force_uncertainty=%.3f condensed_status=%u counter=%u "
                    "valid=%d\n",
                    force->force_n.value, force->pressure_kpa.value, force->uncertainty_n.value,
                    force->condensed_status, force->counter, force->force_n.valid);
    else if (auto state = pneuforce::decode_state(frame))
        std::printf("State setpoint=%.3f baseline_pressure=%.3f radius=%.3f peak_force=%.3f\n",
                    state->setpoint_kpa.value, state->baseline_pressure_kpa.value, state->radius_mm.value,
                    state->peak_force_n.value);
    else if (auto status = pneuforce::decode_status(frame))
        std::printf("Status status=%u state=%u reject_reason=%u contact_counter=%u sample_counter=%u\n", status->bits,
                    status->state, status->reject_reason, status->contact_counter, status->sample_counter);
    else if (auto answer = pneuforce::decode_answer(frame))
        std::printf("Answer sequence=%u result=%u setpoint=%.3f\n", answer->sequence, answer->result,
                    answer->setpoint_kpa.value);
}

struct Loop {
    pneuforce::ForceInput input;
    std::optional<pneuforce::Inflation> inflation;

    void take(const Frame &frame, double now_s)
    {
        print(frame);
        if (auto force = pneuforce::decode_force(frame))
            input.take(*force, now_s);
        if (auto answer = pneuforce::decode_answer(frame); answer && inflation)
            inflation->take(*answer);
        if (auto status = pneuforce::decode_status(frame); status && inflation)
            inflation->take(*status);
    }

    bool failed() const { return inflation && (inflation->rejected() || inflation->ended()); }
};

// Reports each pause of the frames. A robot whose bus is silent must not look like a robot that only waits.
class SilenceReport {
  public:
    explicit SilenceReport(double now_s) : last_frame_s_(now_s) {}

    void frame(double now_s)
    {
        if (reported_)
            std::fprintf(stderr, "Frames arrive again after %.0f ms\n", (now_s - last_frame_s_) * 1000);
        last_frame_s_ = now_s;
        reported_ = false;
        limit_s_ = pneuforce::MAX_AGE_S;
    }

    void check(double now_s)
    {
        if (reported_ || now_s - last_frame_s_ <= limit_s_)
            return;
        std::fprintf(stderr, "No frames since %.0f ms: the force is not valid\n", (now_s - last_frame_s_) * 1000);
        reported_ = true;
    }

  private:
    double last_frame_s_;
    double limit_s_ = START_S; // until the first frame: the program that sends the frames may start slowly
    bool reported_ = false;
};

void run(Link &link, Loop &loop)
{
    SilenceReport silence(link.now_s());
    std::optional<double> first_frame_s;
    double printed_mm_per_s = std::numeric_limits<double>::quiet_NaN();
    auto set_speed = [&](double now_s, double speed) { // in your program: the speed of the drive
        if (speed != printed_mm_per_s)
            std::printf("Loop t=%.3f speed=%.3f lost=%u simulated=%d\n", now_s - first_frame_s.value_or(now_s),
                        speed, loop.input.lost(), loop.input.simulated());
        printed_mm_per_s = speed;
    };
    while (link.open && !stopped && !loop.failed()) {
        auto frame = link.receive(WAIT_MS);
        while (frame) { // after a pause, many frames wait: only the last force is new
            loop.take(*frame, link.now_s());
            silence.frame(link.now_s());
            first_frame_s = first_frame_s.value_or(link.now_s());
            frame = link.recorded ? std::nullopt : link.receive(0);
        }
        double now_s = link.now_s();
        if (!link.recorded)
            silence.check(now_s);
        set_speed(now_s, speed_mm_per_s(loop.input, now_s));
        if (loop.inflation)
            if (auto command = loop.inflation->due(now_s))
                link.send(*command);
        std::fflush(stdout);
    }
    set_speed(link.now_s(), BACK_OFF_MM_PER_S); // the robot must not keep its last speed
    if (loop.inflation)
        if (auto command = loop.inflation->vent_and_release())
            link.send(*command);
}

// Print why the hold has ended. Return the exit code of the program.
int report(const std::optional<pneuforce::Inflation> &inflation)
{
    if (inflation && inflation->rejected())
        std::fprintf(stderr, "The Command was rejected with result %d. See the results in docs/robot.md\n",
                     inflation->result());
    else if (inflation && inflation->ended())
        std::fprintf(stderr, "The hold has ended: the state is %s: %s\n",
                     pneuforce::state_name(inflation->end_state()),
                     inflation->end_state() == pneuforce::TRIPPED
                         ? "pneuforce status names the fault"
                         : "another client has vented, or the instrument has ended");
    else
        return 0;
    return 1;
}

// Return a number that differs at each start. For a recorded file it is always 1, so that a run can be repeated.
std::uint8_t first_sequence(const Link &link)
{
    using namespace std::chrono;
    auto now = duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
    return link.recorded ? 1 : static_cast<std::uint8_t>(now);
}

// Return the setpoint, or NaN if the text is not completely a number from 2 to 12.
double parse_setpoint_kpa(const char *text)
{
    char *end = nullptr;
    double setpoint_kpa = std::strtod(text, &end);
    bool is_number = end != text && *end == '\0';
    bool in_range = setpoint_kpa >= pneuforce::MIN_SETPOINT_KPA && setpoint_kpa <= pneuforce::MAX_SETPOINT_KPA;
    return is_number && in_range ? setpoint_kpa : std::numeric_limits<double>::quiet_NaN();
}

int main(int argc, char **argv)
{
    bool no_proof_tests = argc == 4 && std::strcmp(argv[3], "no-proof-tests") == 0;
    if (argc < 2 || argc > 4 || (argc == 4 && !no_proof_tests)) {
        std::fprintf(stderr, "usage: %s can0|- [setpoint [no-proof-tests]]\n", argv[0]);
        return 2;
    }
    double setpoint_kpa = argc > 2 ? parse_setpoint_kpa(argv[2]) : pneuforce::MIN_SETPOINT_KPA;
    if (std::isnan(setpoint_kpa)) {
        std::fprintf(stderr, "The setpoint \"%s\" is not a number from 2 to 12 kPa. Write it with a point, like 8.5\n",
                     argv[2]);
        return 2;
    }
    std::unique_ptr<Link> link;
    if (std::strcmp(argv[1], "-") == 0)
        link = std::make_unique<CandumpLines>();
    else
        link = std::make_unique<SocketCan>(argv[1]);
    if (!link->open)
        return 1;
    for (int number : {SIGINT, SIGTERM, SIGPIPE}) // SIGPIPE: the program that reads the output has ended
        std::signal(number, [](int) { stopped = 1; });
    Loop loop;
    if (argc > 2)
        loop.inflation.emplace(setpoint_kpa, first_sequence(*link),
                               no_proof_tests ? pneuforce::FORBIDDEN : pneuforce::ALLOWED);
    run(*link, loop);
    std::fflush(stdout);
    return report(loop.inflation);
}

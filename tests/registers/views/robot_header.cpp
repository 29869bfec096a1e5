// Prints what pneuforce_can.hpp does with setpoints (arguments) and with Force frames, one result in each line.

#include <cstdio>
#include <string>

#include "pneuforce_can.hpp"

using namespace pneuforce;

void print_hold(const char *setpoint)
{
    Inflation inflation(std::stod(setpoint), 1);
    inflation.take(Answer{1, ACCEPTED, {}}); // to the Command lease
    std::uint16_t vent_pa = read_code(*inflation.due(0), 0);
    inflation.take(Answer{2, ACCEPTED, {}});
    inflation.take(Status{0, VENTING, 0, 0, 0});
    std::printf("hold %s vent=%u hold=%u\n", setpoint, vent_pa, read_code(*inflation.due(0.1), 0));
}

void print_force(const char *name, const Frame &frame, double age_s)
{
    ForceInput input;
    input.take(*decode_force(frame), 10.0);
    Reading force_n = input.force_n(10.0 + age_s);
    std::printf("force %s value=%g valid=%d\n", name, std::fabs(force_n.value), force_n.valid);
}

// A force of 1.4 N that falls within 10 ms, and is 0 N again after 2 s.
void print_fall()
{
    ForceInput input;
    Frame frame{FORCE + NODE_ID, 8, {0x78, 0x05, 0, 0, 0, 0, FORCE_VALID, 1}};
    for (double now_s : {10.0, 10.01, 12.0}) {
        input.take(*decode_force(frame), now_s);
        std::printf("fall falls=%d\n", input.falls());
        frame.data[0] = frame.data[1] = 0;
        frame.data[7]++;
    }
}

int main(int argc, char **argv)
{
    for (int i = 1; i < argc; i++)
        print_hold(argv[i]);
    Frame zeros{FORCE + NODE_ID, 8, {}}, half_newton{FORCE + NODE_ID, 8, {0xF4, 0x01, 0, 0, 0, 0, FORCE_VALID, 1}};
    print_force("zeros", zeros, 0.01);
    print_force("new", half_newton, 0.01);
    print_force("old", half_newton, 0.11);
    print_force("future", half_newton, -0.01);
    print_fall();
    Inflation ninth(8, 1, ALLOWED, 9);
    bool other = decode_force(half_newton, 9).has_value();
    std::printf("node command=%X release=%X other=%d\n", ninth.due(0)->id, ninth.vent_and_release()->id, other);
}

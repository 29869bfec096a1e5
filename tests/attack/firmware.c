/* Random samples, supply voltages, times and bytes for the firmware, compiled with sanitizers.
 *
 * usage: firmware SAMPLES SEED. Prints the numbers of samples with an open inlet, with a held balloon and in a
 * trip. Ends with code 1 if a valve is powered in a state in which no valve may be powered. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "board.h"

#define EPISODE 6000u /* samples between two restarts of the board */

static uint64_t random_state;

static uint32_t next(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return (uint32_t)(random_state >> 32);
}

/* Write one frame with a valid CRC: usually `kind` with the command of this episode, otherwise random content. */
static void frame(uint8_t *f, uint8_t kind, uint16_t sequence, bool hold, uint16_t setpoint)
{
    const uint16_t limit = 18000, timeout = 2000;

    for (uint8_t i = 0; i < FRAME_BYTES; i++)
        f[i] = (uint8_t)next();
    f[0] = SYNC_0, f[1] = SYNC_1, f[3] = PROTOCOL_VERSION, f[4] = (uint8_t)sequence, f[5] = (uint8_t)(sequence >> 8);
    if (next() % 50) {
        f[2] = kind, f[6] = hold, f[7] = next() % 100 ? FLAG_ZEROED : (uint8_t)next();
        f[8] = (uint8_t)setpoint, f[9] = (uint8_t)(setpoint >> 8), f[10] = 0, f[11] = 0;
        f[12] = (uint8_t)limit, f[13] = (uint8_t)(limit >> 8);
        f[14] = (uint8_t)timeout, f[15] = (uint8_t)(timeout >> 8), f[16] = 0;
    }
    uint16_t crc = crc_of(f);
    f[CRC_AT] = (uint8_t)crc, f[CRC_AT + 1] = (uint8_t)(crc >> 8);
}

/* Return the pressure [kPa] after 2 ms: the inlet fills the balloon, the vent empties it. */
static float next_pressure(float kpa, uint8_t valves)
{
    if (valves & 1)
        kpa += 0.012f;
    if (!(valves & 2))
        kpa -= kpa * 0.03f;
    if (next() % 4000 == 0)
        kpa += (float)(next() % 2000) / 100.0f - 5.0f; /* a hand, a burst, a kink */
    return kpa;
}

int main(int count, char **arguments)
{
    if (count != 3)
        return 2;
    uint64_t samples = strtoull(arguments[1], 0, 10), open = 0, held = 0, tripped = 0;
    random_state = strtoull(arguments[2], 0, 10) * 2 + 1;
    struct board b = {0};
    uint32_t time_us = 0;
    uint16_t sequence = 0, setpoint = 0;
    float kpa = 0.0f;

    for (uint64_t n = 0; n < samples; n++) {
        uint32_t at = (uint32_t)(n % EPISODE);
        uint8_t received[2 * FRAME_BYTES], bytes = 0;

        if (at == 0) {
            board_init(&b, 2, (uint32_t)n, (uint32_t)n, next() % 8 == 0);
            setpoint = (uint16_t)(next() % 8 ? 2000 + next() % 10000 : next());
            time_us = next(), kpa = 0.0f;
        }
        time_us += next() % 10000 ? 2000 : next();
        board_start_sample(&b, time_us);
        if (at % 25 == 0 && next() % 20) {
            frame(received, at ? KIND_COMMAND : KIND_IDENTIFY, sequence++, at > 300, setpoint);
            bytes = FRAME_BYTES;
        } else if (next() % 500 == 0) {
            for (bytes = 0; bytes < next() % sizeof received; bytes++)
                received[bytes] = (uint8_t)next();
        }
        for (uint8_t i = 0; i < bytes; i++)
            board_receive(&b, received[i]);
        kpa = next_pressure(kpa, b.pressure.status.valves);
        float counts = 16384.0f * (0.018f * kpa + 0.04f) + (float)(next() % 9);
        uint16_t adc = counts < 0.0f ? 0 : counts > 65535.0f ? 65535 : (uint16_t)counts;
        board_step(&b, next() % 20000 ? adc : (uint16_t)next(), next() % 20000 ? 5000 : (uint16_t)next());
        uint8_t valves = b.pressure.status.valves, state = b.pressure.status.state;
        open += valves & 1, held += state == 4, tripped += state == 6;
        if (valves > 3 || (valves && (state < 2 || (state > 4 && state != 7)))) {
            printf("valves %d in state %d at sample %llu\n", valves, state, (unsigned long long)n);
            return 1;
        }
    }
    printf("%llu %llu %llu\n", (unsigned long long)open, (unsigned long long)held, (unsigned long long)tripped);
    return 0;
}

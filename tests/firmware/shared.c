/* The firmware's headers as a library for the tests. */
#include <stdlib.h>

#include "board.h"

struct board *board_new(uint8_t kind, uint32_t serial, bool unasked)
{
    struct board *b = malloc(sizeof *b);

    board_begin(b, kind, serial, unasked);
    return b;
}

/* Bytes to send stand in `*out`; their number is returned. */
uint8_t board_take(struct board *b, uint32_t time_us, uint16_t adc_sum, uint16_t supply_mv, const uint8_t *received,
                   uint32_t n, const uint8_t **out)
{
    board_tick(b, time_us);
    while (n--)
        board_hear(b, *received++);
    board_step(b, adc_sum, supply_mv);
    *out = b->out;
    return b->out_bytes;
}

uint8_t board_valves(const struct board *b)
{
    return b->pressure.now.valves;
}

bool board_is_ok(const struct board *b)
{
    return board_ok(b);
}

/* The frames in a stream, one after the other in `frames`; their number is returned. */
uint32_t decode_stream(const uint8_t *stream, uint32_t n, uint8_t *frames, uint32_t *refused, uint32_t *skipped_bytes)
{
    struct decoder d = {{0}, 0, 0, 0};
    uint32_t count = 0;

    while (n--)
        if (decode(&d, *stream++))
            memcpy(frames + FRAME_BYTES * count++, d.frame, FRAME_BYTES);
    *refused = d.refused;
    *skipped_bytes = d.skipped_bytes;
    return count;
}

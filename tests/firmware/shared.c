/* Library with the headers of the firmware for the tests. */
#include <stdlib.h>

#include "board.h"

struct board *board_new(uint8_t kind, uint32_t serial, uint32_t image_crc, bool unexpected_reset)
{
    struct board *b = malloc(sizeof *b);

    board_init(b, kind, serial, image_crc, unexpected_reset);
    return b;
}

/* Process the received bytes and one sample. Set `*out` to the bytes to send and return their number. */
uint8_t board_process(struct board *b, uint32_t time_us, uint16_t adc_sum, uint16_t supply_mv, const uint8_t *received,
                      uint32_t n, const uint8_t **out)
{
    board_start_sample(b, time_us);
    while (n--)
        board_receive(b, *received++);
    board_step(b, adc_sum, supply_mv);
    *out = b->out;
    return b->out_bytes;
}

uint8_t board_valves(const struct board *b)
{
    return b->pressure.status.valves;
}

bool board_is_ok(const struct board *b)
{
    return board_ok(b);
}

/* Copy the frames in a stream to `frames` and return their number. */
uint32_t decode_stream(const uint8_t *stream, uint32_t n, uint8_t *frames, uint32_t *rejected_frames,
                       uint32_t *skipped_bytes)
{
    struct frame_decoder d = {{0}, 0, 0, 0};
    uint32_t count = 0;

    while (n--)
        if (decode(&d, *stream++))
            memcpy(frames + FRAME_BYTES * count++, d.frame, FRAME_BYTES);
    *rejected_frames = d.rejected_frames;
    *skipped_bytes = d.skipped_bytes;
    return count;
}

/* Return the duration of the vent pulse [ms] of a proof test that begins at a pressure above the setpoint. */
unsigned vent_ms_of_proof_test(unsigned setpoint_pa, unsigned above_pa)
{
    struct pressure_reading reading = {0};
    struct proof_test test;
    float setpoint_kpa = setpoint_pa / PA_PER_KPA;

    reading.filtered_kpa = setpoint_kpa + above_pa / PA_PER_KPA;
    proof_test_start(&test, setpoint_kpa, &reading);
    return test.vent_ms;
}

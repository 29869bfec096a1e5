/* Board side of the rig link: receives bytes and returns bytes once per sample.
 * On shutdown: only the result of `board_step` drives the valves, and it is SAFE after boot. */
#ifndef BOARD_H
#define BOARD_H

#include "pressure_control.h"
#include "wire.h"

/* Number of frames that the line carries in two samples. Further frames are dropped, and the host detects a gap. */
#define MAX_FRAMES 8u

/* State of the board and of its link to the host. Samples are sent only to a host with the same protocol version. */
struct board {
    struct pressure_controller pressure;
    struct frame_decoder decoder;
    uint8_t kind;
    bool identified;
    bool hello_sent;
    uint8_t last_command;  /* low byte of the sequence number of the last command */
    uint16_t samples;      /* samples sent since boot */
    uint16_t other_frames; /* frames sent that are not samples */
    uint32_t serial;
    uint32_t image_crc;
    uint32_t uptime_ms;
    uint32_t time_us;
    uint32_t last_hello_us;
    uint8_t out[MAX_FRAMES * FRAME_BYTES];
    uint8_t out_bytes;
};

/* Set the values at boot. `image_crc`: CRC-32 of the program in the flash. `unexpected_reset`: the watchdog or a
 * brown-out has restarted the board. */
static void board_init(struct board *b, uint8_t kind, uint32_t serial, uint32_t image_crc, bool unexpected_reset)
{
    memset(b, 0, sizeof *b);
    b->kind = kind;
    b->serial = serial;
    b->image_crc = image_crc;
    pressure_init(&b->pressure, unexpected_reset);
}

/* Return true if the rig may be used: the host is active and no fault is latched. */
static bool board_ok(const struct board *b)
{
    return b->identified && host_active(&b->pressure.status) && !b->pressure.status.latched_fault_count;
}

static void queue_frame(struct board *b, uint8_t kind, uint16_t sequence, const void *payload, uint8_t payload_bytes)
{
    if (b->out_bytes > sizeof b->out - FRAME_BYTES)
        return;
    encode(b->out + b->out_bytes, kind, sequence, payload, payload_bytes);
    b->out_bytes += FRAME_BYTES;
}

/* Queue an Image and a Hello. The Image is first, so that the host knows both after the Hello. */
static void queue_identification(struct board *b)
{
    struct image image = {b->image_crc};
    struct hello hello = {b->kind, FIRMWARE_REVISION, b->uptime_ms, b->serial, HOST_SILENCE_MS,
                          b->pressure.status.host_timeout_ms};

    b->hello_sent = true;
    b->last_hello_us = b->time_us;
    queue_frame(b, KIND_IMAGE, ++b->other_frames, &image, sizeof image);
    queue_frame(b, KIND_HELLO, ++b->other_frames, &hello, sizeof hello);
}

static void queue_events(struct board *b)
{
    uint8_t n;

    for (n = 0; n < b->pressure.change_count && b->identified; n++) {
        const struct state_change *c = &b->pressure.changes[n];
        struct event event = {b->time_us, c->state, c->previous_state, c->fault};
        queue_frame(b, KIND_EVENT, ++b->other_frames, &event, sizeof event);
    }
    b->pressure.change_count = 0;
}

static void queue_sample(struct board *b, uint16_t adc_sum)
{
    const struct board_status *status = &b->pressure.status;
    struct sample sample = {b->time_us, adc_sum, status->supply.mean_mv, status->valves, status->state,
                            FAULT_NONE, 0, b->last_command, (uint16_t)(status->setpoint_kpa * 1e3f + 0.5f)};
    uint8_t n;

    if (!b->identified)
        return;
    if (status->latched_fault_count)
        sample.fault = status->latched_faults[0];
    for (n = 0; n < status->latched_fault_count; n++)
        sample.faults |= (uint16_t)(1u << status->latched_faults[n]);
    queue_frame(b, KIND_SAMPLE, ++b->samples, &sample, sizeof sample);
}

/* Answer an Identify or apply a command. Before its Identify, a host may only vent. */
static void handle(struct board *b, const uint8_t *frame)
{
    struct command command;

    switch (frame[2]) {
    case KIND_IDENTIFY:
        if (frame[3] == PROTOCOL_VERSION) {
            b->identified = true;
            host_identified(&b->pressure);
        }
        queue_identification(b);
        break;
    case KIND_VENT:
        vent(&b->pressure);
        break;
    case KIND_COMMAND:
        memcpy(&command, frame + HEAD_BYTES, sizeof command);
        if (b->identified && command.mode <= MODE_HOLD) {
            b->last_command = frame[4];
            apply_command(&b->pressure, &command);
        }
    }
}

/* Process one byte from the host. */
static void board_receive(struct board *b, uint8_t byte)
{
    if (decode(&b->decoder, byte))
        handle(b, b->decoder.frame);
}

/* Start a new sample. Frames that are received from now on are answered in this sample. */
static void board_start_sample(struct board *b, uint32_t board_time_us)
{
    b->time_us = board_time_us;
    b->uptime_ms += SAMPLE_MS;
    b->out_bytes = 0;
}

/* Process one sample after the received bytes. The bytes to send are in `out`. Return the valves to drive. */
static uint8_t board_step(struct board *b, uint16_t adc_sum, uint16_t supply_mv)
{
    pressure_step(&b->pressure, adc_sum, supply_mv);
    if (!b->identified && (!b->hello_sent || b->time_us - b->last_hello_us >= HELLO_INTERVAL_US))
        queue_identification(b);
    queue_events(b);
    queue_sample(b, adc_sum);
    return b->pressure.status.valves;
}

#endif

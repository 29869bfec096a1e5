/* The board's end of the rig link: bytes in, bytes out, once per sample.
 * On shutdown: `board_step` is the only source of what the valves are told, and it begins with SAFE. */
#ifndef BOARD_H
#define BOARD_H

#include "pressure.h"
#include "wire.h"

/* As many frames as the line carries in two samples; what is beyond is lost and seen as a gap. */
#define MOST_FRAMES 8u

/* A board that has just booted. It streams to a host of its own version only. */
struct board {
    struct pressure pressure;
    struct decoder decoder;
    uint8_t kind;
    bool identified;
    bool greeted;
    uint8_t obeyed; /* low byte of the sequence of the last command */
    uint16_t samples; /* sent since boot */
    uint16_t others;  /* frames sent that are no samples */
    uint32_t serial;
    uint32_t uptime_ms;
    uint32_t time_us;
    uint32_t greeted_us;
    uint8_t out[MOST_FRAMES * FRAME_BYTES];
    uint8_t out_bytes;
};

/* As it is at boot; `unasked` where watchdog or brown-out restarted the board. */
static void board_begin(struct board *b, uint8_t kind, uint32_t serial, bool unasked)
{
    memset(b, 0, sizeof *b);
    b->kind = kind;
    b->serial = serial;
    pressure_begin(&b->pressure, unasked);
}

/* Whether the rig may be used: a host is heard and nothing is latched. */
static bool board_ok(const struct board *b)
{
    return b->identified && host_heard(&b->pressure.now) && !b->pressure.now.latched_count;
}

static void say(struct board *b, uint8_t kind, uint16_t sequence, const void *payload, uint8_t payload_bytes)
{
    if (b->out_bytes > sizeof b->out - FRAME_BYTES)
        return;
    encode(b->out + b->out_bytes, kind, sequence, payload, payload_bytes);
    b->out_bytes += FRAME_BYTES;
}

static void say_hello(struct board *b)
{
    struct hello hello = {b->kind, FIRMWARE, b->uptime_ms, b->serial, HOST_SILENCE_MS,
                          b->pressure.now.vent_after_ms};

    b->greeted = true;
    b->greeted_us = b->time_us;
    say(b, KIND_HELLO, ++b->others, &hello, sizeof hello);
}

static void say_changes(struct board *b)
{
    uint8_t n;

    for (n = 0; n < b->pressure.change_count && b->identified; n++) {
        const struct change *c = &b->pressure.changes[n];
        struct event event = {b->time_us, c->state, c->was, c->fault};
        say(b, KIND_EVENT, ++b->others, &event, sizeof event);
    }
    b->pressure.change_count = 0;
}

static void say_sample(struct board *b, uint16_t adc_sum)
{
    const struct situation *now = &b->pressure.now;
    struct sample sample = {b->time_us, adc_sum, now->supply.mean_mv, now->valves, now->state,
                            FAULT_NONE, 0, b->obeyed, (uint16_t)(now->setpoint_kpa * 1e3f + 0.5f)};
    uint8_t n;

    if (!b->identified)
        return;
    if (now->latched_count)
        sample.fault = now->latched[0];
    for (n = 0; n < now->latched_count; n++)
        sample.faults |= (uint16_t)(1u << now->latched[n]);
    say(b, KIND_SAMPLE, ++b->samples, &sample, sizeof sample);
}

/* Answer a greeting, obey the rest. Before its greeting a host may only vent. */
static void handle(struct board *b, const uint8_t *frame)
{
    struct command command;

    switch (frame[2]) {
    case KIND_IDENTIFY:
        if (frame[3] == PROTOCOL_VERSION) {
            b->identified = true;
            greet(&b->pressure);
        }
        say_hello(b);
        break;
    case KIND_VENT:
        vent(&b->pressure);
        break;
    case KIND_COMMAND:
        memcpy(&command, frame + HEAD_BYTES, sizeof command);
        if (b->identified && command.mode <= MODE_HOLD) {
            b->obeyed = frame[4];
            obey(&b->pressure, &command);
        }
    }
}

/* The board takes in a byte from the host. */
static void board_hear(struct board *b, uint8_t byte)
{
    if (decode(&b->decoder, byte))
        handle(b, b->decoder.frame);
}

/* A new sample begins: what is heard from now on is answered in it. */
static void board_tick(struct board *b, uint32_t board_time_us)
{
    b->time_us = board_time_us;
    b->uptime_ms += SAMPLE_MS;
    b->out_bytes = 0;
}

/* After what was heard: one sample taken. Bytes to send stand in `out`, valves to drive are returned. */
static uint8_t board_step(struct board *b, uint16_t adc_sum, uint16_t supply_mv)
{
    pressure_step(&b->pressure, adc_sum, supply_mv);
    if (!b->identified && (!b->greeted || b->time_us - b->greeted_us >= HELLO_EVERY_US))
        say_hello(b);
    say_changes(b);
    say_sample(b, adc_sum);
    return b->pressure.now.valves;
}

#endif

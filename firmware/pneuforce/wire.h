/* The frames of the rig link, byte for byte as docs/rig-link.md has them.
 * On shutdown: nothing here drives a pin; a frame that is cut short is one that the host refuses. */
#ifndef WIRE_H
#define WIRE_H

#include <stdbool.h>
#include <string.h>

#include "numbers.h"

#define HEAD_BYTES 6u
#define PAYLOAD_BYTES 16u
#define CRC_AT (FRAME_BYTES - 2u)

/* CRC-16/IBM-3740 over kind … payload, a byte at a time without a table. Its halves are apart because an
 * AVR shifts 16 bits in loops. */
static uint16_t crc_of(const uint8_t *frame)
{
    uint8_t high = 0xFFu, low = 0xFFu, n;

    for (n = 2; n < CRC_AT; n++) {
        uint8_t x = high ^ frame[n];
        x ^= x >> 4;
        high = low ^ (uint8_t)(x << 4) ^ x >> 3;
        low = (uint8_t)(x << 5) ^ x;
    }
    return (uint16_t)high << 8 | low;
}

/* The 24 bytes of a message. */
static void encode(uint8_t *frame, uint8_t kind, uint16_t sequence, const void *payload, uint8_t payload_bytes)
{
    uint16_t crc;

    frame[0] = SYNC_0;
    frame[1] = SYNC_1;
    frame[2] = kind;
    frame[3] = PROTOCOL_VERSION;
    frame[4] = (uint8_t)sequence;
    frame[5] = (uint8_t)(sequence >> 8);
    memset(frame + HEAD_BYTES, 0, PAYLOAD_BYTES);
    memcpy(frame + HEAD_BYTES, payload, payload_bytes);
    crc = crc_of(frame);
    frame[CRC_AT] = (uint8_t)crc;
    frame[CRC_AT + 1] = (uint8_t)(crc >> 8);
}

/* The board's ear: a byte in, perhaps a frame out. What is no frame of a host is counted. */
struct decoder {
    uint8_t frame[FRAME_BYTES];
    uint8_t held; /* bytes of it */
    uint32_t refused;
    uint32_t skipped_bytes;
};

/* Whether a host may say this. Of another version only Identify is heard: versions are compared there.
 * Kind and version come first, so that nonsense at the full rate of the line costs no CRC. */
static bool from_host(const uint8_t *frame)
{
    uint8_t kind = frame[2];

    if (kind != KIND_IDENTIFY && (frame[3] != PROTOCOL_VERSION || (kind != KIND_COMMAND && kind != KIND_VENT)))
        return false;
    return crc_of(frame) == (uint16_t)(frame[CRC_AT] | (uint16_t)frame[CRC_AT + 1] << 8);
}

/* Forget bytes until a frame may begin with what is left. */
static void look_for_start(struct decoder *d, uint8_t from)
{
    while (from < d->held) {
        bool starts = d->frame[from] == SYNC_0 && (from + 1u == d->held || d->frame[from + 1u] == SYNC_1);
        if (starts)
            break;
        from++;
    }
    d->skipped_bytes += from;
    d->held -= from;
    memmove(d->frame, d->frame + from, d->held);
}

/* True where this byte completes a frame: it stands in `frame` until the next byte comes. A refused
 * candidate is searched for another start. */
static bool decode(struct decoder *d, uint8_t byte)
{
    if (d->held == FRAME_BYTES)
        d->held = 0;
    d->frame[d->held++] = byte;
    if (d->held <= 2)
        look_for_start(d, 0);
    if (d->held < FRAME_BYTES)
        return false;
    if (from_host(d->frame))
        return true;
    d->refused++;
    look_for_start(d, 1);
    return false;
}

#endif

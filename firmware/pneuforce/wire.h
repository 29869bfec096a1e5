/* Frames of the rig link, as specified in docs/rig-link.md.
 * On shutdown: this file drives no pin; the host rejects an incomplete frame. */
#ifndef WIRE_H
#define WIRE_H

#include <stdbool.h>
#include <string.h>

#include "numbers.h"

#define HEAD_BYTES 6u
#define PAYLOAD_BYTES 16u
#define CRC_AT (FRAME_BYTES - 2u)

/* Return the CRC-16/IBM-3740 over the bytes from kind to payload, computed without a table. High and low byte are
 * separate variables because an AVR shifts 16 bits in loops. */
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

/* Write the frame (24 bytes) of a message. */
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

/* Decoder from received bytes to frames of a host. Invalid frames are counted. */
struct frame_decoder {
    uint8_t frame[FRAME_BYTES];
    uint8_t held_bytes; /* received bytes in `frame` */
    uint32_t rejected_frames;
    uint32_t skipped_bytes;
};

/* Return true if the frame is a valid frame of a host. With another protocol version only Identify is valid, because
 * it carries the version check. Kind and version are compared before the CRC, so that random bytes at the full rate
 * of the line cause no CRC computations. */
static bool is_host_frame(const uint8_t *frame)
{
    uint8_t kind = frame[2];

    if (kind != KIND_IDENTIFY && (frame[3] != PROTOCOL_VERSION || (kind != KIND_COMMAND && kind != KIND_VENT)))
        return false;
    return crc_of(frame) == (uint16_t)(frame[CRC_AT] | (uint16_t)frame[CRC_AT + 1] << 8);
}

/* Drop bytes until the remaining bytes may be the start of a frame. */
static void resynchronise(struct frame_decoder *d, uint8_t from)
{
    while (from < d->held_bytes) {
        bool starts = d->frame[from] == SYNC_0 && (from + 1u == d->held_bytes || d->frame[from + 1u] == SYNC_1);
        if (starts)
            break;
        from++;
    }
    d->skipped_bytes += from;
    d->held_bytes -= from;
    memmove(d->frame, d->frame + from, d->held_bytes);
}

/* Add one byte. Return true if the byte completes a frame, which stays in `frame` until the next byte. The decoder
 * searches the bytes of a rejected frame for another start. */
static bool decode(struct frame_decoder *d, uint8_t byte)
{
    if (d->held_bytes == FRAME_BYTES)
        d->held_bytes = 0;
    d->frame[d->held_bytes++] = byte;
    if (d->held_bytes <= 2)
        resynchronise(d, 0);
    if (d->held_bytes < FRAME_BYTES)
        return false;
    if (is_host_frame(d->frame))
        return true;
    d->rejected_frames++;
    resynchronise(d, 1);
    return false;
}

#endif

/* What is wired to the chip: the sensor at A0, the supply, and the serial line. */
#ifndef WIRING_H
#define WIRING_H

#include <stdint.h>
#include <string.h>

#include <simavr/sim_avr.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_uart.h>

#define CONVERSIONS 16
#define CONVERSION_CYCLES (13 * 128)
#define LEVELS 1024
#define BANDGAP_MV 1100
#define BYTE_CYCLES 320 /* 8N1 at 500 kBd */
#define UART_HOLDS 2 /* bytes unread */
#define QUEUE 8192

enum { ADCL = 0x78, ADCH = 0x79, UCSR0A = 0xC0, U2X = 2, UBRR0 = 0xC4 };

struct queue {
    uint8_t bytes[QUEUE];
    uint32_t in, out;
};

struct chip {
    avr_io_t io; /* first: simavr hands this back at a reset and at each kick of the watchdog */
    avr_t *avr;
    avr_irq_t *to_uart;
    avr_uart_t *uart;
    struct queue received, sent;
    uint64_t target;          /* cycle to run to */
    uint16_t given_sum, sum;  /* what the sensor gives; what it gave when the sum in progress began */
    uint32_t supply_mv;
    uint16_t result, coming;  /* of the conversion before the one started last, and of that one */
    uint64_t ready;           /* cycle at which `coming` is the result */
    uint32_t sensor_count, bandgap_count; /* conversions since reset */
    uint64_t sum_done;        /* cycle at which the last sum was complete; 0 once it was worked on */
    uint32_t longest;         /* cycles from a complete sum to the kick of the watchdog */
    uint32_t overruns;        /* bytes that a real UART would have lost */
    uint32_t resets;
};

/* What does not fit is lost. */
static void put(struct queue *q, uint8_t byte)
{
    if (q->in - q->out < QUEUE)
        q->bytes[q->in++ % QUEUE] = byte;
}

/* Part `n` of a whole that is shared out evenly: parts differ by one at most and add up. */
static uint32_t share(uint64_t whole, uint32_t parts, uint64_t n)
{
    return (n + 1) * whole / parts - n * whole / parts;
}

static uint32_t sensor_counts(struct chip *c)
{
    uint32_t n = c->sensor_count++ % CONVERSIONS;
    if (n == 0)
        c->sum = c->given_sum;
    if (n == CONVERSIONS - 1)
        c->sum_done = c->avr->cycle + CONVERSION_CYCLES;
    return share(c->sum, CONVERSIONS, n);
}

/* The true ratio less half a count on average, as noise and truncation make it: one count alone is 22 mV. */
static uint32_t bandgap_counts(struct chip *c)
{
    if (c->supply_mv <= BANDGAP_MV)
        return LEVELS - 1;
    return share(2 * BANDGAP_MV * LEVELS - c->supply_mv, 2 * c->supply_mv, c->bandgap_count++);
}

static void on_conversion(avr_irq_t *irq, uint32_t value, void *param)
{
    struct chip *c = param;
    avr_adc_mux_t mux;
    memcpy(&mux, &value, sizeof value);
    c->result = c->coming;
    c->coming = 0;
    c->ready = c->avr->cycle + CONVERSION_CYCLES;
    if (mux.kind == ADC_MUX_SINGLE && mux.src == 0)
        c->coming = sensor_counts(c);
    else if (mux.kind == ADC_MUX_REF && mux.src == BANDGAP_MV)
        c->coming = bandgap_counts(c);
}

/* simavr converts when the result is read, by the channel of that moment; a chip keeps that of the start. */
static uint8_t read_result(avr_t *avr, avr_io_addr_t address, void *param)
{
    struct chip *c = param;
    uint16_t result = avr->cycle < c->ready ? c->result : c->coming;
    return address == ADCL ? result & 0xFF : result >> 8;
}

/* Whether the chip's line is as fast as the host's: else neither understands the other. simavr takes the pace from
 * what the registers hold when the last of them is written, and adds a parity bit. */
static int in_pace(struct chip *c)
{
    const uint8_t *data = c->avr->data;
    int bit_cycles = (data[UCSR0A] & U2X ? 8 : 16) * (1 + data[UBRR0] + 256 * data[UBRR0 + 1]);
    c->uart->cycles_per_byte = 10 * bit_cycles;
    return c->uart->cycles_per_byte == BYTE_CYCLES;
}

static void on_byte(avr_irq_t *irq, uint32_t value, void *param)
{
    struct chip *c = param;
    if (in_pace(c))
        put(&c->sent, (uint8_t)value);
}

static avr_cycle_count_t feed(avr_t *avr, avr_cycle_count_t when, void *param)
{
    struct chip *c = param;
    uint8_t byte = c->received.bytes[c->received.out++ % QUEUE];
    if (in_pace(c))
        avr_raise_irq(c->to_uart, byte);
    uint32_t unread = (c->uart->input.write - c->uart->input.read) & (uart_fifo_fifo_size - 1);
    c->overruns += unread > UART_HOLDS;
    return c->received.in == c->received.out ? 0 : when + BYTE_CYCLES;
}

static void wire(struct chip *c)
{
    avr_t *avr = c->avr;
    for (avr_io_t *io = avr->io_port; io; io = io->next)
        if (!strcmp(io->kind, "uart"))
            c->uart = (avr_uart_t *)io;
    c->to_uart = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_byte, c);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER), on_conversion, c);
    for (int address = ADCL; address <= ADCH; address++) {
        avr->io[AVR_DATA_TO_IO(address)].r.c = read_result;
        avr->io[AVR_DATA_TO_IO(address)].r.param = c;
    }
}

#endif

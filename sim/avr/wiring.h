/* Wiring of the chip: sensor at A0, supply and serial line. */
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
#define UART_BUFFER_BYTES 2 /* receive buffer of a real UART */
#define QUEUE 8192

enum { ADCL = 0x78, ADCH = 0x79, UCSR0A = 0xC0, U2X = 2, UBRR0 = 0xC4 };

struct queue {
    uint8_t bytes[QUEUE];
    uint32_t in, out;
};

struct chip {
    avr_io_t io; /* must be first: simavr passes a pointer to this member to the callbacks */
    avr_t *avr;
    avr_irq_t *to_uart;
    avr_uart_t *uart;
    struct queue received, sent;
    uint64_t target;                      /* cycle at which the run stops */
    uint16_t next_sum, sum;               /* result of the next sum; result of the sum in progress */
    uint32_t supply_mv;
    uint16_t result, next_result;         /* of the previous conversion; of the conversion that was started last */
    uint64_t ready;                       /* cycle at which `next_result` becomes the result */
    uint32_t sensor_count, bandgap_count; /* conversions since reset */
    uint64_t sum_done;                    /* cycle at which the last sum was complete; 0 after the firmware used it */
    uint32_t longest;                     /* longest time from a complete sum to the watchdog reset [cycles] */
    uint32_t overruns;                    /* bytes that a real UART would have lost */
    uint32_t resets;
};

/* Add a byte. A byte that does not fit is lost. */
static void queue_push(struct queue *q, uint8_t byte)
{
    if (q->in - q->out < QUEUE)
        q->bytes[q->in++ % QUEUE] = byte;
}

/* Return part `n` of a total that is split evenly. The parts differ by at most one, and their sum is the total. */
static uint32_t split(uint64_t total, uint32_t parts, uint64_t n)
{
    return (n + 1) * total / parts - n * total / parts;
}

static uint32_t sensor_counts(struct chip *c)
{
    uint32_t n = c->sensor_count++ % CONVERSIONS;
    if (n == 0)
        c->sum = c->next_sum;
    if (n == CONVERSIONS - 1)
        c->sum_done = c->avr->cycle + CONVERSION_CYCLES;
    return split(c->sum, CONVERSIONS, n);
}

/* Return a bandgap conversion. The mean is the true ratio minus half a count, because a real conversion truncates. One
 * count corresponds to 22 mV. */
static uint32_t bandgap_counts(struct chip *c)
{
    if (c->supply_mv <= BANDGAP_MV)
        return LEVELS - 1;
    return split(2 * BANDGAP_MV * LEVELS - c->supply_mv, 2 * c->supply_mv, c->bandgap_count++);
}

static void on_conversion(avr_irq_t *irq, uint32_t value, void *param)
{
    struct chip *c = param;
    avr_adc_mux_t mux;
    memcpy(&mux, &value, sizeof value);
    c->result = c->next_result;
    c->next_result = 0;
    c->ready = c->avr->cycle + CONVERSION_CYCLES;
    if (mux.kind == ADC_MUX_SINGLE && mux.src == 0)
        c->next_result = sensor_counts(c);
    else if (mux.kind == ADC_MUX_REF && mux.src == BANDGAP_MV)
        c->next_result = bandgap_counts(c);
}

/* Replaces the result of simavr, which uses the channel that is selected when the program reads the result. A real chip
 * uses the channel that was selected at the start of the conversion. */
static uint8_t read_result(avr_t *avr, avr_io_addr_t address, void *param)
{
    struct chip *c = param;
    uint16_t result = avr->cycle < c->ready ? c->result : c->next_result;
    return address == ADCL ? result & 0xFF : result >> 8;
}

/* Set the byte time of the UART from its registers. Return true if chip and host use the same bit rate; otherwise no
 * byte is transferred. simavr alone would compute a wrong byte time: it adds a parity bit, and reads the registers only
 * when the last one is written. */
static int bit_rate_matches(struct chip *c)
{
    const uint8_t *data = c->avr->data;
    int bit_cycles = (data[UCSR0A] & U2X ? 8 : 16) * (1 + data[UBRR0] + 256 * data[UBRR0 + 1]);
    c->uart->cycles_per_byte = 10 * bit_cycles;
    return c->uart->cycles_per_byte == BYTE_CYCLES;
}

static void on_byte(avr_irq_t *irq, uint32_t value, void *param)
{
    struct chip *c = param;
    if (bit_rate_matches(c))
        queue_push(&c->sent, (uint8_t)value);
}

static avr_cycle_count_t send_next_byte(avr_t *avr, avr_cycle_count_t when, void *param)
{
    struct chip *c = param;
    uint8_t byte = c->received.bytes[c->received.out++ % QUEUE];
    if (bit_rate_matches(c))
        avr_raise_irq(c->to_uart, byte);
    uint32_t unread = (c->uart->input.write - c->uart->input.read) & (uart_fifo_fifo_size - 1);
    c->overruns += unread > UART_BUFFER_BYTES;
    return c->received.in == c->received.out ? 0 : when + BYTE_CYCLES;
}

static void connect_wiring(struct chip *c)
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

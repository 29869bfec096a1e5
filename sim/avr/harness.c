/* An ATmega328P in simavr, run to exact cycles, and what is wired to it: sensor, supply, serial line, relays.
 *
 * emulator.py builds this once and calls the functions at the end. Time is the chip's own: nothing here waits. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_uart.h>
#include <simavr/avr_watchdog.h>

#define CLOCK_HZ 16000000
#define CONVERSIONS 16
#define CONVERSION_CYCLES (13 * 128)
#define LEVELS 1024
#define BANDGAP_MV 1100
/* 500 kBd. simavr counts a parity bit, which 8N1 has not: 11 bits of 32 cycles each, here and on its way out. */
#define BYTE_CYCLES (11 * 32)
#define UART_HOLDS 2 /* bytes unread */
#define QUEUE 8192

enum { ADCL = 0x78, ADCH = 0x79, MCUSR = 0x54, PORTB = 0x25, PORT_REGISTERS = 3 };

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
    uint16_t result;          /* of the conversion started last */
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

/* The true ratio on average, as noise makes it: one count alone is 20 mV. */
static uint32_t bandgap_counts(struct chip *c)
{
    return c->supply_mv <= BANDGAP_MV ? LEVELS - 1 : share(BANDGAP_MV * LEVELS, c->supply_mv, c->bandgap_count++);
}

static void on_conversion(avr_irq_t *irq, uint32_t value, void *param)
{
    struct chip *c = param;
    avr_adc_mux_t mux;
    memcpy(&mux, &value, sizeof value);
    c->result = 0;
    if (mux.kind == ADC_MUX_SINGLE && mux.src == 0)
        c->result = sensor_counts(c);
    else if (mux.kind == ADC_MUX_REF && mux.src == BANDGAP_MV)
        c->result = bandgap_counts(c);
}

/* simavr converts when the result is read, by the channel of that moment; a chip keeps that of the start. */
static uint8_t read_result(avr_t *avr, avr_io_addr_t address, void *param)
{
    struct chip *c = param;
    return address == ADCL ? c->result & 0xFF : c->result >> 8;
}

static void on_byte(avr_irq_t *irq, uint32_t value, void *param)
{
    put(&((struct chip *)param)->sent, (uint8_t)value);
}

static avr_cycle_count_t feed(avr_t *avr, avr_cycle_count_t when, void *param)
{
    struct chip *c = param;
    avr_raise_irq(c->to_uart, c->received.bytes[c->received.out++ % QUEUE]);
    uint32_t unread = (c->uart->input.write - c->uart->input.read) & (uart_fifo_fifo_size - 1);
    c->overruns += unread > UART_HOLDS;
    return c->received.in == c->received.out ? 0 : when + BYTE_CYCLES;
}

/* A timer that does nothing ends the run there. */
static avr_cycle_count_t arrive(avr_t *avr, avr_cycle_count_t when, void *param)
{
    return 0;
}

static void sleep_in_no_time(avr_t *avr, avr_cycle_count_t cycles) {}

static void say_nothing(avr_t *avr, const int level, const char *format, va_list arguments)
{
}

/* A reset of any kind: simavr has forgotten all timers, and what was on the line is lost. */
static void on_reset(avr_io_t *io)
{
    struct chip *c = (struct chip *)io;
    c->received.out = c->received.in;
    c->sensor_count = c->bandgap_count = 0;
    c->sum_done = 0;
    c->resets++;
    if (c->target > c->avr->cycle)
        avr_cycle_timer_register(c->avr, c->target - c->avr->cycle, arrive, c);
}

static int on_ioctl(avr_io_t *io, uint32_t request, void *param)
{
    struct chip *c = (struct chip *)io;
    if (request == AVR_IOCTL_WATCHDOG_RESET && c->sum_done && c->avr->cycle >= c->sum_done) {
        uint64_t took = c->avr->cycle - c->sum_done;
        c->longest = took > c->longest ? took : c->longest;
        c->sum_done = 0;
    }
    return -1; /* the watchdog hears it too */
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
    c->io = (avr_io_t){.kind = "harness", .reset = on_reset, .ioctl = on_ioctl};
    avr_register_io(avr, &c->io);
}

/* A chip that is switched on, or NULL where the file holds no program for it. */
struct chip *chip_new(const char *elf, uint8_t *eeprom, uint32_t size)
{
    elf_firmware_t firmware = {0};
    avr_global_logger_set(say_nothing);
    struct chip *c = calloc(1, sizeof *c);
    if (!c || !(c->avr = avr_make_mcu_by_name("atmega328p")) || elf_read_firmware(elf, &firmware)) {
        free(c);
        return NULL;
    }
    avr_init(c->avr);
    c->avr->frequency = CLOCK_HZ;
    firmware.frequency = CLOCK_HZ;
    avr_load_firmware(c->avr, &firmware);
    free(firmware.flash);
    c->avr->sleep = sleep_in_no_time;
    avr_eeprom_desc_t preset = {.ee = eeprom, .offset = 0, .size = size};
    avr_ioctl(c->avr, AVR_IOCTL_EEPROM_SET, &preset);
    wire(c);
    return c;
}

/* Run to a cycle since it was switched on; 0, or -1 where the program has crashed. */
int chip_run(struct chip *c, uint64_t cycle)
{
    c->target = cycle;
    if (cycle > c->avr->cycle)
        avr_cycle_timer_register(c->avr, cycle - c->avr->cycle, arrive, c);
    while (c->avr->cycle < cycle) {
        int state = avr_run(c->avr);
        if (state == cpu_Done || state == cpu_Crashed)
            return -1;
    }
    return 0;
}

/* What the next sum of 16 conversions and the next of the bandgap give. */
void chip_convert(struct chip *c, uint16_t sum, uint32_t supply_mv)
{
    c->given_sum = sum;
    c->supply_mv = supply_mv;
}

/* Send bytes to the chip, one each byte time. */
void chip_receive(struct chip *c, const uint8_t *bytes, int size)
{
    for (int n = 0; n < size; n++)
        put(&c->received, bytes[n]);
    if (size && !avr_cycle_timer_status(c->avr, feed, c))
        avr_cycle_timer_register(c->avr, BYTE_CYCLES, feed, c);
}

/* Take what the chip has sent; the number of bytes. */
int chip_sent(struct chip *c, uint8_t *bytes, int room)
{
    int n = 0;
    while (n < room && c->sent.in != c->sent.out)
        bytes[n++] = c->sent.bytes[c->sent.out++ % QUEUE];
    return n;
}

/* Pins of port 0 (B) to 2 (D) that are driven high: bits of PORT, before which DDR lies. */
uint8_t chip_high(const struct chip *c, int port)
{
    const uint8_t *port_register = c->avr->data + PORTB + PORT_REGISTERS * port;
    return port_register[0] & port_register[-1];
}

/* Reset now, with these flags in MCUSR: 2 external, 4 brown-out. */
void chip_reset(struct chip *c, uint8_t flags)
{
    avr_reset(c->avr);
    c->avr->data[MCUSR] = flags;
}

void chip_free(struct chip *c)
{
    avr_terminate(c->avr);
    free(c->avr);
    free(c);
}

uint64_t chip_cycle(const struct chip *c) { return c->avr->cycle; }
uint32_t chip_sums(const struct chip *c) { return c->sensor_count / CONVERSIONS; }
uint32_t chip_longest(const struct chip *c) { return c->longest; }
uint32_t chip_overruns(const struct chip *c) { return c->overruns; }
uint32_t chip_resets(const struct chip *c) { return c->resets; }

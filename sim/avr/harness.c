/* ATmega328P in simavr, run to exact cycles.
 *
 * emulator.py compiles this file once and calls the functions whose names start with chip_. All times are times of the
 * chip: no function waits in real time. */
#include <stdlib.h>

#include <simavr/sim_elf.h>
#include <simavr/sim_hex.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_watchdog.h>

#include "wiring.h"

#define CLOCK_HZ 16000000
enum { MCUSR = 0x54, PORTB = 0x25, PORT_REGISTERS = 3 };

/* Callback that does nothing. A cycle timer with this callback stops the run at the cycle of the timer. */
static avr_cycle_count_t stop_here(avr_t *avr, avr_cycle_count_t when, void *param)
{
    return 0;
}

static void skip_sleep(avr_t *avr, avr_cycle_count_t cycles) {}

static void discard_log(avr_t *avr, const int level, const char *format, va_list arguments)
{
}

/* Called after any reset: simavr has removed all cycle timers, and the bytes on the line are lost. */
static void on_reset(avr_io_t *io)
{
    struct chip *c = (struct chip *)io;
    c->received.out = c->received.in;
    c->sensor_count = c->bandgap_count = 0;
    c->sum_done = 0;
    c->resets++;
    if (c->target > c->avr->cycle)
        avr_cycle_timer_register(c->avr, c->target - c->avr->cycle, stop_here, c);
}

static int on_ioctl(avr_io_t *io, uint32_t request, void *param)
{
    struct chip *c = (struct chip *)io;
    if (request == AVR_IOCTL_WATCHDOG_RESET && c->sum_done && c->avr->cycle >= c->sum_done) {
        uint64_t took = c->avr->cycle - c->sum_done;
        c->longest = took > c->longest ? took : c->longest;
        c->sum_done = 0;
    }
    return -1; /* so that simavr passes the request on to the watchdog */
}

/* Read an ELF or .hex file. Return 0, or -1 if the file contains no program. */
static int read_program(const char *path, elf_firmware_t *firmware)
{
    const char *suffix = strrchr(path, '.');
    if (!suffix || strcmp(suffix, ".hex"))
        return elf_read_firmware(path, firmware);
    firmware->flash = read_ihex_file(path, &firmware->flashsize, &firmware->flashbase);
    return firmware->flash ? 0 : -1;
}

/* Return a chip that was just switched on, or NULL if the file contains no program. */
struct chip *chip_new(const char *program, uint8_t *eeprom, uint32_t size)
{
    elf_firmware_t firmware = {0};
    avr_global_logger_set(discard_log);
    struct chip *c = calloc(1, sizeof *c);
    if (!c || !(c->avr = avr_make_mcu_by_name("atmega328p")) || read_program(program, &firmware)) {
        free(c);
        return NULL;
    }
    avr_init(c->avr);
    c->avr->frequency = CLOCK_HZ;
    firmware.frequency = CLOCK_HZ;
    avr_load_firmware(c->avr, &firmware);
    free(firmware.flash);
    c->avr->sleep = skip_sleep;
    avr_eeprom_desc_t preset = {.ee = eeprom, .offset = 0, .size = size};
    avr_ioctl(c->avr, AVR_IOCTL_EEPROM_SET, &preset);
    c->io = (avr_io_t){.kind = "harness", .reset = on_reset, .ioctl = on_ioctl};
    avr_register_io(c->avr, &c->io);
    connect_wiring(c);
    return c;
}

/* Run to a cycle, counted from power-on. Return 0, or -1 if the program has crashed. */
int chip_run(struct chip *c, uint64_t cycle)
{
    c->target = cycle;
    if (cycle > c->avr->cycle)
        avr_cycle_timer_register(c->avr, cycle - c->avr->cycle, stop_here, c);
    while (c->avr->cycle < cycle) {
        int state = avr_run(c->avr);
        if (state == cpu_Done || state == cpu_Crashed)
            return -1;
    }
    return 0;
}

/* Set the result of the next sum of 16 sensor conversions, and the supply voltage. */
void chip_set_inputs(struct chip *c, uint16_t sum, uint32_t supply_mv)
{
    c->next_sum = sum;
    c->supply_mv = supply_mv;
}

/* Send bytes to the chip at the bit rate of the line. */
void chip_receive(struct chip *c, const uint8_t *bytes, int size)
{
    for (int n = 0; n < size; n++)
        queue_push(&c->received, bytes[n]);
    if (size && !avr_cycle_timer_status(c->avr, send_next_byte, c))
        avr_cycle_timer_register(c->avr, BYTE_CYCLES, send_next_byte, c);
}

/* Read the bytes that the chip has sent. Return their number. */
int chip_sent(struct chip *c, uint8_t *bytes, int size)
{
    int n = 0;
    while (n < size && c->sent.in != c->sent.out)
        bytes[n++] = c->sent.bytes[c->sent.out++ % QUEUE];
    return n;
}

/* Return the mask of the pins that are driven high. Port 0 is B, port 2 is D. A pin is driven high if its bit is set in
 * PORT and in DDR. DDR is the register before PORT. */
uint8_t chip_high(const struct chip *c, int port)
{
    const uint8_t *port_register = c->avr->data + PORTB + PORT_REGISTERS * port;
    return port_register[0] & port_register[-1];
}

/* Reset the chip now, with these flags in MCUSR. */
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

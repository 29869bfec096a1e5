/* Sketch of the board on an Arduino UNO. Only this file uses the registers of the ATmega328P.
 *
 * Timer 1 starts a sample every 2 ms: 16 conversions of the sensor, then one conversion of the bandgap, which gives
 * the supply voltage. The main loop passes each sample to `board_step`. Only the main loop resets the watchdog timer.
 * On shutdown: any reset makes the pins inputs, and `setup` drives SAFE before anything else. If the main loop hangs,
 * the watchdog interrupt drives SAFE, and the second watchdog time-out resets the chip. If the main loop is late for
 * a sample, it drives SAFE itself, because the board measures all times in samples. */
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/wdt.h>

#include "board.h"
#include "hardware.h"

#define CYCLES_PER_SAMPLE (F_CPU / SAMPLES_PER_S)
#define SAMPLE_US (1000ul * SAMPLE_MS)
/* The sensor conversions end at 1.80 ms. The bandgap has a high impedance and must settle on the multiplexer. */
#define BANDGAP_AT_CYCLES (CYCLES_PER_SAMPLE / 100 * 93)
#define AVCC_REFERENCE (1u << REFS0)
#define CONVERSION_STEPS 1024ul

/* Mark of a watchdog reset in RAM, because a bootloader may clear MCUSR. Set by `halt_safe`. */
#define WATCHDOG_MARK 0x52A5C33Cul
static uint8_t reset_flags __attribute__((section(".noinit")));
static uint32_t restart_mark __attribute__((section(".noinit")));

static struct board board;
static uint16_t bandgap_mv;

/* Written by interrupt handlers. */
static volatile uint32_t time_us;
static volatile uint16_t sum, sampled_sum;
static volatile uint16_t bandgap_conversion = CONVERSION_STEPS - 1;
static volatile uint8_t converted;
static volatile bool converting_bandgap, sampled;

/* Ring buffers, indexed by the low bits of counters. RX has room for the bytes that arrive in one sample. The main
 * loop processes at most one frame per sample, so that random bytes at the full rate of the line delay no sample. */
#define RX_BYTES 128u
#define MAX_RECEIVED_PER_SAMPLE FRAME_BYTES
static volatile uint8_t rx[RX_BYTES], tx[256];
static volatile uint8_t rx_in, rx_out, tx_in, tx_out;

void keep_reset_flags(void) __attribute__((naked, used, section(".init3")));
/* Save the reset flags and disable the watchdog before any C code runs. After a watchdog reset, the watchdog still
 * runs with its shortest time-out. */
void keep_reset_flags(void)
{
    reset_flags = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

/* Drive the valves. No other code drives their pins. */
static void drive(uint8_t valves)
{
    uint8_t pins = PORTD & (uint8_t)~(1u << INLET_BIT | 1u << VENT_BIT);

    if (valves & VALVE_INLET_OPEN)
        pins |= 1u << INLET_BIT;
    if (valves & VALVE_VENT_CLOSED)
        pins |= 1u << VENT_BIT;
    PORTD = pins;
}

/* Drive SAFE and open the output contact "instrument OK". */
static void drive_safe(void)
{
    drive(SAFE);
    DDRD |= 1u << INLET_BIT | 1u << VENT_BIT;
    PORTB &= (uint8_t)~(1u << OK_BIT);
}

/* Drive SAFE immediately and wait for the next watchdog time-out, which resets the chip. */
static void halt_safe(void)
{
    cli();
    drive_safe();
    restart_mark = WATCHDOG_MARK;
    WDTCSR &= (uint8_t)~(1u << WDIE);
    for (;;)
        ;
}

/* Set the LED and the output contact "instrument OK". */
static void set_indicators(void)
{
    uint8_t pins = PORTB & (uint8_t)~(1u << OK_BIT | 1u << LED_BIT);

    if (board_ok(&board))
        pins |= 1u << OK_BIT;
    if (board.pressure.status.state != STATE_VENTED)
        pins |= 1u << LED_BIT;
    PORTB = pins;
}

/* Return true if the watchdog or a brown-out has restarted the board. Power-on is excluded first, because a rising
 * supply sets the brown-out flag too. */
static bool was_unexpected_reset(void)
{
    bool power_on = (reset_flags & 1u << PORF) != 0;
    bool marked = restart_mark == WATCHDOG_MARK;

    restart_mark = 0;
    return !power_on && (marked || (reset_flags & (1u << WDRF | 1u << BORF)) != 0);
}

/* Size of the program in the flash, with the initial values of its variables: the address of this symbol of the linker.
 * Any remains of an earlier program begin there. */
extern const uint8_t __data_load_end[];
#define CRC32_POLYNOMIAL 0xEDB88320ul /* IEEE 802.3, bits reversed */

/* Return the CRC-32 of the program in the flash. This takes 0.11 s, so it runs once, before the samples
 * and the watchdog start. */
static uint32_t image_crc(void)
{
    uint32_t crc = UINT32_MAX;
    uint16_t address;
    uint8_t n;

    for (address = 0; address < (uint16_t)__data_load_end; address++) {
        crc ^= pgm_read_byte(address);
        for (n = 0; n < 8; n++)
            crc = crc & 1 ? crc >> 1 ^ CRC32_POLYNOMIAL : crc >> 1;
    }
    return ~crc;
}

static void init_board(void)
{
    uint8_t kind = eeprom_read_byte((const uint8_t *)EEPROM_KIND);

    bandgap_mv = eeprom_read_word((const uint16_t *)EEPROM_BANDGAP_MV);
    if (!(MIN_BANDGAP_MV <= bandgap_mv && bandgap_mv <= MAX_BANDGAP_MV))
        bandgap_mv = NOMINAL_BANDGAP_MV;
    board_init(&board, kind == UINT8_MAX ? (uint8_t)BOARD_REAL : kind,
               eeprom_read_dword((const uint32_t *)EEPROM_SERIAL), image_crc(), was_unexpected_reset());
}

static void init_uart(void)
{
    UBRR0 = F_CPU / 8 / BAUD - 1;
    UCSR0A = 1u << U2X0;
    UCSR0C = 1u << UCSZ01 | 1u << UCSZ00;
    UCSR0B = 1u << RXEN0 | 1u << TXEN0 | 1u << RXCIE0;
}

/* Start the ADC and timer 1. The timer starts last and without old flags: an early interrupt would add 2 ms to the board
 * time before the first sample, which `loop` takes for a late sample. */
static void start_sampling(void)
{
    ADMUX = AVCC_REFERENCE | BANDGAP_CHANNEL;
    ADCSRB = 0;
    ADCSRA = 1u << ADEN | 1u << ADIE | 1u << ADPS2 | 1u << ADPS1 | 1u << ADPS0; /* 125 kHz */
    converting_bandgap = true; /* the first sample then has a supply voltage */
    ADCSRA |= 1u << ADSC;
    TCCR1A = 0;
    TCCR1B = 0;
    TCNT1 = 0;
    OCR1A = CYCLES_PER_SAMPLE - 1;
    OCR1B = BANDGAP_AT_CYCLES;
    TIFR1 = 1u << OCF1A | 1u << OCF1B;
    TIMSK1 = 1u << OCIE1A | 1u << OCIE1B;
    TCCR1B = 1u << WGM12 | 1u << CS10;
}

/* Start the watchdog: interrupt after 32 ms, reset after another 32 ms. WDTCSR can be changed only within four cycles
 * after WDCE is set. */
static void start_watchdog(void)
{
    wdt_reset();
    WDTCSR = 1u << WDCE | 1u << WDE;
    WDTCSR = 1u << WDIE | 1u << WDE | 1u << WDP0;
}

void setup(void)
{
    cli();
    drive_safe();
    DDRB |= 1u << OK_BIT | 1u << LED_BIT;
    TIMSK0 = 0; /* disable the clock of the Arduino core: it is unused, and its interrupts take time */
    init_board();
    init_uart();
    start_sampling();
    start_watchdog();
    sei();
}

static void transmit(const uint8_t *frame)
{
    uint8_t n, in = tx_in;

    if ((uint8_t)(tx_out - in - 1u) < FRAME_BYTES)
        return;
    for (n = 0; n < FRAME_BYTES; n++)
        tx[in++] = frame[n];
    tx_in = in;
    UCSR0B |= 1u << UDRIE0;
}

/* Return the supply voltage. The bandgap is converted with the supply as reference. Half a count is added because the
 * converter truncates. */
static uint16_t supply_mv_of(uint16_t conversion)
{
    uint32_t supply_mv = 2 * CONVERSION_STEPS * bandgap_mv / (2ul * conversion + 1);

    return supply_mv < UINT16_MAX ? (uint16_t)supply_mv : UINT16_MAX;
}

void loop(void)
{
    uint32_t now_us;
    uint16_t adc_sum, conversion;
    uint8_t n;

    if (!sampled)
        return;
    cli();
    sampled = false;
    now_us = time_us;
    adc_sum = sampled_sum;
    conversion = bandgap_conversion;
    sei();
    if (now_us - board.time_us != SAMPLE_US)
        halt_safe();
    board_start_sample(&board, now_us);
    for (n = 0; n < MAX_RECEIVED_PER_SAMPLE && rx_out != rx_in; n++, rx_out++)
        board_receive(&board, rx[rx_out % RX_BYTES]);
    drive(board_step(&board, adc_sum, supply_mv_of(conversion)));
    set_indicators();
    for (n = 0; n < board.out_bytes; n += FRAME_BYTES)
        transmit(board.out + n);
    wdt_reset();
}

ISR(TIMER1_COMPA_vect)
{
    time_us += SAMPLE_US;
    sum = 0;
    converted = 0;
    ADMUX = AVCC_REFERENCE | SENSOR_CHANNEL;
    ADCSRA |= 1u << ADSC;
}

ISR(TIMER1_COMPB_vect)
{
    if (converted < OVERSAMPLING)
        return;
    converting_bandgap = true;
    ADCSRA |= 1u << ADSC;
}

ISR(ADC_vect)
{
    if (converting_bandgap) {
        converting_bandgap = false;
        bandgap_conversion = ADC;
        return;
    }
    sum += ADC;
    if (++converted < OVERSAMPLING) {
        ADCSRA |= 1u << ADSC;
        return;
    }
    ADMUX = AVCC_REFERENCE | BANDGAP_CHANNEL;
    sampled_sum = sum;
    sampled = true;
}

ISR(USART_RX_vect)
{
    uint8_t byte = UDR0;

    if ((uint8_t)(rx_in - rx_out) < RX_BYTES)
        rx[rx_in++ % RX_BYTES] = byte;
}

ISR(USART_UDRE_vect)
{
    if (tx_out == tx_in)
        UCSR0B &= (uint8_t)~(1u << UDRIE0);
    else
        UDR0 = tx[tx_out++];
}

/* Drive SAFE if the main loop hangs. */
ISR(WDT_vect)
{
    halt_safe();
}

#ifndef ARDUINO
/* Main function for a build without the Arduino core. */
int main(void)
{
    setup();
    for (;;)
        loop();
}
#endif

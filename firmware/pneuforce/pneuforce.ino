/* The rig's board on an Arduino UNO: the only file that knows the ATmega328P's registers.
 *
 * Timer 1 begins a sample every 2 ms: 16 conversions of the sensor, then one of the bandgap, by which the supply
 * is known. The main loop takes each sample through `board_step` and alone keeps the watchdog quiet.
 * On shutdown: any reset makes the pins inputs, and then `setup` drives SAFE before all else. A hung main
 * loop is made SAFE by the watchdog's interrupt and reset by its second time-out; one that is late for a sample
 * makes itself so, for what the board counts in samples would no longer be time. */
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "board.h"
#include "hardware.h"

#define CYCLES_PER_SAMPLE (F_CPU / SAMPLES_PER_S)
#define SAMPLE_US (1000ul * SAMPLE_MS)
/* Sensor conversions end at 1.80 ms. The bandgap is of high impedance and wants time on the multiplexer. */
#define BANDGAP_AT_CYCLES (CYCLES_PER_SAMPLE / 100 * 93)
#define AVCC_REFERENCE (1u << REFS0)
#define CONVERSION_STEPS 1024ul

/* An unasked reset. A bootloader may clear MCUSR, so the watchdog's interrupt leaves a mark in RAM too. */
#define RESTARTED 0x52A5C33Cul
static uint8_t reset_flags __attribute__((section(".noinit")));
static uint32_t restart_mark __attribute__((section(".noinit")));

static struct board board;
static uint16_t bandgap_mv;

/* Written by interrupts. */
static volatile uint32_t time_us;
static volatile uint16_t sum, sampled_sum;
static volatile uint16_t bandgap_conversion = CONVERSION_STEPS - 1;
static volatile uint8_t converted;
static volatile bool converting_bandgap, sampled;

/* Rings whose places are the low bits of counters. RX holds what the line can bring in a sample; of it one frame
 * is heard in each, so that nonsense at the full rate of the line cannot delay a sample. */
#define RX_BYTES 128u
#define MOST_HEARD FRAME_BYTES
static volatile uint8_t rx[RX_BYTES], tx[256];
static volatile uint8_t rx_in, rx_out, tx_in, tx_out;

void keep_reset_flags(void) __attribute__((naked, used, section(".init3")));
/* Before any C: a watchdog that has reset the chip is still running, with the shortest time. */
void keep_reset_flags(void)
{
    reset_flags = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

/* The only place where the valves' pins are driven. */
static void drive(uint8_t valves)
{
    uint8_t pins = PORTD & (uint8_t)~(1u << INLET_BIT | 1u << VENT_BIT);

    if (valves & VALVE_INLET_OPEN)
        pins |= 1u << INLET_BIT;
    if (valves & VALVE_VENT_CLOSED)
        pins |= 1u << VENT_BIT;
    PORTD = pins;
}

/* Nor may others think that the rig can be used. */
static void all_vent(void)
{
    drive(SAFE);
    DDRD |= 1u << INLET_BIT | 1u << VENT_BIT;
    PORTB &= (uint8_t)~(1u << OK_BIT);
}

/* SAFE at once; the watchdog's next time-out resets. */
static void give_up(void)
{
    cli();
    all_vent();
    restart_mark = RESTARTED;
    WDTCSR &= (uint8_t)~(1u << WDIE);
    for (;;)
        ;
}

/* What the eye and a PLC's input see of the board. */
static void show(void)
{
    uint8_t pins = PORTB & (uint8_t)~(1u << OK_BIT | 1u << LED_BIT);

    if (board_ok(&board))
        pins |= 1u << OK_BIT;
    if (board.pressure.now.state != STATE_VENTED)
        pins |= 1u << LED_BIT;
    PORTB = pins;
}

/* Whether watchdog or brown-out restarted the board. A rising supply looks like a brown-out too. */
static bool unasked_reset(void)
{
    bool power_on = (reset_flags & 1u << PORF) != 0;
    bool marked = restart_mark == RESTARTED;

    restart_mark = 0;
    return !power_on && (marked || (reset_flags & (1u << WDRF | 1u << BORF)) != 0);
}

static void begin_board(void)
{
    uint8_t kind = eeprom_read_byte((const uint8_t *)EEPROM_KIND);

    bandgap_mv = eeprom_read_word((const uint16_t *)EEPROM_BANDGAP_MV);
    if (!(BANDGAP_LEAST_MV <= bandgap_mv && bandgap_mv <= BANDGAP_MOST_MV))
        bandgap_mv = BANDGAP_NOMINAL_MV;
    board_begin(&board, kind == UINT8_MAX ? (uint8_t)BOARD_REAL : kind,
                eeprom_read_dword((const uint32_t *)EEPROM_SERIAL), unasked_reset());
}

static void begin_line(void)
{
    UBRR0 = F_CPU / 8 / BAUD - 1;
    UCSR0A = 1u << U2X0;
    UCSR0C = 1u << UCSZ01 | 1u << UCSZ00;
    UCSR0B = 1u << RXEN0 | 1u << TXEN0 | 1u << RXCIE0;
}

static void begin_sampling(void)
{
    ADMUX = AVCC_REFERENCE | BANDGAP_CHANNEL;
    ADCSRB = 0;
    ADCSRA = 1u << ADEN | 1u << ADIE | 1u << ADPS2 | 1u << ADPS1 | 1u << ADPS0; /* 125 kHz */
    converting_bandgap = true; /* the first sample knows the supply too */
    ADCSRA |= 1u << ADSC;
    TCCR1A = 0;
    TCCR1B = 1u << WGM12 | 1u << CS10;
    TCNT1 = 0;
    OCR1A = CYCLES_PER_SAMPLE - 1;
    OCR1B = BANDGAP_AT_CYCLES;
    TIMSK1 = 1u << OCIE1A | 1u << OCIE1B;
}

/* 32 ms to an interrupt, 32 more to a reset. The register opens for four cycles. */
static void begin_watchdog(void)
{
    wdt_reset();
    WDTCSR = 1u << WDCE | 1u << WDE;
    WDTCSR = 1u << WDIE | 1u << WDE | 1u << WDP0;
}

void setup(void)
{
    cli();
    all_vent();
    DDRB |= 1u << OK_BIT | 1u << LED_BIT;
    TIMSK0 = 0; /* the Arduino core's clock: nothing here uses it, and it would cost cycles */
    begin_board();
    begin_line();
    begin_sampling();
    begin_watchdog();
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

/* By the bandgap, which is converted in units of the supply; half a step undoes truncation. */
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
        give_up();
    board_tick(&board, now_us);
    for (n = 0; n < MOST_HEARD && rx_out != rx_in; n++, rx_out++)
        board_hear(&board, rx[rx_out % RX_BYTES]);
    drive(board_step(&board, adc_sum, supply_mv_of(conversion)));
    show();
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

/* The main loop hangs. */
ISR(WDT_vect)
{
    give_up();
}

#ifndef ARDUINO
/* What the Arduino core does, for a build without it. */
int main(void)
{
    setup();
    for (;;)
        loop();
}
#endif

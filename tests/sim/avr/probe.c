/* Test program that reports the inputs of the chip. It sends 5 bytes at boot (MCUSR, EEPROM bytes 0 to 3) and 4 bytes
 * after each sum of 16 conversions (sum, bandgap). It sends received bytes back, and hangs after an 'h'. D4 is high
 * after an odd sum, D7 after any sum. */
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#define SENSOR_MUX 0x40
#define BANDGAP_MUX 0x4E

static volatile uint8_t n;
static volatile uint16_t sum, bandgap, complete_sum;

ISR(TIMER1_COMPA_vect)
{
    if (n < 17)
        ADCSRA |= 1 << ADSC;
}

ISR(ADC_vect)
{
    if (n < 16)
        sum += ADC;
    else
        bandgap = ADC;
    if (++n == 16)
        ADMUX = BANDGAP_MUX;
    if (n == 17) {
        complete_sum = sum;
        sum = 0;
        ADMUX = SENSOR_MUX;
    }
}

static void send(uint8_t byte)
{
    while (!(UCSR0A & 1 << UDRE0))
        ;
    UDR0 = byte;
}

static void send_word(uint16_t word)
{
    send(word & 0xFF);
    send(word >> 8);
}

static void boot(void)
{
    uint8_t cause = MCUSR;
    MCUSR = 0;
    wdt_enable(WDTO_30MS);
    DDRD = 1 << 4 | 1 << 7;
    UCSR0A = 1 << U2X0;
    UCSR0B = 1 << RXEN0 | 1 << TXEN0;
    UBRR0 = 3;
    send(cause);
    for (uintptr_t at = 0; at < 4; at++)
        send(eeprom_read_byte((uint8_t *)at));
    ADMUX = SENSOR_MUX;
    ADCSRA = 1 << ADEN | 1 << ADIE | 7;
    TCCR1B = 1 << WGM12 | 1 << CS10;
    OCR1A = 1776 - 1; /* 18 times in 2 ms, for 17 conversions; the rest is idle */
    TIMSK1 = 1 << OCIE1A;
    sei();
}

int main(void)
{
    boot();
    for (;;) {
        if (UCSR0A & 1 << RXC0) {
            uint8_t byte = UDR0;
            while (byte == 'h')
                ;
            send(byte);
        }
        if (n == 17) {
            n = 0;
            PORTD = 1 << 7 | (complete_sum & 1) << 4;
            send_word(complete_sum);
            send_word(bandgap);
            wdt_reset();
        }
    }
}

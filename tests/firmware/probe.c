/*
 * Firmware without Arduino's libraries: its TWI, serial port and INT0 by the registers of the ATmega328P and ATmega2560
 * (datasheets DS40002061 and DS40002211). What it does is chosen when it is compiled: one of the DO_ macros below.
 */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdint.h>
#include <stdlib.h>
#include <util/delay.h>

#define SENSOR 0x69

static inline void put(char byte)
{
    while (!(UCSR0A & 1 << UDRE0))
        ;
    UCSR0A |= 1 << TXC0;
    UDR0 = byte;
}

static inline void say(const char *text)
{
    while (*text)
        put(*text++);
}

static inline void say_hex(uint16_t word)
{
    for (int8_t shift = 12; shift >= 0; shift -= 4)
        put("0123456789abcdef"[word >> shift & 0xF]);
}

static inline void flush(void)
{
    while (!(UCSR0A & 1 << TXC0))
        ;
}

/* One step of the TWI; returns its status. */
static inline uint8_t twi(uint8_t control)
{
    TWCR = 1 << TWINT | 1 << TWEN | control;
    while (!(TWCR & 1 << TWINT))
        ;
    return TWSR & 0xF8;
}

static inline uint8_t twi_send(uint8_t byte)
{
    TWDR = byte;
    return twi(0);
}

static inline void twi_stop(void)
{
    TWCR = 1 << TWINT | 1 << TWEN | 1 << TWSTO;
    while (TWCR & 1 << TWSTO)
        ;
}

/* Reads within one transaction; returns the status of the address if nobody is there. */
static inline uint8_t read(uint8_t address, uint8_t first, uint8_t *bytes, uint8_t count)
{
    twi(1 << TWSTA);
    uint8_t status = twi_send(address << 1);
    if (status == 0x18) {
        status = twi_send(first);
        twi(1 << TWSTA);
        twi_send(address << 1 | 1);
        for (; count > 0; count--) {
            twi(count > 1 ? 1 << TWEA : 0);
            *bytes++ = TWDR;
        }
    }
    twi_stop();
    return status;
}

static inline void write(uint8_t first, uint8_t value)
{
    twi(1 << TWSTA);
    twi_send(SENSOR << 1);
    twi_send(first);
    twi_send(value);
    twi_stop();
}

static inline uint16_t word(uint8_t first)
{
    uint8_t bytes[2] = {0};
    read(SENSOR, first, bytes, 2);
    return bytes[0] | bytes[1] << 8;
}

#if defined DO_READ
/* A thermistor, a whole frame, and an address where nobody is. */
static void act(void)
{
    static uint8_t pixels[128];
    say_hex(word(0x0E));
    put('\n');
    read(SENSOR, 0x80, pixels, sizeof pixels);
    for (uint8_t at = 0; at < sizeof pixels; at += 2) {
        say_hex(pixels[at] | pixels[at + 1] << 8);
        put(at == 126 ? '\n' : ' ');
    }
    say_hex(read(0x20, 0, pixels, 1));
    say("\nread all");
    put('\n');
}
#elif defined DO_ECHO
/* Gives back what it is sent, and ends with its length. */
static void act(void)
{
    uint8_t count = 0;
    for (char byte = 0; byte != '\n'; count++) {
        while (!(UCSR0A & 1 << RXC0))
            ;
        byte = UDR0;
        put(byte);
    }
    flush();
    exit(count);
}
#elif defined DO_INT
/* Sleeps until INT0 (PD2) falls, and tells which pixels are above 30 degrees Celsius. */
ISR(INT0_vect)
{
}

static void act(void)
{
    write(0x08, 120); /* INTHL: 30 degrees Celsius */
    write(0x09, 0);
    write(0x0A, 0xC0); /* INTLL: -16 degrees Celsius */
    write(0x0B, 0x0F);
    write(0x03, 0x03); /* absolute values, INT on */
    EICRA = 1 << ISC01;
    EIFR = 1 << INTF0;
    EIMSK = 1 << INT0;
    sei();
    set_sleep_mode(SLEEP_MODE_IDLE);
    sleep_mode();
    uint8_t rows[8];
    read(SENSOR, 0x10, rows, sizeof rows);
    say("interrupt ");
    for (uint8_t row = 0; row < sizeof rows; row += 2)
        say_hex(rows[row] << 8 | rows[row + 1]);
    put('\n');
    flush();
    exit(0);
}
#elif defined DO_NOTHING
/* Never reads. */
static void act(void)
{
    say("idle\n");
    for (;;)
        _delay_ms(10);
}
#elif defined DO_CRASH
/* Runs out of its code. */
static void act(void)
{
    ((void (*)(void))0x3F00)();
}
#elif defined DO_TIME
/* Reads the frame's first pixel every 100 ms of its own clock. */
static void act(void)
{
    for (uint8_t at = 0; at < 30; at++) {
        say_hex(word(0x80));
        put('\n');
        _delay_ms(100);
    }
    flush();
    exit(0);
}
#endif

int main(void)
{
    UBRR0 = F_CPU / 16 / 250000 - 1;
    UCSR0B = 1 << TXEN0 | 1 << RXEN0;
    TWBR = (F_CPU / 400000 - 16) / 2;
    for (;;)
        act();
}

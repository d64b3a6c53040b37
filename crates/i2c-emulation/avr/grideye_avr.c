/*
 * An AVR microcontroller whose TWI is a bus of the emulated machine: runs a firmware file in libsimavr, cycle by cycle, as a
 * client of the socket (../src/socket/PROTOCOL.md). Both share one clock: the firmware's cycles move the machine's time.
 *
 *     cc -O2 -o grideye_avr grideye_avr.c -lsimavr
 *     grideye_avr SOCKET FIRMWARE MCU HZ BUS SECONDS SPEED UNTIL [INT_PIN ...]
 *
 * SECONDS 0: without end. SPEED 0: as fast as it can, else emulated seconds per second. UNTIL "": no text ends it. The n-th
 * INT_PIN, such as PD2 or "-", is the port pin of the n-th sensor's INT.
 *
 * USART0 is standard input and output. It ends with the firmware's exit code, with 0 once UNTIL was printed or the time is
 * over, with 124 if the time is over before UNTIL was printed, and with 2 if it cannot run.
 *
 * The variable GRIDEYE_QUIET leaves out the last line, which says how fast it ran.
 *
 * `grideye emulate -- sketch.elf` compiles and starts it. simavr is GPL 3; this file is not part of it and holds nothing of it.
 */
#define _GNU_SOURCE
#include <errno.h>
#include <poll.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <simavr/avr_ioport.h>
#include <simavr/avr_twi.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_hex.h>
#include <simavr/sim_time.h>

enum { HELLO = 1, STEP = 4, STOP = 5, PASS = 6, WELCOME = 0x81, DONE = 0x82, FAULT = 0x83, PASSED = 0x86 };
enum { READ_FLAG = 1, PINS_MAX = 32, ANSWER_BYTES_MAX = 4096, UNTIL_BYTES_MAX = 256 };
enum { CODE_UNUSABLE = 2, CODE_TIME_OVER = 124 };
#define PASS_MAX_NS 1000000000ull
/* How often the serial input and the INT pins are looked at, in microseconds of the firmware. */
#define LOOK_EVERY_US 500
/* `rjmp .-2`: where avr-libc's exit() stays, with interrupts off. */
#define STOPPED_OPCODE 0xCFFF

static avr_t *avr;
static int server = -1;
static uint32_t bus;

static avr_twi_t *twi;
static avr_irq_t *twi_in;
static int byte_has_begun;
static int open_address = -1; /* the 8 bits of the address byte, while a transaction is open */
static unsigned long long transactions, refused;

static avr_irq_t *uart_in;
/* Nothing is taken before the firmware switches its receiver on. */
static int input_is_full = 1, input_has_ended;

static avr_irq_t *pins[PINS_MAX];
static int pin_count;

static const char *until;
static char printed[UNTIL_BYTES_MAX];
static size_t matched_bytes;
static int is_found;

static void fail(const char *problem, const char *hint)
{
    fflush(stdout);
    fprintf(stderr, "error: %s\nhint: %s\n", problem, hint);
    exit(CODE_UNUSABLE);
}

/* ---- the socket ---- */

static uint8_t *put(uint8_t *to, uint64_t value, int bytes)
{
    for (int at = 0; at < bytes; at++)
        *to++ = (uint8_t)(value >> (8 * at));
    return to;
}

static uint64_t number(const uint8_t *from, int bytes)
{
    uint64_t value = 0;
    for (int at = bytes; at-- > 0;)
        value = value << 8 | from[at];
    return value;
}

static void transfer(void *bytes, size_t count, int sends)
{
    for (uint8_t *at = bytes; count > 0;) {
        ssize_t done = sends ? send(server, at, count, MSG_NOSIGNAL) : recv(server, at, count, 0);
        if (done < 0 && errno == EINTR)
            continue;
        if (done <= 0)
            fail("the emulator has ended", "see what it printed");
        at += done;
        count -= (size_t)done;
    }
}

/* Sends a request and returns its answer's length after the kind, which answer[0] is. */
static size_t ask(uint8_t kind, const uint8_t *body, size_t length, uint8_t answer[ANSWER_BYTES_MAX])
{
    uint8_t packet[64];
    memcpy(put(put(packet, 1 + length, 4), kind, 1), body, length);
    transfer(packet, 5 + length, 1);
    transfer(packet, 4, 0);
    size_t bytes = number(packet, 4);
    if (bytes < 1 || bytes > ANSWER_BYTES_MAX)
        fail("the answer of the emulator is not one", "start it with `grideye emulate`");
    transfer(answer, bytes, 0);
    return bytes - 1;
}

static void connect_to(const char *path)
{
    struct sockaddr_un place = {.sun_family = AF_UNIX};
    uint8_t answer[ANSWER_BYTES_MAX];
    if (strlen(path) >= sizeof place.sun_path)
        fail("the path of the socket is too long", "give one of at most 107 bytes");
    strcpy(place.sun_path, path);
    server = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (server < 0 || connect(server, (struct sockaddr *)&place, sizeof place) < 0)
        fail("nobody serves the socket", "start `grideye emulate --socket PATH` first");
    ask(HELLO, (const uint8_t *)"i2ce\1", 6, answer);
    if (answer[0] != WELCOME)
        fail("the emulator speaks another version of the protocol", "use the file that came with it");
}

/* Brings the machine's time to the firmware's, and its INT pins to the port. */
static void meet(void)
{
    static uint64_t start_ns = UINT64_MAX, machine_ns;
    uint64_t firmware_ns = avr_cycles_to_nsec(avr, avr->cycle);
    uint8_t body[11], answer[ANSWER_BYTES_MAX];
    int is_first = start_ns == UINT64_MAX;
    do {
        /* A fault that holds the bus moves the machine ahead; the firmware catches up. */
        uint64_t due = start_ns + firmware_ns;
        uint64_t most = is_first || due <= machine_ns ? 0 : due - machine_ns;
        most = most > PASS_MAX_NS ? PASS_MAX_NS : most;
        put(put(put(body, most, 8), UINT16_MAX, 2), 0, 1);
        size_t length = ask(PASS, body, sizeof body, answer);
        if (answer[0] != PASSED || length < 10)
            fail("the emulator's time cannot be moved", "start it with `grideye emulate -- FIRMWARE`, or with --speed 0");
        machine_ns = number(answer + 1, 8);
        if (is_first)
            start_ns = machine_ns - firmware_ns;
        is_first = 0;
    } while (machine_ns < start_ns + firmware_ns);
    for (int pin = 0; pin < pin_count && pin < (int)number(answer + 9, 2); pin++)
        if (pins[pin] && pins[pin]->value != answer[11 + pin])
            avr_raise_irq(pins[pin], answer[11 + pin]);
}

/* ---- TWI ---- */

/* Carries out one step; returns whether it was acknowledged. A byte that was read goes to `data`. */
static int step(int reads, const uint8_t *bytes, int count, uint8_t *data)
{
    uint8_t body[16], answer[ANSWER_BYTES_MAX];
    uint8_t *end = put(put(put(put(body, bus, 4), open_address >> 1, 2), reads ? READ_FLAG : 0, 2), count, 2);
    if (!reads && count)
        end = put(end, *bytes, 1);
    meet();
    size_t length = ask(STEP, body, (size_t)(end - body), answer);
    if (answer[0] == DONE && length == 3 && data)
        *data = answer[3];
    return answer[0] == DONE;
}

static void stop(void)
{
    uint8_t answer[ANSWER_BYTES_MAX];
    if (open_address < 0)
        return;
    meet();
    ask(STOP, NULL, 0, answer);
    open_address = -1;
    meet();
}

static void on_twi(struct avr_irq_t *irq, uint32_t value, void *param)
{
    avr_twi_msg_irq_t message = {.u.v = value};
    uint8_t what = message.u.twi.msg, data = 0xFF;
    (void)irq, (void)param;
    byte_has_begun = !!(what & (TWI_COND_START | TWI_COND_WRITE | TWI_COND_READ));
    if (what & TWI_COND_STOP)
        stop();
    if (what & TWI_COND_START) {
        int address = message.u.twi.addr;
        /* Within a transaction the direction changes, or a read goes on with the one before. */
        int goes_on = open_address == address && address & 1;
        if (open_address >= 0 && !goes_on && (open_address ^ address) != 1)
            stop();
        transactions += open_address < 0;
        open_address = address;
        int answers = goes_on || step(address & 1, NULL, 0, NULL);
        refused += !answers;
        /* simavr 1.6 takes the latch that holds the address for one with data: no time, and the status of data. */
        twi->state &= (uint8_t)~TWI_COND_WRITE;
        avr_raise_irq(twi_in, avr_twi_irq_msg(TWI_COND_ACK, address, answers));
    } else if (what & TWI_COND_WRITE && open_address >= 0) {
        data = message.u.twi.data;
        avr_raise_irq(twi_in, avr_twi_irq_msg(TWI_COND_ACK, open_address, step(0, &data, 1, NULL)));
    } else if (what & TWI_COND_READ && open_address >= 0) {
        step(1, NULL, 1, &data);
        avr_raise_irq(twi_in, avr_twi_irq_msg(TWI_COND_READ, open_address, data));
    }
}

/*
 * Gives the byte that has begun the length that TWBR and TWPS set, and clears TWINT for that long: simavr 1.6 ends each byte after 9
 * microseconds, and leaves TWINT set for firmware that polls it.
 */
static void take_time(void)
{
    byte_has_begun = 0;
    avr_regbit_clear(avr, twi->twi.raised);
    avr_cycle_count_t cycles_per_bit = 16 + 2ull * avr->data[twi->r_twbr] * (1u << 2 * avr_regbit_get(avr, twi->twps));
    for (avr_cycle_timer_slot_p slot = avr->cycle_timers.timer; slot; slot = slot->next)
        if (slot->param == twi) {
            avr_cycle_timer_t timer = slot->timer;
            avr_cycle_timer_cancel(avr, timer, twi);
            avr_cycle_timer_register(avr, 9 * cycles_per_bit, timer, twi);
            return;
        }
}

/* ---- USART0 ---- */

static void on_output(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq, (void)param;
    putchar((int)(value & 0xFF));
    size_t length = strlen(until);
    if (length == 0)
        return;
    if (matched_bytes == length) {
        memmove(printed, printed + 1, length - 1);
        matched_bytes--;
    }
    printed[matched_bytes++] = (char)value;
    is_found |= matched_bytes == length && memcmp(printed, until, length) == 0;
}

static void on_room(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq, (void)value, (void)param;
    input_is_full = 0;
}

static void on_no_room(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq, (void)value, (void)param;
    input_is_full = 1;
}

static void take_input(void)
{
    struct pollfd standard_input = {.fd = 0, .events = POLLIN};
    while (uart_in && !input_is_full && !input_has_ended && poll(&standard_input, 1, 0) > 0) {
        uint8_t byte;
        ssize_t count = read(0, &byte, 1);
        input_has_ended = count <= 0;
        if (count == 1)
            avr_raise_irq(uart_in, byte);
    }
}

/* ---- the microcontroller ---- */

static void say(struct avr_t *of, const int level, const char *format, va_list arguments)
{
    (void)of;
    if (level > LOG_ERROR)
        return;
    fflush(stdout);
    vfprintf(stderr, format, arguments);
}

static void no_sleep(avr_t *of, avr_cycle_count_t cycles)
{
    (void)of, (void)cycles;
}

static int is_elf(const char *path)
{
    char head[4] = "";
    FILE *file = fopen(path, "rb");
    if (!file || fread(head, 1, sizeof head, file) != sizeof head)
        fail("the firmware cannot be read", "check the path");
    fclose(file);
    return memcmp(head, "\177ELF", 4) == 0;
}

static void load(const char *path, uint32_t hz)
{
    const char *too_large = "give the microcontroller it was built for: --mcu";
    if (is_elf(path)) {
        elf_firmware_t firmware = {0};
        if (elf_read_firmware(path, &firmware) != 0)
            fail("the ELF file cannot be read", "link it again with avr-gcc");
        if (firmware.flashbase + firmware.flashsize > avr->flashend + 1)
            fail("the firmware is larger than the flash", too_large);
        firmware.frequency = firmware.frequency ? firmware.frequency : hz;
        avr_load_firmware(avr, &firmware);
        return;
    }
    ihex_chunk_p chunks = NULL;
    int count = read_ihex_chunks(path, &chunks);
    if (count <= 0)
        fail("this is neither an ELF file nor Intel HEX", "give the file that the linker or avr-objcopy -O ihex wrote");
    for (int at = 0; at < count; at++) {
        if (chunks[at].baseaddr + chunks[at].size > avr->flashend + 1)
            fail("the firmware is larger than the flash", too_large);
        avr_loadcode(avr, chunks[at].data, chunks[at].size, chunks[at].baseaddr);
    }
    avr->codeend = avr->flashend;
    avr->frequency = hz;
}

static void wire(int count, char **names)
{
    uint32_t flags = 0;
    for (; pin_count < count && pin_count < PINS_MAX; pin_count++) {
        const char *name = names[pin_count];
        if (strcmp(name, "-") == 0)
            continue;
        avr_irq_t *port = name[0] == 'P' && strlen(name) == 3
            ? avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(name[1]), IOPORT_IRQ_PIN0)
            : NULL;
        if (!port || name[2] < '0' || name[2] > '7')
            fail("the microcontroller has no such pin for INT", "name a port and a bit, such as PD2");
        pins[pin_count] = port + (name[2] - '0');
        avr_raise_irq(pins[pin_count], 1);
    }
    avr_irq_t *twi_irq = avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), 0);
    for (avr_io_t *io = avr->io_port; io; io = io->next)
        if (strcmp(io->kind, "twi") == 0)
            twi = (avr_twi_t *)io;
    if (!twi_irq || !twi)
        fail("the microcontroller has no TWI that simavr knows", "take atmega328p or atmega2560");
    twi_in = twi_irq + TWI_IRQ_INPUT;
    avr_irq_register_notify(twi_irq + TWI_IRQ_OUTPUT, on_twi, NULL);
    avr_irq_t *uart = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), 0);
    if (!uart)
        return;
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(uint32_t)(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    uart_in = uart + UART_IRQ_INPUT;
    avr_irq_register_notify(uart + UART_IRQ_OUTPUT, on_output, NULL);
    avr_irq_register_notify(uart + UART_IRQ_OUT_XON, on_room, NULL);
    avr_irq_register_notify(uart + UART_IRQ_OUT_XOFF, on_no_room, NULL);
}

static double clock_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

/* Whether the firmware has called exit(): it stays at one instruction with interrupts off. */
static int has_exited(void)
{
    return !avr->sreg[S_I] && number(avr->flash + avr->pc, 2) == STOPPED_OPCODE;
}

/* Runs to the end; returns the exit code. */
static int run(double seconds, double speed)
{
    avr_cycle_count_t look_every = avr_usec_to_cycles(avr, LOOK_EVERY_US);
    avr_cycle_count_t end = (avr_cycle_count_t)(seconds * avr->frequency);
    avr_cycle_count_t look_at = 0;
    double start = clock_seconds();
    for (;;) {
        int state = avr_run(avr);
        if (byte_has_begun)
            take_time();
        if (is_found)
            return 0;
        if (state == cpu_Crashed)
            fail("the firmware crashed: it left its code or was reset by the watchdog",
                 "check that it was built for this microcontroller: --mcu");
        if (state == cpu_Done)
            return 0;
        if (avr->cycle < look_at)
            continue;
        look_at = avr->cycle + look_every;
        take_input();
        meet();
        if (has_exited())
            return avr->data[24];
        if (end && avr->cycle >= end)
            return *until ? CODE_TIME_OVER : 0;
        double early = speed > 0 ? (double)avr->cycle / avr->frequency / speed - (clock_seconds() - start) : 0;
        if (early > 0.002) {
            fflush(stdout);
            usleep((useconds_t)(early < 0.5 ? early * 1e6 : 5e5));
        }
    }
}

int main(int count, char **given)
{
    if (count < 9)
        fail("arguments are missing", "SOCKET FIRMWARE MCU HZ BUS SECONDS SPEED UNTIL [INT_PIN ...]");
    setvbuf(stdout, NULL, _IOLBF, 0);
    uint32_t hz = (uint32_t)strtoul(given[4], NULL, 10);
    bus = (uint32_t)strtoul(given[5], NULL, 10);
    until = given[8];
    if (strlen(until) >= UNTIL_BYTES_MAX)
        fail("the text that ends it is too long", "give at most 255 bytes");
    avr_global_logger_set(say);
    avr = avr_make_mcu_by_name(given[3]);
    if (!avr)
        fail("simavr knows no such microcontroller", "name one that `simavr --list-cores` (package simavr) prints, such as atmega328p");
    avr_init(avr);
    load(given[2], hz);
    avr->sleep = no_sleep;
    wire(count - 9, given + 9);
    connect_to(given[1]);
    meet();
    double start = clock_seconds();
    int code = run(strtod(given[6], NULL), strtod(given[7], NULL));
    stop();
    double taken = clock_seconds() - start, emulated = (double)avr->cycle / avr->frequency;
    fflush(stdout);
    if (!getenv("GRIDEYE_QUIET"))
        fprintf(stderr, "%s: %.3f s of an %s in %.3f s, %.1f times real time; %llu transactions by TWI, %llu addresses not acknowledged\n",
                given[2], emulated, given[3], taken, taken > 0 ? emulated / taken : 0, transactions, refused);
    return code;
}

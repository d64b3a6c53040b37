/* The emulated Panasonic Grid-EYE AMG8833, for tests of firmware. C99 and C++11; no other header is needed.
 *
 * A bus with up to two sensors, at 0x68 and 0x69, and a clock that only you and the bus move. Temperatures are in degrees
 * Celsius, pixels in the order of the registers: number n of the datasheet is pixels_c[n - 1]. Times are in nanoseconds since
 * amg8833_init(). Behavior is that of the AMG88 specification (2016); where it is silent or users saw something else, that of
 * crates/amg8833-emulator/CONFORMANCE.md.
 *
 *   Memory    A bus is in memory of yours, as any struct: global, local or from malloc. Nothing is allocated, except for
 *             scenes. Do not copy or move it once it is made.
 *   Pointers  are to memory of yours that is as large as the type or the count says. Frames of a recording and what
 *             amg8833_plug_callback() was given are used until the sensor is unplugged or replaced, or the bus ends; all else
 *             only during the call.
 *   Threads   There is no global state: two buses are two worlds, each in whichever thread. One bus may change threads, as
 *             long as calls are ordered; two calls at once are AMG8833_BUSY in one of them. So is a call from a callback on
 *             its own bus.
 *   Misuse    is an error, and does nothing else: NULL, a bus that was never made, a number out of range. What C cannot
 *             check is yours: pointers to nowhere, and counts that are too large.
 */
#ifndef AMG8833_H
#define AMG8833_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What every call returns. */
typedef enum amg8833_error {
  AMG8833_OK = 0,

  /* What a controller sees. */
  AMG8833_NACK_ADDRESS = 1,     /* no device acknowledged the address */
  AMG8833_NACK_BYTE = 2,        /* the device did not acknowledge a byte */
  AMG8833_BUS = 3,              /* a START or STOP was misplaced */
  AMG8833_ARBITRATION_LOST = 4, /* another controller drove the bus */
  AMG8833_TIMEOUT = 5,          /* the bus was held low, and a second passed */
  AMG8833_GONE = 6,             /* the bus adapter is gone */

  AMG8833_LATE = 7, /* amg8833_wait_int(): the time has passed */

  /* Misuse. */
  AMG8833_NULL = 16,       /* a pointer is NULL */
  AMG8833_NOT_A_BUS = 17,  /* never made, ended, or copied */
  AMG8833_SIZE = 18,       /* header and library are of different versions */
  AMG8833_BUSY = 19,       /* another call on this bus has not ended */
  AMG8833_ADDRESS = 20,    /* a sensor has the address 0x68 or 0x69 */
  AMG8833_NO_SENSOR = 21,  /* there is none at this address */
  AMG8833_VALUE = 22,      /* a number is out of its range */
  AMG8833_OVERLAP = 23,    /* bytes to read overlap those to write, or the bus */
  AMG8833_OPEN = 24,       /* a transaction is open: amg8833_stop() first */
  AMG8833_NOT_OPEN = 25,   /* none is open, or it goes in the other direction */
  AMG8833_FULL = 26,       /* no more faults fit */
  AMG8833_SCENE = 27,      /* the scene was refused: the message says why */
  AMG8833_NO_SCENES = 28,  /* the library was built without the feature `scene` */
  AMG8833_PANIC = 29       /* an error of the library itself: standard error has it, the bus is of no more use */
} amg8833_error;

/* A sentence for an error, never NULL. */
const char *amg8833_error_text(amg8833_error error);

/* --- a bus ------------------------------------------------------------------------------------------------------------ */

/* Its contents are the library's. */
typedef struct amg8833_bus {
  uint64_t contents[1024];
} amg8833_bus;

/* Makes a bus without sensors at time 0, whatever was in its memory; `size` is sizeof(amg8833_bus). Each bit takes its time
 * at `scl_hz`: at 100000 a frame read takes 12.3 ms, and one in several transactions may mix two frames. The sensor is
 * specified up to 400000 (AMG88 spec 4-6-2). With 0, transactions take no time. */
amg8833_error amg8833_init(amg8833_bus *bus, size_t size, uint32_t scl_hz);

/* Ends it. Only a bus with scenes has something to free. */
amg8833_error amg8833_end(amg8833_bus *bus);

/* --- sensors: plugged in, a sensor powers on, and its first frame comes 100 ms later. One that is there is replaced. ------ */

typedef struct amg8833_frame {
  float pixels_c[64]; /* what a register cannot hold saturates; NAN is an overflow of the converter */
  float thermistor_c; /* the chip's own temperature, some degrees above the room's */
} amg8833_frame;

/* All pixels see one temperature. */
amg8833_error amg8833_plug_celsius(amg8833_bus *bus, uint8_t address, float pixels_c, float thermistor_c);

/* A frame that never changes. */
amg8833_error amg8833_plug_frame(amg8833_bus *bus, uint8_t address, const amg8833_frame *frame);

/* One frame for each measurement, ten a second, from power-on and again from a reset (0x3F); the last one stays. `frames`
 * stays yours, and stays there. At 1 fps, the sensor shows means of ten. */
amg8833_error amg8833_plug_recording(amg8833_bus *bus, uint8_t address, const amg8833_frame *frames, size_t count);

/* Called once for each measurement, in order, from whichever call lets its time come; `frame` begins with zeros. It returns:
 * it throws no exception and does not longjmp. Its bus is AMG8833_BUSY to it. */
typedef void (*amg8833_callback)(void *user, uint64_t now_ns, amg8833_frame *frame);
amg8833_error amg8833_plug_callback(amg8833_bus *bus, uint8_t address, amg8833_callback callback, void *user);

/* A file that a scene names, such as a trajectory. */
typedef struct amg8833_file {
  const char *name;
  const char *text;
} amg8833_file;

/* A scene file: scenes/README.md has its format. Texts are UTF-8. */
typedef struct amg8833_scene {
  const char *text;
  const amg8833_file *files; /* those that it names, or NULL */
  size_t file_count;
  const char *sensor; /* its name in the scene, or NULL for the first one; of 8 x 8 pixels */
  uint64_t seed;      /* of its noise */
} amg8833_scene;

/* Looks into a scene, whose time begins with the sensor's first measurement after power-on or a reset (0x3F). Needs the
 * library with the feature `scene`. What is wrong with a scene is written to `message`, cut to its size; NULL is allowed. */
amg8833_error amg8833_plug_scene(amg8833_bus *bus, uint8_t address, const amg8833_scene *scene, char *message, size_t size);

amg8833_error amg8833_unplug(amg8833_bus *bus, uint8_t address);

/* --- transfers, each a transaction from START to STOP. Addresses have 7 bits, of whatever device. -------------------------- */

amg8833_error amg8833_write(amg8833_bus *bus, uint8_t address, const uint8_t *bytes, size_t count);
amg8833_error amg8833_read(amg8833_bus *bus, uint8_t address, uint8_t *bytes, size_t count);

/* With a repeated START between: how a register is read. */
amg8833_error amg8833_write_read(amg8833_bus *bus, uint8_t address, const uint8_t *written, size_t written_count,
                                 uint8_t *read, size_t read_count);

/* Byte by byte, as the hardware of a microcontroller does it. amg8833_start() is START, or repeated START, and the address;
 * to another address it is STOP and START. After AMG8833_NACK_ADDRESS and AMG8833_NACK_BYTE the transaction is open still:
 * a controller sends STOP. After other errors of amg8833_start() none is open. The registers stand still until the STOP
 * (AMG88 spec 4-11-11); time may pass meanwhile, and only calls of this group, of time and of counts are allowed. */
amg8833_error amg8833_start(amg8833_bus *bus, uint8_t address, int is_read);
amg8833_error amg8833_send(amg8833_bus *bus, uint8_t byte);
amg8833_error amg8833_receive(amg8833_bus *bus, uint8_t *byte);
amg8833_error amg8833_stop(amg8833_bus *bus);

/* --- time --------------------------------------------------------------------------------------------------------------- */

#define AMG8833_MS UINT64_C(1000000)

amg8833_error amg8833_now_ns(amg8833_bus *bus, uint64_t *now_ns);
amg8833_error amg8833_advance_ns(amg8833_bus *bus, uint64_t by_ns);

/* When the next frame reaches the registers; UINT64_MAX for never, as in sleep. */
amg8833_error amg8833_next_frame_ns(amg8833_bus *bus, uint8_t address, uint64_t *at_ns);

/* --- the INT pin, an open drain (AMG88 spec 4-7): low is an interrupt, released is high by the board's pull-up ------------- */

amg8833_error amg8833_int_is_low(amg8833_bus *bus, uint8_t address, bool *is_low);

/* Lets time pass until it is low (1) or released (0); AMG8833_LATE after `most_ns`. */
amg8833_error amg8833_wait_int(amg8833_bus *bus, uint8_t address, int is_low, uint64_t most_ns);

/* --- faults --------------------------------------------------------------------------------------------------------------- */

typedef enum amg8833_fault_kind {
  AMG8833_FAULT_NACK_ADDRESS,
  AMG8833_FAULT_NACK_BYTE, /* `byte` 0 is the register address */
  AMG8833_FAULT_BUS_ERROR,
  AMG8833_FAULT_ARBITRATION_LOSS,
  AMG8833_FAULT_TIMEOUT,     /* of this transaction, a second long; other addresses work */
  AMG8833_FAULT_HANG,        /* a line is held low, whatever the address */
  AMG8833_FAULT_SHORT_CLOCK, /* the sensor misses a pulse of SCL: `byte`, `bit` */
  AMG8833_FAULT_BIT_FLIP,    /* in `reg`, `byte`, `bit`, each of which may be any */
  AMG8833_FAULT_STUCK_HIGH,  /* every byte reads 0xFF */
  AMG8833_FAULT_ALL_ZERO,    /* every byte reads 0x00 */
  AMG8833_FAULT_BROWN_OUT,   /* the sensor restarts with its defaults, silently; once */
  AMG8833_FAULT_FAST_WAKE,   /* registers freeze after a wake within 100 ms */
  AMG8833_FAULT_FREEZE,      /* no new frame */
  AMG8833_FAULT_TORN,        /* registers change within a transaction; before `pixel` they are of the frame before */
  AMG8833_FAULT_UNPLUGGED,
  AMG8833_FAULT_ADAPTER_GONE,
  AMG8833_FAULT_PIXEL_GLITCH,       /* `pixel` has the word `value` */
  AMG8833_FAULT_THERMISTOR_FAILURE, /* it has the word `value` */
  AMG8833_FAULT_CLOCK_ERROR,        /* of the sensor: `value` is parts per million, positive is fast */
  AMG8833_FAULT_SCL_SPEED,          /* `value` is Hz */
  AMG8833_FAULT_KINDS               /* how many there are */
} amg8833_fault_kind;

typedef struct amg8833_fault {
  int32_t kind;
  int32_t byte;  /* within a transaction, after the address, from 0 */
  int32_t bit;   /* 7, the first on the wire, to 0 */
  int32_t reg;   /* the address of a register */
  int32_t pixel; /* 0 to 63 */
  int32_t value;
  double chance; /* 0 to 1: of each transaction, byte, frame or stretch of time */
} amg8833_fault;

/* A fault of this kind that always strikes, where any byte, bit, register and pixel will do. Set what it needs. */
static inline amg8833_fault amg8833_fault_of(amg8833_fault_kind kind) {
  amg8833_fault fault = {0, -1, -1, -1, -1, 0, 1.0};
  fault.kind = (int32_t)kind;
  return fault;
}

/* From now on, at this address or (0) on the whole bus; replaces a fault of the same kind. */
amg8833_error amg8833_set_fault(amg8833_bus *bus, uint8_t address, const amg8833_fault *fault);

/* Ends those of this sensor, or (0) those of the whole bus. */
amg8833_error amg8833_clear_faults(amg8833_bus *bus, uint8_t address);

/* How often a kind struck since the bus was made. */
amg8833_error amg8833_fault_count(amg8833_bus *bus, amg8833_fault_kind kind, uint64_t *count);

/* Which occasions a chance below 1 hits is a function of the seed, 0 unless set. */
amg8833_error amg8833_set_seed(amg8833_bus *bus, uint64_t seed);

/* --- what was done and refused -------------------------------------------------------------------------------------------- */

typedef struct amg8833_counts {
  /* On the bus: */
  uint64_t transactions;
  uint64_t bytes; /* addresses and data */
  uint64_t bits;  /* nine a byte, one for each START, repeated START and STOP */
  uint64_t nacks; /* addresses and bytes that were not acknowledged */
  /* Of the sensor: */
  uint64_t frames; /* that reached the registers */
  uint64_t int_falls;
  uint64_t int_releases;
  uint64_t refused_nacks;       /* addresses and bytes that it did not acknowledge */
  uint64_t refused_asleep;      /* bytes written in sleep mode, but for the command to wake (AMG88 spec 4-11-1) */
  uint64_t refused_read_only;   /* bytes written to registers that are read only */
  uint64_t refused_reserved;    /* bytes written to registers that nobody specified (AMG88 spec 4-10) */
  uint64_t refused_without_key; /* bytes written to the moving average's register without its key (AMG88 spec 4-11-7) */
  uint64_t refused_commands;    /* unknown ones, in the registers 0x00 and 0x01 */
} amg8833_counts;

/* Since the bus was made, and since this sensor was plugged in; with the address 0, of the bus alone. */
amg8833_error amg8833_count(amg8833_bus *bus, uint8_t address, amg8833_counts *counts);

#ifdef __cplusplus
}
#endif

#endif

/* How published drivers in C and C++ use the registers, each in own code: what goes over the bus is theirs, and so is what they
 * make of it, mistakes included. crates/amg8833-emulator/CONFORMANCE.md has the same results of the drivers themselves. */
#include "check.h"

static amg8833_bus bus;

static int16_t twos(unsigned word, unsigned sign) { return (int16_t)(word & sign ? (int)(word & (2 * sign - 1)) - 2 * (int)sign : (int)word); }

/* SparkFun_GridEYE_Arduino_Library: each pixel by itself, address and a read with a STOP between; two's complement for the
 * thermistor too. */
static float sparkfun_register(uint8_t reg, float degrees) {
  uint8_t bytes[2];
  OK(amg8833_write(&bus, 0x69, &reg, 1));
  OK(amg8833_read(&bus, 0x69, bytes, 2));
  return twos(bytes[0] | (unsigned)bytes[1] << 8, 0x800) * degrees;
}

/* Seeed_AMG8833: 128 reads of one byte; no sign. */
static float seeed_pixel(int pixel) {
  uint8_t bytes[2];
  for (int at = 0; at < 2; at++) {
    const uint8_t reg = (uint8_t)(0x80 + 2 * pixel + at);
    OK(amg8833_write_read(&bus, 0x69, &reg, 1, &bytes[at], 1));
  }
  return (float)(bytes[0] | bytes[1] << 8) * 0.25f;
}

/* Seeed_AMG8833::init(): level bytes before the reset, which holds them; status clear with the bit of 2011. */
static void seeed_init(void) {
  static const uint8_t WRITES[][2] = {{0x00, 0x00}, {0x08, 0x80}, {0x09, 0x00}, {0x0A, 0x01}, {0x0B, 0x00}, {0x0C, 0x08},
                                      {0x0D, 0x00}, {0x03, 0x03}, {0x05, 0x0E}, {0x01, 0x3F}};
  for (size_t at = 0; at < sizeof WRITES / sizeof WRITES[0]; at++) OK(amg8833_write(&bus, 0x69, WRITES[at], 2));
  OK(amg8833_advance_ns(&bus, 300 * AMG8833_MS));
}

/* Zephyr's amg88xx: one burst; little-endian words of 16 bits, whose sign is bit 11. Asks for the mode first. */
static float zephyr_pixel(int pixel) {
  const uint8_t mode = 0x00, pixels = 0x80;
  uint8_t bytes[128];
  OK(amg8833_write_read(&bus, 0x69, &mode, 1, bytes, 1));
  CHECK(bytes[0] == 0x00);
  OK(amg8833_write_read(&bus, 0x69, &pixels, 1, bytes, sizeof bytes));
  return twos(bytes[2 * pixel] | (unsigned)bytes[2 * pixel + 1] << 8, 0x800) * 0.25f;
}

/* RIOT's amg88xx: one burst; sign and magnitude, which is right for the thermistor alone. */
static float riot(uint8_t reg, float degrees) {
  uint8_t bytes[2];
  OK(amg8833_write_read(&bus, 0x69, &reg, 1, bytes, 2));
  const float magnitude = (float)(bytes[0] | (bytes[1] & 0x07) << 8) * degrees;
  return bytes[1] & 0x08 ? -magnitude : magnitude;
}

/* cornellrocketryteam/AMG8833-Pico: three bytes, the second a zero too many, and no STOP. */
static void pico_set(uint8_t reg, uint8_t value) {
  OK(amg8833_start(&bus, 0x69, 0));
  OK(amg8833_send(&bus, reg));
  OK(amg8833_send(&bus, 0x00));
  OK(amg8833_send(&bus, value));
}

/* arms22/GridEye: four blocks of 32 bytes. */
static float arms22_pixel(int pixel) {
  uint8_t bytes[128];
  for (int block = 0; block < 4; block++) {
    const uint8_t reg = (uint8_t)(0x80 + 32 * block);
    OK(amg8833_write_read(&bus, 0x69, &reg, 1, &bytes[32 * block], 32));
  }
  return twos(bytes[2 * pixel] | (unsigned)bytes[2 * pixel + 1] << 8, 0x800) * 0.25f;
}

int main(void) {
  amg8833_counts counts;
  uint8_t upper[1];
  OK(amg8833_init(&bus, sizeof bus, 100000));
  OK(amg8833_plug_celsius(&bus, 0x69, -5.0f, -0.5f));
  seeed_init();
  CHECK(seeed_pixel(63) == 1019.0f);
  CHECK(sparkfun_register(0x80, 0.25f) == -5.0f);
  CHECK(sparkfun_register(0x0E, 0.0625f) == -127.5f);
  CHECK(zephyr_pixel(63) == -5.0f);
  CHECK(riot(0x80, 0.25f) == -507.0f);
  CHECK(riot(0x0E, 0.0625f) == -0.5f);
  CHECK(arms22_pixel(63) == -5.0f);
  OK(READ(&bus, 0x08, upper));
  CHECK(upper[0] == 0x80);
  /* Every one of its writes is to a register that there is; the bit of 2011 is no refusal. */
  OK(amg8833_count(&bus, 0x69, &counts));
  CHECK(counts.refused_read_only + counts.refused_reserved + counts.refused_commands + counts.refused_nacks == 0);

  /* Its reset goes to the register after the one that it means, and its rate to that of interrupts. */
  pico_set(0x01, 0x3F);
  pico_set(0x02, 0x01);
  OK(amg8833_stop(&bus));
  uint8_t registers[2];
  OK(READ(&bus, 0x02, registers));
  CHECK(registers[0] == 0x00 && registers[1] == 0x01);
  OK(amg8833_count(&bus, 0x69, &counts));
  CHECK(counts.refused_commands == 1);
  return failures > 0;
}

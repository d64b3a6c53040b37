#include "grid_eye.h"

/* The registers of the AMG88 specification. */
enum { POWER = 0x00, RESET = 0x01, THERMISTOR = 0x0E, PIXELS = 0x80 };

static int set(const grid_eye *sensor, uint8_t reg, uint8_t value) {
  const uint8_t bytes[] = {reg, value};
  return sensor->write(sensor->bus, sensor->address, bytes, sizeof bytes);
}

static int get(const grid_eye *sensor, uint8_t reg, uint8_t *bytes, size_t count) {
  return sensor->write_read(sensor->bus, sensor->address, &reg, 1, bytes, count);
}

int grid_eye_begin(const grid_eye *sensor) {
  const int error = set(sensor, POWER, 0x00);
  return error ? error : set(sensor, RESET, 0x3F);
}

int grid_eye_read_pixels(const grid_eye *sensor, float pixels_c[64]) {
  uint8_t bytes[128];
  const int error = get(sensor, PIXELS, bytes, sizeof bytes);
  for (size_t pixel = 0; !error && pixel < 64; pixel++) {
    const int word = bytes[2 * pixel] | (bytes[2 * pixel + 1] & 0x0F) << 8;
#ifdef WRONG_BELOW_ZERO /* as in several published drivers: to see the tests fail */
    pixels_c[pixel] = (float)word * 0.25f;
#else /* two's complement of 12 bits, 0.25 °C a step (§4-11-11) */
    pixels_c[pixel] = (float)(word & 0x800 ? word - 0x1000 : word) * 0.25f;
#endif
  }
  return error;
}

int grid_eye_read_thermistor(const grid_eye *sensor, float *c) {
  uint8_t bytes[2];
  const int error = get(sensor, THERMISTOR, bytes, sizeof bytes);
  if (!error) {
    /* Sign and magnitude, 0.0625 °C a step (§4-11-9). */
    const float magnitude = (float)(bytes[0] | (bytes[1] & 0x07) << 8) * 0.0625f;
    *c = bytes[1] & 0x08 ? -magnitude : magnitude;
  }
  return error;
}

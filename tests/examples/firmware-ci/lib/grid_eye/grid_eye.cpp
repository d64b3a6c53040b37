#include "grid_eye.h"

// The registers of the AMG88 specification.
static const uint8_t POWER = 0x00;
static const uint8_t RESET = 0x01;
static const uint8_t UPPER_LEVEL = 0x08;
static const uint8_t THERMISTOR = 0x0E;
static const uint8_t PIXELS = 0x80;

static const uint8_t PIXEL_BYTES = 128;
// What the buffer of every Arduino's Wire holds.
static const uint8_t PART_BYTES = 32;

// Two's complement of 12 bits, 0.25 °C a step (§4-11-11).
static float pixel_c(uint16_t word) {
#ifdef WRONG_BELOW_ZERO  // as in several published drivers: to see the tests fail
  return (word & 0x0FFF) * 0.25f;
#else
  const int16_t steps = (word & 0x0800) ? int16_t(word & 0x0FFF) - 0x1000 : int16_t(word & 0x0FFF);
  return steps * 0.25f;
#endif
}

// Sign and magnitude, 0.0625 °C a step (§4-11-9).
static float thermistor_c(uint16_t word) {
  const float magnitude = (word & 0x07FF) * 0.0625f;
  return (word & 0x0800) ? -magnitude : magnitude;
}

bool GridEye::begin(float level_c) {
  level_ = uint16_t(int16_t(level_c * 4)) & 0x0FFF;  // as a pixel's word (§4-11-8)
  bool done = write(POWER, 0x00);
  delay(50);
  done = done && write(RESET, 0x3F);
  delay(2);
  return done && write(RESET, 0x30) && write(UPPER_LEVEL, lowByte(level_)) && write(UPPER_LEVEL + 1, highByte(level_));
}

bool GridEye::is_set_up() {
  uint16_t level;
  return read_word(UPPER_LEVEL, &level) && (level & 0x0FFF) == level_;
}

// In one transaction, so that all pixels are of one frame: its parts follow one another without a STOP.
bool GridEye::read_pixels(float *pixels_c) {
  if (!start_reading(PIXELS)) return false;
  for (uint8_t at = 0; at < PIXEL_BYTES; at += PART_BYTES) {
    const bool is_last = at + PART_BYTES == PIXEL_BYTES;
    if (Wire.requestFrom(address_, PART_BYTES, uint8_t(is_last)) != PART_BYTES) return false;
    for (uint8_t pixel = at / 2; pixel < (at + PART_BYTES) / 2; pixel++) {
      const uint8_t low = Wire.read();
      pixels_c[pixel] = pixel_c(low | uint16_t(Wire.read()) << 8);
    }
  }
  return true;
}

bool GridEye::read_thermistor(float *c) {
  uint16_t word;
  if (!read_word(THERMISTOR, &word)) return false;
  *c = thermistor_c(word);
  return true;
}

bool GridEye::write(uint8_t reg, uint8_t value) {
  Wire.beginTransmission(address_);
  Wire.write(reg);
  Wire.write(value);
  return Wire.endTransmission() == 0;
}

bool GridEye::start_reading(uint8_t reg) {
  Wire.beginTransmission(address_);
  Wire.write(reg);
  return Wire.endTransmission(false) == 0;
}

bool GridEye::read_word(uint8_t reg, uint16_t *word) {
  if (!start_reading(reg) || Wire.requestFrom(address_, uint8_t(2)) != 2) return false;
  const uint8_t low = Wire.read();
  *word = low | uint16_t(Wire.read()) << 8;
  return true;
}

// A small AMG8833 driver for Arduino: pixels, thermistor, upper interrupt level.
#pragma once

#include <Arduino.h>
#include <Wire.h>

class GridEye {
 public:
  explicit GridEye(uint8_t address = 0x69) : address_(address) {}

  // Wakes the sensor, resets it and sets the level. The first frames come 0.2 s later.
  bool begin(float level_c);

  // Whether the sensor still has the level. After a brown-out it has not: it runs on with its defaults.
  bool is_set_up();

  // All 64 pixels in °C, in the order of the registers; false if the sensor does not answer.
  bool read_pixels(float *pixels_c);

  // The sensor's own temperature in °C; false if it does not answer.
  bool read_thermistor(float *thermistor_c);

 private:
  bool write(uint8_t reg, uint8_t value);
  bool start_reading(uint8_t reg);
  bool read_word(uint8_t reg, uint16_t *word);

  uint8_t address_;
  uint16_t level_ = 0;
};

// The driver on a sensor that shows one temperature: test_driver CELSIUS. Exits with 1 if it reads another.
#include <Arduino.h>
#include <Wire.h>

#include "grid_eye.h"

// The emulated sensor's own warmth: amg8833_wire.h.
static const float WARMER_C = 4.5;

static int failures = 0;

static void expect(const char *what, float found, float expected) {
  if (found == expected) return;
  printf("FAIL %s: %g, expected %g\n", what, found, expected);
  failures++;
}

int main(int, char **arguments) {
  const float shown_c = atof(arguments[1]);
  float pixels_c[64];
  float thermistor_c = NAN;
  GridEye sensor;
  Wire.begin();
  if (!sensor.begin(-10)) return puts("FAIL the sensor does not answer"), 1;
  delay(250);  // two frames
  expect("is_set_up", sensor.is_set_up(), true);
  expect("read_pixels", sensor.read_pixels(pixels_c), true);
  expect("pixel 1", pixels_c[0], shown_c);
  expect("pixel 64", pixels_c[63], shown_c);
  expect("read_thermistor", sensor.read_thermistor(&thermistor_c), true);
  expect("thermistor", thermistor_c, shown_c + WARMER_C);
  expect("begin at another address", GridEye(0x68).begin(0), false);
  return failures > 0;
}

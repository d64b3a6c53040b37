// Watches a freezer: prints its temperatures each 0.1 s, and "warm" for as long as a pixel is above -10 °C.
#include <Arduino.h>
#include <Wire.h>

#include "grid_eye.h"

static const float WARM_C = -10;
static GridEye sensor;

static void set_up() {
  while (!sensor.begin(WARM_C)) {
    Serial.println(F("no sensor"));
    delay(1000);
  }
  delay(200);  // two frames
}

void setup() {
  Serial.begin(115200);
  Wire.begin();
  Wire.setClock(400000);
  set_up();
}

void loop() {
  float pixels_c[64];
  float thermistor_c;
  const bool answers = sensor.read_pixels(pixels_c) && sensor.read_thermistor(&thermistor_c);
  // After the reading, which may be of a sensor that just restarted.
  if (!sensor.is_set_up()) {
    Serial.println(F("the sensor restarted"));
    set_up();
  } else if (answers) {
    bool is_warm = false;
    Serial.print(F("thermistor "));
    Serial.print(thermistor_c, 4);
    Serial.print(F(" pixels"));
    for (uint8_t pixel = 0; pixel < 64; pixel++) {
      Serial.print(' ');
      Serial.print(pixels_c[pixel]);
      is_warm = is_warm || pixels_c[pixel] > WARM_C;
    }
    Serial.println(is_warm ? F(" warm") : F(" cold"));
  }
  delay(100);
}

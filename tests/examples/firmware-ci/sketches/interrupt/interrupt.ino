// Waits for the sensor's interrupt at pin 2, whose level is 30 °C, and prints when it came, which pixels, and what INT is.
#include <Wire.h>

static const uint8_t SENSOR = 0x69;
static volatile bool is_warm = false;

void write(uint8_t reg, uint8_t value) {
  Wire.beginTransmission(SENSOR);
  Wire.write(reg);
  Wire.write(value);
  Wire.endTransmission();
}

uint8_t read(uint8_t reg) {
  Wire.beginTransmission(SENSOR);
  Wire.write(reg);
  Wire.endTransmission(false);
  Wire.requestFrom(SENSOR, (uint8_t)1);
  return Wire.read();
}

void on_interrupt() { is_warm = true; }

void setup() {
  Serial.begin(115200);
  Wire.begin();
  pinMode(2, INPUT_PULLUP);
  write(0x08, 30 * 4);  // the upper level
  write(0x0A, 0x00);    // the lower one: -512 °C
  write(0x0B, 0x08);
  write(0x03, 0x03);    // absolute values, pin on
  delay(250);           // two frames
  attachInterrupt(digitalPinToInterrupt(2), on_interrupt, FALLING);
  Serial.print(F("pin "));
  Serial.println(digitalRead(2));
}

void loop() {
  static const unsigned long start_ms = millis();
  delay(1);
  if (!is_warm) return;
  Serial.print(F("interrupt after "));
  Serial.print((millis() - start_ms + 50) / 100);
  Serial.print(F(" tenths of a second, pin "));
  Serial.print(digitalRead(2));
  Serial.print(F(", pixels"));
  for (uint8_t row = 0; row < 8; row++) {
    Serial.print(' ');
    Serial.print(read(0x10 + row), HEX);
  }
  Serial.println();
  Serial.flush();
  exit(0);
}

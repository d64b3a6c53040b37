// Reads frames in three ways, in turn, and prints for each whether all pixels are equal. On a sensor whose frames are each
// of one temperature, a frame with two is torn: mixed of two frames.
#include <Wire.h>

static const uint8_t SENSOR = 0x69;
static const uint8_t PIXELS = 0x80;
static const int FRAME_BYTES = 128;

// Asks for so many bytes from a register on, and takes as many, whether they came or not, as careless code does.
int read_part(uint8_t reg, uint8_t *bytes, int length) {
  Wire.beginTransmission(SENSOR);
  Wire.write(reg);
  Wire.endTransmission(false);
  const int arrived = Wire.requestFrom(SENSOR, (uint8_t)length);
  for (int at = 0; at < length; at++) bytes[at] = Wire.read();
  return arrived;
}

// Reads a frame in parts of so many bytes, each a transaction of its own.
void read_frame(const __FlashStringHelper *way, int part) {
  uint8_t bytes[FRAME_BYTES];
  int arrived = 0;
  for (int at = 0; at < FRAME_BYTES; at += part) arrived += read_part(PIXELS + at, bytes + at, part);
  Serial.print(way);
  Serial.print(F(": "));
  Serial.print(arrived);
  Serial.print(F(" bytes, "));
  for (int at = 2; at < FRAME_BYTES; at += 2) {
    if (bytes[at] != bytes[0] || bytes[at + 1] != bytes[1]) {
      Serial.print(F("torn at pixel "));
      Serial.print(at / 2 + 1);
      Serial.print(F(": "));
      Serial.println((int16_t)(bytes[at] | bytes[at + 1] << 8) * 0.25);
      return;
    }
  }
  Serial.println(F("whole"));
}

void setup() {
  Serial.begin(115200);
  Wire.begin();
}

void loop() {
  static uint8_t round_number = 0;
  read_frame(F("one burst"), 128);
  read_frame(F("32-byte parts"), 32);
  read_frame(F("by pixel"), 2);
  delay(7 * (round_number++ % 11));  // so that all moments between two frames are met
}

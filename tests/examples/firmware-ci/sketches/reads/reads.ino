// Reads frames in four ways, in turn, and prints for each whether all pixels are equal. On a sensor whose frames are each
// of one temperature, a frame with two is torn: mixed of two frames.
#include <Wire.h>

static const uint8_t SENSOR = 0x69;
static const uint8_t PIXELS = 0x80;
static const int FRAME_BYTES = 128;
static const int ROUNDS = 200;

// Takes as many bytes as it asks for, whether they came or not, as careless code does.
int read_part(uint8_t *bytes, int length, bool stop) {
  const int arrived = Wire.requestFrom(SENSOR, (uint8_t)length, (uint8_t)stop);
  for (int at = 0; at < length; at++) bytes[at] = Wire.read();
  return arrived;
}

// Reads a frame in parts of so many bytes: each a transaction of its own with its register, or all held in one.
void read_frame(const __FlashStringHelper *way, int part, bool holds) {
  uint8_t bytes[FRAME_BYTES];
  int arrived = 0;
  for (int at = 0; at < FRAME_BYTES; at += part) {
    if (at == 0 || !holds) {
      Wire.beginTransmission(SENSOR);
      Wire.write(PIXELS + at);
      Wire.endTransmission(false);
    }
    arrived += read_part(bytes + at, part, !holds || at + part == FRAME_BYTES);
  }
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
  static int rounds = 0;
  if (rounds == ROUNDS) {
    Serial.flush();
    exit(0);
  }
  read_frame(F("one burst"), 128, false);
  read_frame(F("32-byte parts"), 32, false);
  read_frame(F("32-byte parts, held"), 32, true);
  read_frame(F("by pixel"), 2, false);
  delay(7 * (rounds++ % 11));  // so that all moments between two frames are met
}

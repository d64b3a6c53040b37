// What Wire answers, line by line: tests/tests/arduino/wire.rs has the expected text. Argument: which part.
#include <Arduino.h>
#include <Wire.h>

static const uint8_t SENSOR = 0x69;

static int request(uint8_t reg, int count) {
  Wire.beginTransmission(SENSOR);
  Wire.write(reg);
  Wire.endTransmission(false);
  return Wire.requestFrom(SENSOR, (uint8_t)count);
}

static void buffers() {
  uint8_t bytes[40] = {0x20};
  delay(200);  // two frames
  int taken = 0;
  Wire.beginTransmission(SENSOR);
  for (int at = 0; at < 40; at++) taken += Wire.write(bytes[at]);
  printf("taken one by one %d, write error %d\n", taken, Wire.getWriteError());
  Wire.beginTransmission(SENSOR);
  printf("taken at once %zu\n", Wire.write(bytes, sizeof bytes));
  printf("sent %d\n", Wire.endTransmission());
  printf("requested 128, arrived %d", request(0x80, 128));
  printf(", available %d\n", Wire.available());
  printf("peek %d", Wire.peek());
  printf(", read %d", Wire.read());
  printf(", left %d\n", Wire.available());
  printf("as a stream %zu\n", Wire.readBytes(bytes, Wire.available()));
  printf("beyond the end %d %d\n", Wire.peek(), Wire.read());
  printf("requested 0, arrived %d\n", request(0x80, 0));
}

static void transactions() {
  delay(200);  // two frames
  const int arrived = Wire.requestFrom(SENSOR, uint8_t(2), uint32_t(0x0E), uint8_t(1), uint8_t(true));
  printf("register by request %d: %02x", arrived, Wire.read());
  printf(" %02x\n", Wire.read());
  // As Melopero's library writes: the address alone first, without a STOP.
  Wire.beginTransmission(SENSOR);
  Wire.endTransmission(false);
  Wire.beginTransmission(int(SENSOR));
  Wire.write(2);
  Wire.write(1);
  printf("two starts %d", Wire.endTransmission());
  printf(", rate %d", request(2, 1));
  printf(" %d\n", Wire.read());
  Wire1.begin();
  Wire1.beginTransmission(0x68);
  printf("second bus %d\n", Wire1.endTransmission());
}

static void codes() {
  Wire.beginTransmission(SENSOR);
  Wire.write(0);
  Wire.write(0);
  printf("%d", Wire.endTransmission());
  Wire.beginTransmission(SENSOR);
  Wire.write(0x0E);
  printf(" %d", Wire.endTransmission(false));
  printf(" %d", Wire.requestFrom(SENSOR, uint8_t(2)));
  printf(" %d\n", Wire.getWireTimeoutFlag());
}

static void forever() {
  while (request(0x0E, 2) == 2) delay(20);
  puts("nothing arrived");
}

static void input() {
  const String line = Serial.readStringUntil('\n');
  printf("%s, then %d", line.c_str(), Serial.available());
  printf(": %c\n", Serial.peek());
  pinMode(2, INPUT_PULLUP);
  attachInterrupt(digitalPinToInterrupt(2), input, FALLING);
  printf("pin %d\n", digitalRead(2));
}

int main(int, char **arguments) {
  const String part = arguments[1];
  if (part != "input") Wire.begin();
  if (part == "buffers") buffers();
  if (part == "transactions") transactions();
  if (part == "codes") codes();
  if (part == "forever") forever();
  if (part == "input") input();
}

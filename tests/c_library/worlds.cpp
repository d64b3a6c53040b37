// Two buses in two threads are two worlds; and one bus that two threads use at once is AMG8833_BUSY, and nothing worse.
#include "check.h"

#include <atomic>
#include <thread>

static void world(float celsius, uint8_t low, uint8_t high) {
  amg8833_bus bus;
  uint8_t pixels[128];
  OK(amg8833_init(&bus, sizeof bus, 400000));
  OK(amg8833_plug_celsius(&bus, 0x69, celsius, 25));
  OK(amg8833_advance_ns(&bus, 100 * AMG8833_MS));
  for (int round = 0; round < 300; round++) {
    OK(READ(&bus, 0x80, pixels));
    CHECK(pixels[0] == low && pixels[127] == high);
  }
}

int main() {
  std::thread one(world, -25.0f, 0x9C, 0x0F), other(world, 25.0f, 0x64, 0x00);
  one.join();
  other.join();

  amg8833_bus bus;
  std::atomic<int> done(0), busy(0), wrong(0);
  OK(amg8833_init(&bus, sizeof bus, 0));
  OK(amg8833_plug_celsius(&bus, 0x69, 20, 25));
  OK(amg8833_advance_ns(&bus, 100 * AMG8833_MS));
  auto reader = [&] {
    uint8_t pixels[128];
    for (int round = 0; round < 20000; round++) {
      const amg8833_error error = READ(&bus, 0x80, pixels);
      if (error == AMG8833_OK) done += pixels[0] == 80;
      if (error == AMG8833_BUSY) busy++;
      wrong += error != AMG8833_OK && error != AMG8833_BUSY;
    }
  };
  std::thread first(reader), second(reader);
  first.join();
  second.join();
  CHECK(done + busy == 40000 && wrong == 0);
  return failures > 0;
}

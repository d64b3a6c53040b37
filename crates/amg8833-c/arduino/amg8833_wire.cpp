#include "amg8833_wire.h"

static const unsigned BUSES = 2;
static const uint8_t ADDRESSES[] = {0x68, 0x69};

static uint64_t now_ns(amg8833_bus *bus) {
  uint64_t now = 0;
  amg8833_now_ns(bus, &now);
  return now;
}

// What endTransmission() says of it.
static uint8_t code(amg8833_error error) {
  switch (error) {
    case AMG8833_OK: return 0;
    case AMG8833_NACK_ADDRESS: return 2;
    case AMG8833_NACK_BYTE: return 3;
    case AMG8833_TIMEOUT: return 5;
    default: return 4;
  }
}

class Amg8833Bus : public WireBus {
 public:
  explicit Amg8833Bus(bool has_sensor) {
    amg8833_init(&bus, sizeof bus, 100000);
    const char *celsius = getenv("GRIDEYE_CELSIUS");
    const float c = celsius ? float(atof(celsius)) : 21.5f;
    if (has_sensor) amg8833_plug_celsius(&bus, 0x69, c, c + 4.5f);
  }

  uint8_t transfer(uint8_t address, bool is_read, std::vector<uint8_t> &bytes, bool stop) override {
    follow();
    amg8833_error error = amg8833_start(&bus, address, is_read);
    for (uint8_t &byte : bytes) {
      if (error == AMG8833_OK) error = is_read ? amg8833_receive(&bus, &byte) : amg8833_send(&bus, byte);
    }
    if (stop || error != AMG8833_OK) amg8833_stop(&bus);
    return code(error);
  }

  uint64_t pass_us(uint64_t most_us, int level) override {
    follow();
    // Within an open transaction, or without a sensor, only time passes.
    const amg8833_error error =
        level == NO_LEVEL ? AMG8833_OPEN : amg8833_wait_int(&bus, first_sensor(), level == LOW, most_us * 1000);
    if (error != AMG8833_OK && error != AMG8833_LATE) amg8833_advance_ns(&bus, most_us * 1000);
    return now_ns(&bus) / 1000;
  }

  // Of all buses, in the order of buses and addresses.
  std::vector<uint8_t> int_levels() override;

  amg8833_bus bus;

 private:
  void follow();

  uint8_t first_sensor() {
    bool is_low;
    return amg8833_int_is_low(&bus, ADDRESSES[0], &is_low) == AMG8833_OK ? ADDRESSES[0] : ADDRESSES[1];
  }
};

static Amg8833Bus &bus_of(unsigned number) {
  static Amg8833Bus first(true), second(false);
  return number == 0 ? first : second;
}

void Amg8833Bus::follow() {
  for (unsigned at = 0; at < BUSES; at++) {
    const uint64_t there = now_ns(&bus_of(at).bus), here = now_ns(&bus);
    if (there > here) amg8833_advance_ns(&bus, there - here);
  }
}

std::vector<uint8_t> Amg8833Bus::int_levels() {
  std::vector<uint8_t> levels;
  for (unsigned at = 0; at < BUSES; at++) {
    for (uint8_t address : ADDRESSES) {
      bool is_low;
      if (amg8833_int_is_low(&bus_of(at).bus, address, &is_low) == AMG8833_OK) levels.push_back(!is_low);
    }
  }
  return levels;
}

amg8833_bus *amg8833_wire(unsigned number) { return number < BUSES ? &bus_of(number).bus : nullptr; }

WireBus *amg8833_wire_bus(unsigned number) { return number < BUSES ? &bus_of(number) : nullptr; }

__attribute__((weak)) WireBus *wire_bus(unsigned number) { return amg8833_wire_bus(number); }

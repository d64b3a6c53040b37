// What Arduino.h and Wire.h declare.
#include "Arduino.h"
#include "Wire.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

// Before a sketch's own objects, whose constructors may use them.
#define FIRST __attribute__((init_priority(101)))
HardwareSerial Serial FIRST;
TwoWire Wire FIRST(0);
TwoWire Wire1 FIRST(1);

// The program has no answer: neither right (0) nor wrong (1).
static const int NO_ANSWER = 3;

__attribute__((noreturn)) static void die(const std::string &error, const std::string &hint) {
  fflush(stdout);
  fprintf(stderr, "error: %s\nhint: %s\n", error.c_str(), hint.c_str());
  exit(NO_ANSWER);
}

// --- the sketch ----------------------------------------------------------------------------------------------------

// Weak, so that a unit test links without them, and with its own main().
void setup() __attribute__((weak));
void loop() __attribute__((weak));

static void look_at_pins();

__attribute__((weak)) int main() {
  if (!setup || !loop) die("there is neither main() nor setup() and loop()", "compile the sketch or the test, too");
  // A reader of the output sees each line at once.
  setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
  setup();
  for (;;) {
    loop();
    look_at_pins();
  }
}

// --- time and interrupts -------------------------------------------------------------------------------------------

// An AVR's own resolution. A look at the time takes as long, so that who polls a clock that stands sees it go on.
static const uint64_t LOOK_US = 4;

static struct {
  uint8_t level;
  bool is_int;  // wired to the INT of a sensor
  void (*handler)();
  int mode;
} pins[256];

// The pin at the INT of a sensor, counted from 0; -1 for none.
static int int_pin(size_t sensor) {
  const char *names = getenv("GRIDEYE_INT_PINS");
  if (!names) names = "2";
  for (; sensor > 0 && names; sensor--) names = strchr(names, ',') ? strchr(names, ',') + 1 : nullptr;
  return names ? uint8_t(atoi(names)) : -1;
}

static uint64_t real_us() {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return uint64_t(now.tv_sec) * 1000000 + uint64_t(now.tv_nsec) / 1000;
}

static const struct Start {
  uint64_t us = real_us();
} START FIRST;

// Lets time pass, at most so long, or until INT of the first sensor is `awaited`: the emulated bus's, or else real time. Calls
// the handlers for what INT has done. Returns the time since the start.
static uint64_t pass_us(uint64_t most_us, int awaited = WireBus::NO_LEVEL) {
  WireBus *bus = wire_bus ? wire_bus(0) : nullptr;
  if (!bus) {
    timespec rest = {time_t(most_us / 1000000), long(most_us % 1000000 * 1000)};
    while (most_us > LOOK_US && nanosleep(&rest, &rest) == -1 && errno == EINTR) {
    }
    return real_us() - START.us;
  }
  const uint64_t now_us = bus->pass_us(most_us, awaited);
  const std::vector<uint8_t> levels = bus->int_levels();
  for (size_t at = 0; at < levels.size() && int_pin(at) >= 0; at++) {
    auto &pin = pins[int_pin(at)];
    const bool has_changed = pin.level != levels[at];
    pin.level = levels[at];
    pin.is_int = true;
    if (has_changed && pin.handler && (pin.mode == CHANGE || pin.mode == (pin.level ? RISING : FALLING))) pin.handler();
  }
  return now_us;
}

static void look_at_pins() { pass_us(LOOK_US); }

static void wait_us(uint64_t us) {
  uint64_t now_us = pass_us(0);
  const uint64_t end_us = now_us + us;
  while (now_us < end_us) {
    // An interrupt comes at its moment: of the first sensor.
    const auto &pin = pins[uint8_t(int_pin(0))];
    now_us = pass_us(end_us - now_us, pin.is_int && pin.handler ? !pin.level : WireBus::NO_LEVEL);
  }
}

// 32 bits, so that they wrap as on a microcontroller.
unsigned long millis() { return uint32_t(pass_us(LOOK_US) / 1000); }
unsigned long micros() { return uint32_t(pass_us(LOOK_US)); }

void delay(unsigned long ms) {
  fflush(stdout);
  wait_us(uint64_t(ms) * 1000);
}

void delayMicroseconds(unsigned int us) { wait_us(us); }

void pinMode(uint8_t pin, uint8_t mode) {
  if (mode != OUTPUT && !pins[pin].is_int) pins[pin].level = mode == INPUT_PULLUP ? HIGH : LOW;
}

void digitalWrite(uint8_t pin, uint8_t level) {
  if (!pins[pin].is_int) pins[pin].level = level != LOW;
}

int digitalRead(uint8_t pin) {
  look_at_pins();
  return pins[pin].level;
}

void attachInterrupt(uint8_t interrupt, void (*handler)(), int mode) {
  auto &pin = pins[uint8_t(interrupt < 2 ? interrupt + 2 : interrupt)];
  look_at_pins();
  pin.handler = handler;
  pin.mode = mode;
  if (pin.is_int) return;
  fprintf(stderr, "note: no interrupt comes: INT has a wire only with the emulated sensor in this process, amg8833_wire.cpp\n");
}

void detachInterrupt(uint8_t interrupt) { pins[uint8_t(interrupt < 2 ? interrupt + 2 : interrupt)].handler = nullptr; }

// --- text ----------------------------------------------------------------------------------------------------------

String::String(double n, unsigned char digits) {
  // A half is rounded away from zero, unlike by printf().
  const double scale = pow(10, digits);
  char text[512];
  snprintf(text, sizeof text, "%.*f", digits, round(n * scale) / scale);
  text_ = text;
}

String String::substring(unsigned from, unsigned to) const {
  if (from >= text_.size() || to <= from) return String();
  return String(text_.substr(from, to - from).c_str());
}

void String::trim() {
  static const char *const BLANKS = " \t\r\n\v\f";
  text_.erase(text_.find_last_not_of(BLANKS) + 1);
  text_.erase(0, text_.find_first_not_of(BLANKS));
}

size_t Print::write(const uint8_t *bytes, size_t length) {
  size_t written = 0;
  while (written < length && write(bytes[written])) written++;
  return written;
}

size_t Print::print(long n, int base) {
  if (base != DEC) return print((unsigned long)(uint32_t)n, base);
  return n < 0 ? print('-') + print(-(unsigned long)n) : print((unsigned long)n);
}

size_t Print::print(unsigned long n, int base) {
  char digits[64 + 1] = "";
  char *first = &digits[64];
  do {
    *--first = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ"[n % base];
    n /= base;
  } while (n);
  return write(first);
}

// In floats, since that is what an AVR's double is: the last digit of 0.125 and of 4.75 depends on it.
size_t Print::print(double n, int digits) {
  float rest = float(n);
  if (isnan(rest)) return print("nan");
  if (isinf(rest)) return print("inf");
  if (fabsf(rest) > 4294967040.0f) return print("ovf");
  size_t printed = rest < 0 ? print('-') : 0;
  float half = 0.5f;
  for (int digit = 0; digit < digits; digit++) half /= 10;
  rest = fabsf(rest) + half;
  printed += print((unsigned long)rest);
  if (digits > 0) printed += print('.');
  for (int digit = 0; digit < digits; digit++) {
    rest = (rest - floorf(rest)) * 10;
    printed += print(char('0' + int(rest)));
  }
  return printed;
}

int Stream::timed_read() {
  const uint64_t end_us = pass_us(0) + uint64_t(timeout_ms_) * 1000;
  int next = read();
  while (next < 0 && pass_us(LOOK_US) < end_us) {
    wait_us(1000);
    next = read();
  }
  return next;
}

size_t Stream::readBytes(uint8_t *bytes, size_t length) {
  for (size_t at = 0; at < length; at++) {
    const int next = timed_read();
    if (next < 0) return at;
    bytes[at] = uint8_t(next);
  }
  return length;
}

String Stream::readStringUntil(char end) {
  String line;
  for (int next = timed_read(); next >= 0 && next != end; next = timed_read()) line += char(next);
  return line;
}

int HardwareSerial::peek() {
  pollfd input = {STDIN_FILENO, POLLIN, 0};
  uint8_t byte;
  if (next_ < 0 && poll(&input, 1, 0) == 1 && ::read(STDIN_FILENO, &byte, 1) == 1) next_ = byte;
  return next_;
}

int HardwareSerial::available() { return peek() >= 0; }

int HardwareSerial::read() {
  const int next = peek();
  next_ = -1;
  return next;
}

// --- Wire ----------------------------------------------------------------------------------------------------------

// What endTransmission() returns, besides 3 for a byte.
enum : uint8_t { DONE = 0, NO_ADDRESS = 2, OTHER = 4, TIMEOUT = 5 };

void TwoWire::begin() {
  bus_ = wire_bus ? wire_bus(offset_) : nullptr;
  if (!bus_ && file_ == -1) open_device();
}

void TwoWire::end() {
  if (file_ != -1) close(file_);
  file_ = -1;
  held_.clear();
}

void TwoWire::beginTransmission(uint8_t address) {
  transmitting_ = true;
  transmission_ = {address, false, {}};
}

size_t TwoWire::write(uint8_t byte) {
  if (!transmitting_ || transmission_.bytes.size() == BUFFER_LENGTH) {
    setWriteError();
    return 0;
  }
  transmission_.bytes.push_back(byte);
  return 1;
}

size_t TwoWire::write(const uint8_t *bytes, size_t length) {
  for (size_t at = 0; at < length; at++) write(bytes[at]);
  return length;
}

uint8_t TwoWire::endTransmission(uint8_t stop) {
  transmitting_ = false;
  return carry_out(transmission_, stop);
}

uint8_t TwoWire::requestFrom(uint8_t address, uint8_t quantity, uint32_t reg, uint8_t reg_bytes, uint8_t stop) {
  if (reg_bytes > 0) {
    beginTransmission(address);
    while (reg_bytes-- > 0) write(uint8_t(reg >> (8 * reg_bytes)));
    endTransmission(false);
  }
  return requestFrom(address, quantity, stop);
}

uint8_t TwoWire::requestFrom(uint8_t address, uint8_t quantity, uint8_t stop) {
  received_.clear();
  taken_ = 0;
  if (quantity == 0) return 0;
  carry_out({address, true, std::vector<uint8_t>(min(quantity, BUFFER_LENGTH))}, stop);
  return uint8_t(received_.size());
}

uint8_t TwoWire::carry_out(Message message, bool stop) {
  begin();
  uint8_t result;
  if (bus_) {
    result = bus_->transfer(uint8_t(message.address), message.is_read, message.bytes, stop);
    if (message.is_read && result == DONE) received_ = message.bytes;
  } else {
    result = carry_out_by_device(message, stop);
  }
  timed_out_ |= result == TIMEOUT;
  return result;
}

void TwoWire::open_device() {
  const char *first = getenv("GRIDEYE_I2C_BUS");
  number_ = (first ? unsigned(atoi(first)) : 1) + offset_;
  const std::string path = "/dev/i2c-" + std::to_string(number_);
  file_ = open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (file_ == -1) {
    die(path + ": " + strerror(errno), "start the program on an emulated sensor: grideye emulate --constant 21.5 -- PROGRAM");
  }
}

uint8_t TwoWire::carry_out_by_device(const Message &message, bool stop) {
  held_.push_back(message);
  if (!message.is_read && !stop) return DONE;
  std::vector<i2c_msg> messages;
  for (Message &m : held_) {
    messages.push_back({m.address, uint16_t(m.is_read ? I2C_M_RD : 0), uint16_t(m.bytes.size()), m.bytes.data()});
  }
  i2c_rdwr_ioctl_data transfer = {messages.data(), uint32_t(messages.size())};
  const int completed = ioctl(file_, I2C_RDWR, &transfer);
  if (completed == int(messages.size()) && message.is_read) received_ = held_.back().bytes;
  held_.clear();
  if (completed == int(messages.size())) return DONE;
  switch (completed == -1 ? errno : EIO) {
    case ENXIO:
    case EREMOTEIO:  // a Raspberry Pi does not tell an address from a byte
      return NO_ADDRESS;
    case ETIMEDOUT:
      return TIMEOUT;
    case ENOTTY:
      die("/dev/i2c-" + std::to_string(number_) + ": not an I2C bus", "GRIDEYE_I2C_BUS names the number of another");
    default:
      return OTHER;
  }
}

// What Arduino.h and Wire.h declare. The socket's protocol is in ../src/socket/PROTOCOL.md.
#include "Arduino.h"
#include "Wire.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
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

static const uint16_t NO_SENSOR = 0xFFFF;
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

// Lets time pass, at most so long, or until a sensor's INT has this level: the emulated machine's, which continues real time
// from begin() on, or else real time. Calls the handlers for what INT has done. Returns the time since the start.
static uint64_t pass_us(uint64_t most_us, uint16_t sensor = NO_SENSOR, bool level = LOW) {
  static bool is_known = false;
  static uint64_t ahead_us;
  TwoWire::Machine machine;
  if (!Wire.pass(most_us, sensor, level, &machine)) {
    timespec rest = {time_t(most_us / 1000000), long(most_us % 1000000 * 1000)};
    while (most_us > LOOK_US && nanosleep(&rest, &rest) == -1 && errno == EINTR) {
    }
    return real_us() - START.us;
  }
  if (!is_known) ahead_us = real_us() - START.us - machine.now_us;
  is_known = true;
  for (size_t at = 0; at < machine.levels.size() && int_pin(at) >= 0; at++) {
    auto &pin = pins[int_pin(at)];
    const bool has_changed = pin.level != machine.levels[at];
    pin.level = machine.levels[at];
    pin.is_int = true;
    if (has_changed && pin.handler && (pin.mode == CHANGE || pin.mode == (pin.level ? RISING : FALLING))) pin.handler();
  }
  return machine.now_us + ahead_us;
}

static void look_at_pins() { pass_us(LOOK_US); }

static void wait_us(uint64_t us) {
  static const uint64_t PASS_MAX_US = 1000000;
  uint64_t now_us = pass_us(0);
  const uint64_t end_us = now_us + us;
  while (now_us < end_us) {
    // An interrupt comes at its moment: of the first sensor, since a request waits for one.
    const auto &pin = pins[uint8_t(int_pin(0))];
    now_us = pass_us(min(end_us - now_us, PASS_MAX_US), pin.is_int && pin.handler ? 0 : NO_SENSOR, !pin.level);
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
  fprintf(stderr, "note: no interrupt comes: INT has a wire only after Wire.begin(), and with grideye emulate --socket PATH\n");
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

// What endTransmission() returns.
enum : uint8_t { DONE = 0, NO_ADDRESS = 2, NO_BYTE = 3, OTHER = 4, TIMEOUT = 5 };

void TwoWire::begin() {
  if (file_ == -1) open_bus();
}

void TwoWire::end() {
  if (file_ != -1) close(file_);
  file_ = -1;
  held_.clear();
  open_ = NONE;
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

uint8_t TwoWire::carry_out(const Message &message, bool stop) {
  begin();
  const uint8_t result = is_socket_ ? carry_out_by_socket(message, stop) : carry_out_by_device(message, stop);
  timed_out_ |= result == TIMEOUT;
  return result;
}

void TwoWire::open_bus() {
  const char *first = getenv("GRIDEYE_I2C_BUS");
  number_ = (first ? unsigned(atoi(first)) : 1) + offset_;
  const char *socket = getenv("GRIDEYE_I2C_SOCKET");
  is_socket_ = socket && *socket;
  if (is_socket_) return connect_to(socket);
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

// --- the socket's packets: length, kind and body, little-endian ----------------------------------------------------

enum : uint8_t { HELLO = 0x01, TRANSFER = 0x02, STEP = 0x04, STOP = 0x05, PASS = 0x06 };
enum : uint8_t { WELCOME = 0x81, DONE_PACKET = 0x82, FAULT = 0x83, BYE = 0x85, PASSED = 0x86 };
static const uint32_t PACKET_BYTES_MAX = 344324;
static const int WAIT_MAX_S = 10;
static const uint8_t BUS_ALONE = 0;  // who judges a transfer

static void put16(std::vector<uint8_t> &packet, size_t value) {
  packet.push_back(lowByte(value));
  packet.push_back(highByte(value));
}

static uint64_t number_at(const std::vector<uint8_t> &packet, size_t at, int bytes) {
  uint64_t value = 0;
  for (int byte = 0; byte < bytes && at + byte < packet.size(); byte++) value |= uint64_t(packet[at + byte]) << (8 * byte);
  return value;
}

static const char *const SERVE = "is it there? grideye emulate --constant 21.5 --socket PATH -- PROGRAM";

__attribute__((noreturn)) static void gone(const std::string &why) { die("the emulated bus went away: " + why, SERVE); }

void TwoWire::connect_to(const char *path) {
  sockaddr_un place = {};
  place.sun_family = AF_UNIX;
  strncpy(place.sun_path, path, sizeof place.sun_path - 1);
  file_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  timeval wait = {WAIT_MAX_S, 0};
  setsockopt(file_, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);
  if (connect(file_, (const sockaddr *)&place, sizeof place) == -1) {
    die(std::string("the socket ") + path + " of GRIDEYE_I2C_SOCKET: " + strerror(errno), SERVE);
  }
  const std::vector<uint8_t> welcome = ask({HELLO, 'i', '2', 'c', 'e', 1, 0});
  if (welcome[0] != WELCOME || welcome.size() < 14) gone("it does not speak this protocol");
  const size_t count_at = 12 + welcome[11];
  std::string served;
  for (uint32_t bus = 0; bus < number_at(welcome, count_at, 2); bus++) {
    const uint32_t number = number_at(welcome, count_at + 2 + 4 * bus, 4);
    if (number == number_) return;
    served += " " + std::to_string(number);
  }
  die("there is no bus " + std::to_string(number_) + "; the server has" + served, "GRIDEYE_I2C_BUS=N makes bus N the first: Wire");
}

// A message alone is a transfer. Others are steps of a transaction that stays open.
uint8_t TwoWire::carry_out_by_socket(const Message &message, bool stop) {
  const bool is_alone = stop && open_ == NONE;
  if (open_ == WRITE && !message.is_read) ask({STOP});
  std::vector<uint8_t> packet = {is_alone ? TRANSFER : STEP};
  put16(packet, number_);
  put16(packet, number_ >> 16);
  if (is_alone) {
    packet.push_back(BUS_ALONE);
    put16(packet, 1);
  }
  put16(packet, message.address);
  put16(packet, message.is_read);
  put16(packet, message.bytes.size());
  if (!message.is_read) packet.insert(packet.end(), message.bytes.begin(), message.bytes.end());
  const std::vector<uint8_t> answer = ask(packet);
  if (!is_alone) {
    // A fault ends with a STOP, as the AVR's hardware does it.
    const bool ends = stop || answer[0] != DONE_PACKET;
    if (ends) ask({STOP});
    open_ = ends ? NONE : message.is_read ? READ : WRITE;
  }
  switch (answer[0]) {
    case DONE_PACKET:
      if (message.is_read) received_.assign(answer.begin() + min(size_t(3), answer.size()), answer.end());
      return DONE;
    case FAULT:
      switch (number_at(answer, 1, 1)) {
        case 1: return NO_ADDRESS;
        case 2: return NO_BYTE;
        case 5: return TIMEOUT;
        default: return OTHER;
      }
    default:
      return OTHER;
  }
}

bool TwoWire::pass(uint64_t most_us, uint16_t sensor, bool level, Machine *machine) {
  if (file_ == -1 || !is_socket_) return false;
  std::vector<uint8_t> packet = {PASS};
  for (int shift = 0; shift < 64; shift += 16) put16(packet, most_us * 1000 >> shift);
  put16(packet, sensor);
  packet.push_back(level);
  const std::vector<uint8_t> answer = ask(packet);
  if (answer[0] != PASSED) return false;
  machine->now_us = number_at(answer, 1, 8) / 1000;
  machine->levels.assign(answer.begin() + min(size_t(11), answer.size()), answer.end());
  return true;
}

// Sends a packet, and returns the answer from its kind on.
std::vector<uint8_t> TwoWire::ask(const std::vector<uint8_t> &packet) {
  std::vector<uint8_t> sent;
  put16(sent, packet.size());
  put16(sent, packet.size() >> 16);
  sent.insert(sent.end(), packet.begin(), packet.end());
  // Whether it arrives is seen at the answer, which may be a reason.
  if (send(file_, sent.data(), sent.size(), MSG_NOSIGNAL) != ssize_t(sent.size()) && errno != EPIPE) gone(strerror(errno));
  std::vector<uint8_t> answer(4);
  take(answer.data(), answer.size());
  const uint32_t length = number_at(answer, 0, 4);
  if (length == 0 || length > PACKET_BYTES_MAX) gone("it announced a packet of " + std::to_string(length) + " bytes");
  answer.resize(length);
  take(answer.data(), length);
  if (answer[0] == BYE) gone(std::string(answer.begin() + min(size_t(2), answer.size()), answer.end()));
  return answer;
}

void TwoWire::take(uint8_t *bytes, size_t length) {
  while (length > 0) {
    const ssize_t arrived = recv(file_, bytes, length, 0);
    if (arrived == -1 && errno == EINTR) continue;
    if (arrived <= 0) gone(arrived == 0 ? "it closed the connection" : strerror(errno));
    bytes += arrived;
    length -= size_t(arrived);
  }
}

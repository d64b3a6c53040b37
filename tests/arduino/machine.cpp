// What the sketches of tests/tests/arduino see, by MACHINE; and what they do on their buses, a transaction a line in the file
// that TRACE names: when it began, and its messages, w with the bytes written and r with the number of those read.
#include <amg8833_wire.h>

static float celsius(int word) { return float(word) * 0.25f; }

static amg8833_frame even(float c) {
  amg8833_frame frame;
  for (float &pixel : frame.pixels_c) pixel = c;
  frame.thermistor_c = 25;
  return frame;
}

// Frames of one temperature each, and each with its own; no byte of one is in the next.
static void tick(void *, uint64_t ns, amg8833_frame *frame) {
  const int number = int(ns / (100 * AMG8833_MS)) % 250;
  *frame = even(celsius(number + 0x100 * (number % 7)));
}

// Two pixels become warm in frame 31 and stay so.
static const amg8833_frame *warm() {
  static amg8833_frame frames[31];
  for (amg8833_frame &frame : frames) frame = even(celsius(0x050));
  frames[30].pixels_c[0] = frames[30].pixels_c[9] = celsius(0x0A0);
  return frames;
}

static const char *machine() { return getenv("MACHINE") ? getenv("MACHINE") : ""; }
static bool is(const char *name) { return strcmp(machine(), name) == 0; }

static bool set(amg8833_fault_kind kind, int byte = -1) {
  amg8833_fault fault = amg8833_fault_of(kind);
  fault.byte = byte;
  return amg8833_set_fault(amg8833_wire(0), 0x69, &fault) == AMG8833_OK;
}

static bool plug() {
  if (is("ticking")) amg8833_plug_callback(amg8833_wire(0), 0x69, tick, nullptr);
  if (is("warm")) amg8833_plug_recording(amg8833_wire(0), 0x69, warm(), 31);
  if (is("two buses")) amg8833_plug_celsius(amg8833_wire(1), 0x68, 20, 25);
  if (is("nack-address")) set(AMG8833_FAULT_NACK_ADDRESS);
  if (is("nack-byte")) set(AMG8833_FAULT_NACK_BYTE, 1);
  if (is("bus-error")) set(AMG8833_FAULT_BUS_ERROR);
  if (is("timeout")) set(AMG8833_FAULT_TIMEOUT);
  return true;
}

class Watched : public WireBus {
 public:
  explicit Watched(unsigned number) : number_(number) {}

  uint8_t transfer(uint8_t address, bool is_read, std::vector<uint8_t> &bytes, bool stop) override {
    static FILE *const trace = fopen(getenv("TRACE") ? getenv("TRACE") : "/dev/null", "w");
    const uint64_t now_us = pass_us(0, NO_LEVEL);
    static bool restarts = true;
    if (is("brown-out") && restarts && now_us >= 1200000 && is_closed_) restarts = !set(AMG8833_FAULT_BROWN_OUT);
    uint64_t now_ns = 0;
    amg8833_now_ns(amg8833_wire(number_), &now_ns);
    if (is_closed_) fprintf(trace, "%.9f", double(now_ns) / 1e9);
    fprintf(trace, is_read ? " r%zu" : " w", bytes.size());
    for (size_t at = 0; !is_read && at < bytes.size(); at++) fprintf(trace, "%02x", bytes[at]);
    const uint8_t code = bus()->transfer(address, is_read, bytes, stop);
    is_closed_ = stop || code != 0;
    if (is_closed_) fprintf(trace, "\n");
    fflush(trace);
    return code;
  }

  uint64_t pass_us(uint64_t most_us, int level) override { return bus()->pass_us(most_us, level); }
  std::vector<uint8_t> int_levels() override { return bus()->int_levels(); }

 private:
  WireBus *bus() { return amg8833_wire_bus(number_); }
  unsigned number_;
  bool is_closed_ = true;
};

WireBus *wire_bus(unsigned number) {
  static Watched first(0), second(1);
  static const bool plugged = plug();
  return plugged && number == 0 ? &first : &second;
}

// The sketch's core on a PC: its sensors are emulated, its time is theirs, its posts go to a real collector. Commands come line
// by line; after each, one line says what the core counts.
#include <amg8833.h>
#include <arpa/inet.h>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <sys/socket.h>
#include <unistd.h>
#include <vector>

#include "grideye.h"

namespace {

const uint8_t ADDRESSES[] = {0x69, 0x68};
const char *const NAMES[] = {"0x69", "0x68"};
const int64_t UTC_NS = 1790000000000000000;

amg8833_bus bus;

void check(amg8833_error error, const char *what) {
  if (error == AMG8833_OK) return;
  fprintf(stderr, "%s: %s\n", what, amg8833_error_text(error));
  exit(2);
}

class Controller : public grideye::Bus {
 public:
  const char *write(uint8_t address, uint8_t reg, uint8_t value) override {
    const uint8_t bytes[] = {reg, value};
    return named(amg8833_write(&bus, address, bytes, sizeof bytes));
  }
  const char *read(uint8_t address, uint8_t reg, uint8_t *bytes, size_t count) override {
    return named(amg8833_write_read(&bus, address, &reg, 1, bytes, count));
  }

 private:
  static const char *named(amg8833_error error) {
    switch (error) {
      case AMG8833_OK: return nullptr;
      case AMG8833_NACK_ADDRESS:
      case AMG8833_NACK_BYTE: return "nack";
      case AMG8833_TIMEOUT: return "bus-timeout";
      default: return "bus-error";
    }
  }
};

// Each frame tells its number in its first pixels: five bits each.
void numbered(void *user, uint64_t, amg8833_frame *frame) {
  uint64_t number = (*static_cast<uint64_t *>(user))++;
  for (int pixel = 0; pixel < 64; pixel++) frame->pixels_c[pixel] = 20.0f;
  for (int pixel = 0; pixel < 4; pixel++, number /= 32) frame->pixels_c[pixel] += 0.25f * float(number % 32);
  frame->thermistor_c = 24.0f;
}

// What the collector answers; the status is 0 if there is no answer.
int post(int port, const char *body, size_t length, bool is_deaf, std::string *answer) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in to = {};
  to.sin_family = AF_INET;
  to.sin_port = htons(uint16_t(port));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::string request = "POST /v1/frames HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\nConnection: close\r\nContent-Length: " + std::to_string(length) + "\r\n";
  request += "\r\n" + std::string(body, length);
  int status = 0;
  if (connect(socket, reinterpret_cast<sockaddr *>(&to), sizeof to) == 0 && send(socket, request.data(), request.size(), MSG_NOSIGNAL) == ssize_t(request.size())) {
    std::string all;
    char bytes[4096];
    for (ssize_t count; (count = recv(socket, bytes, sizeof bytes, 0)) > 0;) all.append(bytes, size_t(count));
    const size_t end = all.find("\r\n\r\n");
    // The frames are stored by now, and nobody hears of it.
    if (!is_deaf && all.size() > 12 && end != std::string::npos) {
      status = atoi(all.c_str() + 9);
      *answer = all.substr(end + 4);
    }
  }
  close(socket);
  return status;
}

}  // namespace

int main(int count, char **arguments) {
  if (count != 5) return fprintf(stderr, "host BOOT RING SENSORS CLOCK_PPM\n"), 2;
  const size_t capacity = size_t(atoi(arguments[2])), sensor_count = size_t(atoi(arguments[3]));
  check(amg8833_init(&bus, sizeof bus, 400000), "init");
  uint64_t numbers[2] = {};
  grideye::Lock lock;
  std::vector<grideye::Frame> rings[2];
  std::vector<grideye::Sensor> sensors;
  for (size_t at = 0; at < sensor_count; at++) {
    check(amg8833_plug_callback(&bus, ADDRESSES[at], numbered, &numbers[at]), "plug");
    amg8833_fault fault = amg8833_fault_of(AMG8833_FAULT_CLOCK_ERROR);
    fault.value = atoi(arguments[4]);
    check(amg8833_set_fault(&bus, ADDRESSES[at], &fault), "clock");
    rings[at].resize(capacity);
    sensors.emplace_back(NAMES[at], ADDRESSES[at], rings[at].data(), capacity, &lock);
  }
  grideye::Sensor *pointers[] = {&sensors[0], &sensors[sensor_count - 1]};
  grideye::Agent agent("esp-1", arguments[1], pointers, sensor_count);
  Controller controller;
  std::vector<char> body(grideye::POST_BYTES_MAX + 40 * grideye::FRAME_BYTES_MAX);
  int port = 0;
  bool is_deaf = false;
  uint64_t next_post_ns = 0, posts = 0;
  char command[16], value[256];
  while (scanf("%15s %255s", command, value) == 2) {
    const std::string what = command;
    const uint64_t number = strtoull(value, nullptr, 10);
    uint64_t now_ns;
    check(amg8833_now_ns(&bus, &now_ns), "now");
    if (what == "port") port = int(number);
    if (what == "deaf") is_deaf = number != 0;
    // The host is kept from reading.
    if (what == "stall") check(amg8833_advance_ns(&bus, number * AMG8833_MS), "stall");
    if (what == "unplug" || what == "brown-out") {
      const amg8833_fault fault = amg8833_fault_of(what == "unplug" ? AMG8833_FAULT_UNPLUGGED : AMG8833_FAULT_BROWN_OUT);
      if (number) check(amg8833_set_fault(&bus, ADDRESSES[0], &fault), command);
      else check(amg8833_clear_faults(&bus, ADDRESSES[0]), command);
    }
    const uint64_t end_ns = now_ns + (what == "run" ? number * AMG8833_MS : 0);
    while (now_ns < end_ns) {
      check(amg8833_advance_ns(&bus, 5 * AMG8833_MS), "advance");
      check(amg8833_now_ns(&bus, &now_ns), "now");
      const grideye::Moment now = {now_ns, UTC_NS + int64_t(now_ns), now_ns > 2000 * AMG8833_MS};
      for (auto &sensor : sensors) sensor.poll(controller, now);
      if (now_ns < next_post_ns) continue;
      const size_t length = agent.post(body.data(), body.size(), now);
      if (!length) return fprintf(stderr, "no room for a post\n"), 2;
      std::string answer;
      const int status = post(port, body.data(), length, is_deaf, &answer);
      posts += status == 200;
      if (status != 200 && status != 0) fprintf(stderr, "%d %s\n%.*s\n", status, answer.c_str(), int(length), body.data());
      next_post_ns = now_ns + agent.answered(status, answer.c_str()) * AMG8833_MS;
    }
    printf("{\"posts\":%llu,\"failed\":%llu,\"sensors\":[", static_cast<unsigned long long>(posts), static_cast<unsigned long long>(agent.failed()));
    for (size_t at = 0; at < sensor_count; at++) {
      const auto &sensor = sensors[at];
      printf("%s{\"read\":%llu,\"missing\":%llu,\"dropped\":%llu,\"kept\":%llu}", at ? "," : "", static_cast<unsigned long long>(sensor.read()), static_cast<unsigned long long>(sensor.missing()), static_cast<unsigned long long>(sensor.dropped()), static_cast<unsigned long long>(sensor.kept()));
    }
    printf("]}\n");
    fflush(stdout);
  }
  return 0;
}

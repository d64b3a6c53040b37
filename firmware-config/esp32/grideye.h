// What the sketch does without an ESP32: reads AMG8833 sensors, numbers and stamps their frames, keeps them until the collector
// has them on disk, and writes its posts. Plain C++11 without Arduino and without allocation, so that it also runs on a PC
// (tests/tests/esp32.rs runs it on the emulated sensor and the real collector).
//
// Units: nanoseconds for times, raw words of the registers for temperatures (0.25 °C a step, thermistor 0.0625 °C).
#pragma once

#include <inttypes.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

namespace grideye {

const int PIXELS = 64;
// Bytes that the controller's buffer must hold: a frame in one burst, as the datasheet demands, and some for the address.
const size_t BUS_BUFFER_BYTES = 136;
// The longest JSON of one frame, and of a post without frames.
const size_t FRAME_BYTES_MAX = 533, POST_BYTES_MAX = 1536;
const uint64_t MS = 1000000;

// An I2C controller. Each call is one transaction; the result is null, or why it failed, by the wire's names: "nack",
// "bus-error", "bus-timeout", "short-transfer".
class Bus {
 public:
  virtual ~Bus() {}
  virtual const char *write(uint8_t address, uint8_t reg, uint8_t value) = 0;
  // Writes the register's number, then reads after a repeated START.
  virtual const char *read(uint8_t address, uint8_t reg, uint8_t *bytes, size_t count) = 0;
};

// Guards a ring between the task that reads and the one that posts.
class Lock {
 public:
  virtual ~Lock() {}
  virtual void take() {}
  virtual void give() {}
};

// The device's clocks: since its start, never back; and UTC, once NTP has set it.
struct Moment {
  uint64_t boot_ns;
  int64_t utc_ns;
  bool is_synced;
};

struct Frame {
  uint64_t seq;
  uint64_t boot_ns;
  int64_t utc_ns;
  const char *clock;
  // Why there is no frame; null if there is one.
  const char *missing;
  uint16_t thermistor;
  uint16_t pixels[PIXELS];
};

// One sensor, with its frames that the collector does not have yet. The oldest leaves when a new one finds no room.
class Sensor {
 public:
  // `name` is the sensor's on the wire, for example "0x69"; `ring` has room for `capacity` frames.
  Sensor(const char *name, uint8_t address, Frame *ring, size_t capacity, Lock *lock)
      : name_(name), address_(address), ring_(ring), capacity_(capacity), lock_(lock) {}

  // Takes the sensor's next step: call it every 25 ms or more often. Whether a frame was read.
  bool poll(Bus &bus, const Moment &now) {
    if (now.boot_ns < next_step_ns_) return false;
    if (state_ != READS) return set_up(bus, now), false;
    next_step_ns_ = now.boot_ns + POLL_NS;
    uint8_t bytes[2 * PIXELS], thermistor[2];
    const char *fault = bus.read(address_, 0x80, bytes, sizeof bytes);
    if (!fault) fault = bus.read(address_, 0x0E, thermistor, sizeof thermistor);
    if (!fault) fault = implausible(bytes);
    if (fault) return miss(fault, now), false;
    missed_since_ns_ = 0;
    const uint64_t before_ns = seen_ns_;
    seen_ns_ = now.boot_ns;
    const bool is_new = !has_last_ || memcmp(bytes, last_, sizeof bytes) != 0;
    // A frame without noise may equal the one before.
    if (!is_new && now.boot_ns - last_ns_ < frame_ns_ + EQUAL_NS) return false;
    // Between two looks in time, one frame came.
    if (has_last_ && now.boot_ns - before_ns > frame_ns_ / 2) skip("host-stalled", now);
    Frame frame = stamped(!has_last_ ? now.boot_ns : is_new ? came(before_ns, now.boot_ns) : last_ns_ + frame_ns_, now);
    for (int pixel = 0; pixel < PIXELS; pixel++) {
      frame.pixels[pixel] = (bytes[2 * pixel] | bytes[2 * pixel + 1] << 8) & 0x0FFF;
    }
    frame.thermistor = (thermistor[0] | thermistor[1] << 8) & 0x0FFF;
    memcpy(last_, bytes, sizeof last_);
    has_last_ = true;
    push(frame);
    return true;
  }

  const char *name() const { return name_; }
  // Counts since the start: frames read, known to be missed, dropped for want of room, and kept now.
  uint64_t read() const { return read_; }
  uint64_t missing() const { return missing_; }
  uint64_t dropped() const { return dropped_ + refused_; }
  uint64_t kept() const { return kept_frames_ + unsure_; }
  const char *fault() const { return fault_; }

 private:
  friend class Agent;
  enum State { WAKES, RESETS, CLEARS, SETTLES, READS };

  static const size_t KINDS = 8;
  static const uint64_t FRAME_NS = 100 * MS;
  static const uint64_t POLL_NS = 25 * MS;
  // How long after its time a frame is taken for one that equals the one before.
  static const uint64_t EQUAL_NS = 40 * MS;
  // What one look tells of the sensor's rate at most.
  static const int64_t LATE_MAX_NS = 8 * int64_t(MS);

  // Datasheet, 4.11: normal mode, 50 ms, initial reset, 2 ms, flag reset; two frames later its registers are valid.
  void set_up(Bus &bus, const Moment &now) {
    static const struct { uint8_t reg, value; uint16_t wait_ms; } STEPS[] = {
        {0x00, 0x00, 50}, {0x01, 0x3F, 2}, {0x01, 0x30, 0}, {0x02, 0x00, 200}};
    const char *fault = bus.write(address_, STEPS[state_].reg, STEPS[state_].value);
    if (fault) {
      state_ = WAKES;
      next_step_ns_ = now.boot_ns + FRAME_NS;
      if (has_last_) skip(fault, now);
      return count(fault);
    }
    next_step_ns_ = now.boot_ns + STEPS[state_].wait_ms * MS;
    state_ = State(state_ + 1);
  }

  // A sensor that gives no frame for two of them may have lost its power: it is set up again.
  void miss(const char *fault, const Moment &now) {
    count(fault);
    if (!missed_since_ns_) missed_since_ns_ = now.boot_ns;
    if (has_last_) skip(fault, now);
    if (now.boot_ns - missed_since_ns_ < 2 * FRAME_NS) return;
    missed_since_ns_ = 0;
    state_ = WAKES;
    next_step_ns_ = now.boot_ns;
  }

  // Numbers the frames that passed since the last one, but for the one that the registers hold now.
  void skip(const char *why, const Moment &now) {
    while (now.boot_ns - last_ns_ >= 2 * frame_ns_) {
      Frame frame = stamped(last_ns_ + frame_ns_, now);
      frame.missing = why;
      push(frame);
    }
  }

  // When a new frame came: where the sensor's own clock had it, but between the looks before and after it. That clock is
  // followed in phase and rate.
  uint64_t came(uint64_t before_ns, uint64_t now_ns) {
    const uint64_t expected_ns = last_ns_ + frame_ns_;
    const uint64_t came_ns = expected_ns < before_ns ? before_ns : expected_ns > now_ns ? now_ns : expected_ns;
    int64_t late_ns = int64_t(came_ns) - int64_t(expected_ns);
    if (late_ns > LATE_MAX_NS) late_ns = LATE_MAX_NS;
    if (late_ns < -LATE_MAX_NS) late_ns = -LATE_MAX_NS;
    frame_ns_ = uint64_t(int64_t(frame_ns_) + late_ns / 16);
    if (frame_ns_ < FRAME_NS - FRAME_NS / 10) frame_ns_ = FRAME_NS - FRAME_NS / 10;
    if (frame_ns_ > FRAME_NS + FRAME_NS / 10) frame_ns_ = FRAME_NS + FRAME_NS / 10;
    return came_ns;
  }

  Frame stamped(uint64_t boot_ns, const Moment &now) {
    Frame frame = {};
    frame.boot_ns = boot_ns;
    frame.utc_ns = now.utc_ns - int64_t(now.boot_ns - boot_ns);
    frame.clock = now.is_synced ? "synced" : "unsynced";
    const int64_t lead = now.utc_ns - int64_t(now.boot_ns), step = lead - lead_ns_;
    if (now.is_synced && has_lead_ && (step > STEP_NS || step < -STEP_NS)) frame.clock = "stepped";
    has_lead_ = now.is_synced;
    lead_ns_ = lead;
    return frame;
  }

  void push(Frame &frame) {
    lock_->take();
    frame.seq = next_++;
    last_ns_ = frame.boot_ns;
    if (kept_ == capacity_) drop_oldest();
    ring_[(first_ + kept_++) % capacity_] = frame;
    (frame.missing ? missing_ : read_)++;
    if (!frame.missing) kept_frames_++;
    lock_->give();
  }

  void drop_oldest() {
    const Frame &oldest = ring_[first_];
    if (!oldest.missing) {
      kept_frames_--;
      // What was sent may be stored, though its answer was lost: the next answer tells.
      const bool is_sent = sent_from_ <= oldest.seq && oldest.seq < sent_to_;
      (is_sent ? unsure_ : dropped_)++;
    }
    first_ = (first_ + 1) % capacity_;
    kept_--;
  }

  // Forgets the frames before `end`; how many were no missing ones.
  uint64_t settle(uint64_t end) {
    const uint64_t before = kept_frames_;
    while (kept_ > 0 && ring_[first_].seq < end) {
      if (!ring_[first_].missing) kept_frames_--;
      first_ = (first_ + 1) % capacity_;
      kept_--;
    }
    return before - kept_frames_;
  }

  void count(const char *fault) {
    lock_->take();
    fault_ = fault;
    size_t kind = 0;
    while (errors_[kind].name && strcmp(errors_[kind].name, fault) != 0 && kind + 1 < KINDS) kind++;
    errors_[kind].name = fault;
    errors_[kind].count++;
    lock_->give();
  }

  // Words that no room gives: a dead link or a sensor without a frame yet, and a data line that is stuck.
  static const char *implausible(const uint8_t *bytes) {
    bool all_zero = true, all_set = true;
    for (int at = 0; at < 2 * PIXELS; at++) {
      all_zero = all_zero && bytes[at] == 0x00;
      all_set = all_set && bytes[at] == 0xFF;
    }
    return all_zero ? "all-zero" : all_set ? "stuck-high" : nullptr;
  }

  static const int64_t STEP_NS = 500 * int64_t(MS);

  const char *name_;
  const uint8_t address_;
  Frame *const ring_;
  const size_t capacity_;
  Lock *const lock_;
  State state_ = WAKES;
  uint64_t next_step_ns_ = 0, seen_ns_ = 0, missed_since_ns_ = 0, frame_ns_ = FRAME_NS;
  uint8_t last_[2 * PIXELS] = {};
  bool has_last_ = false, has_lead_ = false;
  uint64_t last_ns_ = 0, next_ = 0;
  int64_t lead_ns_ = 0;
  size_t first_ = 0, kept_ = 0;
  uint64_t read_ = 0, missing_ = 0, dropped_ = 0, kept_frames_ = 0, refused_ = 0;
  struct { const char *name; uint64_t count; } errors_[KINDS] = {};
  // The last post's rows, and a bit for each that is a frame; how many of those are no longer kept, and may be stored.
  uint64_t sent_from_ = 0, sent_to_ = 0, sent_frames_ = 0, unsure_ = 0;
  const char *fault_ = nullptr;
};

// Writes text into a buffer that was promised to be large enough; `is_cut` tells if it was not.
class Text {
 public:
  Text(char *out, size_t capacity) : out_(out), capacity_(capacity) {}

  void add(const char *format, ...) __attribute__((format(printf, 2, 3))) {
    va_list values;
    va_start(values, format);
    const int wanted = vsnprintf(out_ + length_, capacity_ - length_, format, values);
    va_end(values);
    is_cut = is_cut || wanted < 0 || size_t(wanted) >= capacity_ - length_;
    if (!is_cut) length_ += size_t(wanted);
  }

  size_t length() const { return is_cut ? 0 : length_; }
  bool is_cut = false;

 private:
  char *const out_;
  const size_t capacity_;
  size_t length_ = 0;
};

// All sensors of a device, and its posts: one at a time, each answered or given up before the next.
class Agent {
 public:
  // `boot` is a name that this start of the device alone has, for example a random number.
  Agent(const char *device, const char *boot, Sensor *const *sensors, size_t count)
      : device_(device), boot_(boot), sensors_(sensors), count_(count) {}

  // Writes the body of the next `POST /v1/frames`: as many of the oldest frames as find room, or after a post without an
  // answer none, until the collector answers again. Its length; 0 if `out` is smaller than POST_BYTES_MAX and a frame of
  // each sensor.
  size_t post(char *out, size_t capacity, const Moment &now) {
    if (capacity < POST_BYTES_MAX + count_ * FRAME_BYTES_MAX) return 0;
    size_t frames_max = (capacity - POST_BYTES_MAX) / FRAME_BYTES_MAX / count_;
    if (frames_max > SENT_MAX) frames_max = SENT_MAX;
    Text text(out, capacity);
    text.add("{\"device\":\"%s\",\"boot\":\"%s\",\"t_sent_boot_ns\":%" PRIu64 ",\"sensors\":[", device_, boot_, now.boot_ns);
    for (size_t at = 0; at < count_; at++) {
      Sensor &sensor = *sensors_[at];
      sensor.lock_->take();
      text.add("%s{\"sensor\":\"%s\",\"account\":", at ? "," : "", sensor.name_);
      account(text, sensor);
      text.add(",\"frames\":[");
      if (!is_in_doubt_) frames(text, sensor, frames_max);
      sensor.lock_->give();
      text.add("]}");
    }
    text.add("]}");
    return text.length();
  }

  // Takes the answer to the last post: its HTTP status, 0 or less if there was none, and its body. How many milliseconds
  // to wait before the next one.
  uint32_t answered(int status, const char *body) {
    const bool is_stored = status == 200;
    // These would be refused again: the frames are dropped and counted, so that the next ones get through.
    const bool is_refused = status == 400 || status == 409 || status == 413 || status == 422;
    if (!is_stored && !is_refused) {
      is_in_doubt_ = true;
      failed_++;
      const uint32_t pause_ms = pause_ms_;
      pause_ms_ = pause_ms_ < PAUSE_MAX_MS / 2 ? 2 * pause_ms_ : PAUSE_MAX_MS;
      return pause_ms;
    }
    bool is_behind = is_in_doubt_;
    is_in_doubt_ = false;
    pause_ms_ = POST_EVERY_MS;
    for (size_t at = 0; at < count_; at++) {
      Sensor &sensor = *sensors_[at];
      sensor.lock_->take();
      is_refused ? refuse(sensor) : acknowledge(sensor, body);
      is_behind = is_behind || sensor.kept_ > BEHIND;
      sensor.lock_->give();
    }
    return is_behind ? 0 : POST_EVERY_MS;
  }

  // The last post was handed to somebody who delivers it, such as an MQTT broker: its frames are no longer kept here.
  void handed_over() {
    for (size_t at = 0; at < count_; at++) {
      Sensor &sensor = *sensors_[at];
      sensor.lock_->take();
      sensor.settle(sensor.sent_to_);
      sensor.unsure_ = 0;
      sensor.lock_->give();
    }
  }

  // Posts that were not answered, or that the collector could not take then.
  uint64_t failed() const { return failed_; }

  static const uint32_t POST_EVERY_MS = 500, PAUSE_MAX_MS = 30000;

 private:
  // Rows of a sensor in one post, as many as an integer has bits.
  static const size_t SENT_MAX = 64;
  // More frames than come between two posts.
  static const size_t BEHIND = 10;

  static void frames(Text &text, Sensor &sensor, size_t frames_max) {
    sensor.sent_from_ = sensor.sent_to_ = sensor.next_ - sensor.kept_;
    sensor.sent_frames_ = 0;
    for (size_t index = 0; index < sensor.kept_ && index < frames_max; index++) {
      const Frame &kept = sensor.ring_[(sensor.first_ + index) % sensor.capacity_];
      if (index) text.add(",");
      frame(text, kept);
      sensor.sent_to_ = kept.seq + 1;
      if (!kept.missing) sensor.sent_frames_ |= uint64_t(1) << index;
    }
  }

  static void acknowledge(Sensor &sensor, const char *body) {
    uint64_t through;
    if (!durable_through(body, sensor.name_, &through)) return;
    const uint64_t kept_from = sensor.next_ - sensor.kept_;
    for (uint64_t seq = sensor.sent_from_; seq < sensor.sent_to_ && seq < kept_from; seq++) {
      const bool is_frame = sensor.sent_frames_ >> (seq - sensor.sent_from_) & 1;
      sensor.dropped_ += is_frame && (seq > through || is_gap(body, sensor.name_, seq));
    }
    sensor.unsure_ = 0;
    sensor.sent_from_ = sensor.sent_to_;
    sensor.settle(through + 1);
  }

  static void refuse(Sensor &sensor) {
    sensor.refused_ += sensor.settle(sensor.sent_to_) + sensor.unsure_;
    sensor.unsure_ = 0;
    sensor.sent_from_ = sensor.sent_to_;
  }

  static void account(Text &text, const Sensor &sensor) {
    text.add("{\"read\":%" PRIu64 ",\"missing\":%" PRIu64 ",\"dropped\":{", sensor.read_, sensor.missing_);
    if (sensor.dropped_) text.add("\"ring-full\":%" PRIu64, sensor.dropped_);
    if (sensor.refused_) text.add("%s\"refused\":%" PRIu64, sensor.dropped_ ? "," : "", sensor.refused_);
    text.add("},\"spooled\":%" PRIu64 ",\"errors\":{", sensor.kept());
    for (size_t kind = 0; kind < Sensor::KINDS && sensor.errors_[kind].name; kind++) {
      text.add("%s\"%s\":%" PRIu64, kind ? "," : "", sensor.errors_[kind].name, sensor.errors_[kind].count);
    }
    text.add("}}");
  }

  static void frame(Text &text, const Frame &frame) {
    text.add("{\"seq\":%" PRIu64 ",\"t_boot_ns\":%" PRIu64 ",\"t_utc_ns\":%" PRId64 ",\"clock\":\"%s\"", frame.seq, frame.boot_ns, frame.utc_ns, frame.clock);
    if (frame.missing) return text.add(",\"missing\":\"%s\"}", frame.missing);
    text.add(",\"thermistor_raw\":%u,\"pixels_raw\":[", frame.thermistor);
    for (int pixel = 0; pixel < PIXELS; pixel++) text.add("%s%u", pixel ? "," : "", frame.pixels[pixel]);
    text.add("]}");
  }

  // The number after the first `"name":` from `from` on, before `end`.
  static bool number(const char *from, const char *end, const char *name, uint64_t *value) {
    const size_t length = strlen(name);
    for (const char *at = from; at && (at = strstr(at, name)) && at < end; at += length) {
      if (at[-1] != '"' || strncmp(at + length, "\":", 2) != 0) continue;
      *value = strtoull(at + length + 2, nullptr, 10);
      return true;
    }
    return false;
  }

  static bool durable_through(const char *body, const char *sensor, uint64_t *through) {
    const char *from = strstr(body, "\"durable_through\":{");
    const char *end = from ? strchr(from, '}') : nullptr;
    return end && number(from, end, sensor, through);
  }

  static bool is_gap(const char *body, const char *sensor, uint64_t seq) {
    const size_t length = strlen(sensor);
    for (const char *at = strstr(body, "\"gaps\":["); at && (at = strstr(at, "{\"sensor\":\""));) {
      at += 11;
      const char *end = strchr(at, '}');
      uint64_t from, to;
      if (!end || !number(at, end, "from", &from) || !number(at, end, "to", &to)) return false;
      if (strncmp(at, sensor, length) == 0 && at[length] == '"' && from <= seq && seq <= to) return true;
    }
    return false;
  }

  const char *const device_;
  const char *const boot_;
  Sensor *const *const sensors_;
  const size_t count_;
  bool is_in_doubt_ = false;
  uint32_t pause_ms_ = POST_EVERY_MS;
  uint64_t failed_ = 0;
};

}  // namespace grideye

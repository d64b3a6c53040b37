#!/usr/bin/env node
/*
 * An RP2040 whose I2C0 and I2C1 are buses of the emulated machine: runs a firmware file in rp2040js, as a client of the socket
 * (../src/socket/PROTOCOL.md). Both share one clock: the firmware's cycles move the machine's time.
 *
 *     npm install rp2040js                     (1.4 was tried)
 *     grideye emulate --scene SCENE --speed 0 --scl instant --socket /tmp/bus -- node grideye_rp2040.mjs firmware.uf2 [OPTIONS]
 *
 *     --seconds N      ends after N seconds of the firmware
 *     --until TEXT     ends with code 0 when UART0 printed TEXT, with 124 when the time is over first
 *     --int N=GPIO     the GPIO at the INT pin of sensor N, counted from 0
 *     --bus N          the bus at I2C0 (default 1); I2C1 is the next
 *     --bootrom FILE   the boot ROM, for firmware that calls it: that of the Pico SDK and of arduino-pico does
 *     --socket PATH    default: the variable GRIDEYE_I2C_SOCKET, which `grideye emulate` sets
 *
 * FIRMWARE is UF2 or ELF. UART0 is standard input and output.
 */
import { readFileSync, writeSync } from "node:fs";
import { createRequire } from "node:module";
import { connect } from "node:net";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";

const [HELLO, STEP, STOP, PASS] = [1, 4, 5, 6];
const [WELCOME, DONE, PASSED] = [0x81, 0x82, 0x86];
const PASS_MAX_NS = 1_000_000_000;
const LOOK_EVERY_NS = 500_000;
const CYCLE_NS = 8; // 125 MHz
const [FLASH, RAM, RAM_END] = [0x10000000, 0x20000000, 0x20042000];
const AFTER_BOOT2 = FLASH + 0x100;
const CODE_TIME_OVER = 124;

function fail(problem, hint) {
  console.error(`error: ${problem}\nhint: ${hint}`);
  process.exit(2);
}

/* Requests and answers, one at a time. */
class Machine {
  constructor(path) {
    this.arrived = Buffer.alloc(0);
    this.stream = connect(path);
    this.stream.on("error", (error) => fail(`the emulator is not there: ${error.message}`, "start `grideye emulate --socket PATH`"));
    this.stream.on("close", () => this.waiting && fail("the emulator has ended", "see what it printed"));
    this.stream.on("data", (bytes) => this.take(bytes));
  }

  take(bytes) {
    this.arrived = Buffer.concat([this.arrived, bytes]);
    const length = this.arrived.length < 4 ? Infinity : this.arrived.readUInt32LE();
    if (this.arrived.length < 4 + length) return;
    const answer = this.arrived.subarray(4, 4 + length);
    this.arrived = this.arrived.subarray(4 + length);
    const waiting = this.waiting;
    this.waiting = undefined;
    waiting(answer);
  }

  ask(kind, body = Buffer.alloc(0)) {
    const head = Buffer.alloc(5);
    head.writeUInt32LE(1 + body.length);
    head[4] = kind;
    this.stream.write(Buffer.concat([head, body]));
    return new Promise((resolve) => (this.waiting = resolve));
  }

  async greet() {
    const answer = await this.ask(HELLO, Buffer.from("i2ce\x01\x00"));
    if (answer[0] !== WELCOME) fail("the emulator speaks another version of the protocol", "use the file that came with it");
  }

  /* Brings the machine's time to this many nanoseconds of the firmware; returns the levels of the INT pins. */
  async meet(firmwareNs) {
    for (;;) {
      // A fault that holds the bus moves the machine ahead; the firmware catches up.
      const due = this.startNs === undefined ? 0 : this.startNs + firmwareNs - this.ns;
      const body = Buffer.alloc(11);
      body.writeBigUInt64LE(BigInt(Math.round(Math.min(Math.max(due, 0), PASS_MAX_NS))));
      body.writeUInt16LE(0xffff, 8);
      const answer = await this.ask(PASS, body);
      if (answer[0] !== PASSED) fail("the emulator's time cannot be moved", "start it with --speed 0");
      this.ns = Number(answer.readBigUInt64LE(1));
      this.startNs ??= this.ns - firmwareNs;
      if (this.ns + 1 >= this.startNs + firmwareNs) return answer.subarray(11);
    }
  }

  /* One step of the open transaction; returns the byte that was read, true, or false if it was not acknowledged. */
  async step(bus, address, reads, byte) {
    const length = byte === undefined ? 0 : 1;
    const body = Buffer.alloc(10 + (reads ? 0 : length));
    body.writeUInt32LE(bus);
    body.writeUInt16LE(address, 4);
    body.writeUInt16LE(reads ? 1 : 0, 6);
    body.writeUInt16LE(length, 8);
    if (!reads && length) body[10] = byte;
    const answer = await this.ask(STEP, body);
    return answer[0] === DONE && (reads && length ? answer[3] : true);
  }
}

/* Loads UF2 or ELF; returns the first address of the firmware. */
function load(chip, file) {
  const image = readFileSync(file);
  const put = (address, bytes) => {
    const [start, memory] = address >= RAM ? [RAM, chip.sram] : [FLASH, chip.flash];
    if (address < FLASH || address - start + bytes.length > memory.length)
      fail(`${file} has code at 0x${address.toString(16)}, where an RP2040 has no memory`, "link it for the RP2040");
    memory.set(bytes, address - start);
  };
  const addresses = [];
  const segment = (address, bytes) => {
    put(address, bytes);
    addresses.push(address);
  };
  if (image.length > 512 && image.readUInt32LE() === 0x0a324655) {
    for (let at = 0; at + 512 <= image.length; at += 512)
      segment(image.readUInt32LE(at + 12), image.subarray(at + 32, at + 32 + image.readUInt32LE(at + 16)));
  } else if (image.length > 52 && image.readUInt32BE() === 0x7f454c46) {
    if (image[4] !== 1 || image.readUInt16LE(18) !== 40) fail(`${file} is an ELF file for another chip`, "link it for the RP2040 (32 bits, ARM)");
    const [table, size, count] = [image.readUInt32LE(28), image.readUInt16LE(42), image.readUInt16LE(44)];
    for (let at = table; at < table + size * count; at += size) {
      const [offset, address, bytes] = [4, 12, 16].map((field) => image.readUInt32LE(at + field));
      if (image.readUInt32LE(at) === 1 && bytes > 0) segment(address, image.subarray(offset, offset + bytes));
    }
  } else {
    fail(`${file} is neither UF2 nor ELF`, "give the file that the SDK or the linker wrote");
  }
  return Math.min(...addresses);
}

/* Starts at the boot ROM's hand-over if there is one, else at the reset vector itself. */
function start(chip, first, bootrom) {
  if (bootrom) {
    const image = readFileSync(bootrom);
    chip.loadBootrom(new Uint32Array(image.buffer.slice(image.byteOffset, image.byteOffset + image.length)));
    chip.core.PC = first;
    return;
  }
  const isTable = (address) => {
    const [stack, entry] = [chip.readUint32(address), chip.readUint32(address + 4)];
    return stack > RAM && stack <= RAM_END && entry & 1 && entry >= FLASH && entry < RAM_END;
  };
  const table = [first, AFTER_BOOT2].find(isTable);
  if (table === undefined) fail("the firmware has no vector table", "it needs one at its start, or behind the 256 bytes of boot2");
  chip.core.VTOR = table;
  chip.core.SP = chip.readUint32(table);
  chip.core.PC = chip.readUint32(table + 4) & ~1;
}

/* The simulator, installed where it is started or beside this file. */
function simulator() {
  for (const place of [join(process.cwd(), "here"), fileURLToPath(import.meta.url)]) {
    try {
      return createRequire(place)("rp2040js");
    } catch (error) {
      if (error.code !== "MODULE_NOT_FOUND") throw error;
    }
  }
  return fail("rp2040js is missing", "npm install rp2040js, in the folder where this is started");
}

const option = (type) => ({ type });
let given;
try {
  given = parseArgs({
    allowPositionals: true,
    options: {
      seconds: option("string"), until: option("string"), bus: option("string"), bootrom: option("string"),
      socket: option("string"), int: { type: "string", multiple: true },
    },
  });
} catch (error) {
  fail(error.message, "grideye_rp2040.mjs FIRMWARE [--seconds N] [--until TEXT] [--int N=GPIO] [--bus N] [--bootrom FILE]");
}
const { values, positionals } = given;
const number = (name, text, usual) => {
  const value = Number(text ?? usual);
  return Number.isFinite(value) && value >= 0 ? value : fail(`--${name} ${text} is no number`, "give a number, 0 or above");
};
const path = values.socket ?? process.env.GRIDEYE_I2C_SOCKET;
if (positionals.length !== 1) fail("one firmware file is expected", "grideye_rp2040.mjs FIRMWARE [OPTIONS]");
if (!path) fail("no socket is named", "run it by `grideye emulate --speed 0 --socket PATH -- node …`, or give --socket PATH");
const endNs = number("seconds", values.seconds, 0) * 1e9 || Infinity;
const firstBus = number("bus", values.bus, 1);

const { Simulator } = simulator();
const { rp2040: chip, clock } = new Simulator();
let isFound = false;
let hasEnded = false;
let printed = "";
let transactions = 0;
chip.onBreak = () => (hasEnded = true);
const pins = (values.int ?? []).map((text) => {
  const [sensor, gpio] = text.split("=").map(Number);
  const pin = chip.gpio[gpio] ?? fail(`--int ${text} names no pin`, "give the sensor's place and a GPIO: --int 0=2");
  pin.setInputValue(true);
  return { sensor, pin };
});
try {
  start(chip, load(chip, positionals[0]), values.bootrom);
} catch (error) {
  if (!error.path) throw error;
  fail(`${error.path} cannot be read: ${error.code}`, "check the path");
}
const machine = new Machine(path);
await machine.greet();

// What the firmware waits for: it stands still meanwhile, so that both keep one clock.
let pending = machine.meet(0);
const show = async () => {
  const levels = await machine.meet(clock.nanos);
  for (const { sensor, pin } of pins) if (sensor < levels.length) pin.setInputValue(levels[sensor] === 1);
};
chip.i2c.forEach((i2c, place) => {
  const bus = firstBus + place;
  let address;
  let isOpen = false;
  let isReading = false;
  // A byte and its acknowledge take nine clocks; the answer counts from their start and is seen at their end.
  const after = (answer, tell) => {
    pending = answer.then((value) => {
      const bitNs = (i2c.sclLowPeriod + i2c.sclHighPeriod) * CYCLE_NS;
      clock.createAlarm(() => tell(value)).schedule(9 * bitNs);
    });
  };
  const step = async (reads, byte) => {
    await machine.meet(clock.nanos);
    return machine.step(bus, address, reads, byte);
  };
  i2c.onConnect = (target, mode) => {
    // Within a transaction the direction changes, or a read goes on with the one before.
    const goesOn = isOpen && isReading && mode === 1 && target === address;
    transactions += isOpen ? 0 : 1;
    [address, isOpen, isReading] = [target, true, mode === 1];
    after(goesOn ? Promise.resolve(true) : step(isReading), (answers) => i2c.completeConnect(answers));
  };
  i2c.onWriteByte = (byte) => after(step(false, byte), (answers) => i2c.completeWrite(answers));
  i2c.onReadByte = () => after(step(true, 0), (byte) => i2c.completeRead(byte === false ? 0xff : byte));
  i2c.onStop = () => {
    isOpen = false;
    pending = machine.meet(clock.nanos).then(() => machine.ask(STOP)).then(() => i2c.completeStop());
  };
});
chip.uart[0].onByte = (byte) => {
  writeSync(1, Buffer.from([byte]));
  if (values.until === undefined) return;
  printed = (printed + String.fromCharCode(byte)).slice(-Buffer.byteLength(values.until));
  isFound ||= printed === Buffer.from(values.until).toString("latin1");
};
process.stdin.on("data", (bytes) => bytes.forEach((byte) => chip.uart[0].feedByte(byte)));
process.stdin.on("error", () => {});

const started = process.hrtime.bigint();
let lookAtNs = 0;
while (!isFound && !hasEnded && clock.nanos < endNs) {
  if (pending) {
    const wait = pending;
    pending = undefined;
    await wait;
  } else if (clock.nanos >= lookAtNs) {
    lookAtNs = clock.nanos + LOOK_EVERY_NS;
    await show();
    await new Promise(setImmediate); // the serial input
  } else if (chip.core.waiting) {
    const nextNs = clock.nanosToNextAlarm || LOOK_EVERY_NS;
    clock.tick(Math.min(nextNs, lookAtNs - clock.nanos));
  } else {
    const { core } = chip;
    do clock.tick(core.executeInstruction() * CYCLE_NS);
    while (!pending && !core.waiting && !isFound && clock.nanos < lookAtNs);
  }
}
const taken = Number(process.hrtime.bigint() - started) / 1e9;
const emulated = clock.nanos / 1e9;
console.error(`${positionals[0]}: ${emulated.toFixed(3)} s of an RP2040 in ${taken.toFixed(3)} s, ` +
  `${(emulated / taken).toFixed(2)} times real time; ${transactions} transactions by I2C`);
process.exit(values.until !== undefined && !isFound ? CODE_TIME_OVER : 0);

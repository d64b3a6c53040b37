// The 128 bytes of a frame, by every call of i2c-bus that reads more than a byte, as JSON.
//
//   node frame.js FOLDER-OF-PACKAGES
'use strict';

const i2c = require(`${process.argv[2]}/node_modules/i2c-bus`);

const SENSOR = 0x69;
const FIRST = 0x80;
const FRAME_BYTES = 128;
const BLOCK_BYTES = 32;

const pointer = Buffer.from([FIRST]);
const fresh = () => Buffer.alloc(FRAME_BYTES);

function atOnce() {
  const bus = i2c.openSync(1);
  const said = {};
  let frame = fresh();
  const lengths = [bus.i2cWriteSync(SENSOR, 1, pointer), bus.i2cReadSync(SENSOR, FRAME_BYTES, frame)];
  said['i2cWriteSync, i2cReadSync'] = [...frame];
  frame = fresh();
  for (let at = 0; at < FRAME_BYTES; at += BLOCK_BYTES) {
    bus.readI2cBlockSync(SENSOR, FIRST + at, BLOCK_BYTES, frame.subarray(at));
  }
  said.readI2cBlockSync = [...frame];
  frame = fresh();
  for (let at = 0; at < FRAME_BYTES; at += 2) frame.writeUInt16LE(bus.readWordSync(SENSOR, FIRST + at), at);
  said.readWordSync = [...frame];
  said.addresses = bus.scanSync();
  bus.closeSync();
  return { said, lengths };
}

async function promised() {
  const bus = await i2c.openPromisified(1);
  const said = {};
  let frame = fresh();
  const written = await bus.i2cWrite(SENSOR, 1, pointer);
  const read = await bus.i2cRead(SENSOR, FRAME_BYTES, frame);
  said['i2cWrite, i2cRead'] = [...frame];
  frame = fresh();
  for (let at = 0; at < FRAME_BYTES; at += BLOCK_BYTES) {
    await bus.readI2cBlock(SENSOR, FIRST + at, BLOCK_BYTES, frame.subarray(at));
  }
  said.readI2cBlock = [...frame];
  await bus.close();
  return { said, lengths: [written.bytesWritten, read.bytesRead] };
}

promised().then(later => {
  const first = atOnce();
  const lengths = [...first.lengths, ...later.lengths];
  console.log(JSON.stringify({ lengths, ...first.said, ...later.said }));
});

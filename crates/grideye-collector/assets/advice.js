// What a person does about each fault, in a sentence. Names are those of the wire: crates/grideye-recording/README.md.

import { byKind, duration } from "./words.js";

const FAULTS = {
  "nack": "The sensor does not answer at its address: check its wiring and power, and 0x68 against 0x69 (the AD_SELECT pin).",
  "bus-error": "The bus is disturbed: shorten the wires, keep them from mains and motors, and check the pull-ups.",
  "bus-timeout": "Something holds the bus low: switch the sensor's power off and on, and look for a shorted wire.",
  "bus-hung": "The bus stood still and was set free: if it happens often, check power and pull-ups.",
  "unplugged": "The bus itself has gone: plug the adapter in again, or switch I2C on (raspi-config, Interface Options).",
  "short-transfer": "Transfers end too early: try another adapter or a slower bus.",
  "host-stalled": "The computer was busy for longer than a frame lasts: run less beside the agent, or give it a higher priority.",
  "not-ready": "The sensor starts or was reset: wait 2 s; if it stays, its power fails under load.",
  "stuck-high": "All wires read 1: the sensor is without power, or SDA is not connected.",
  "all-zero": "All words are 0: the sensor is in reset, or SDA is shorted to ground.",
  "frozen": "The same frame again and again: the sensor measures no more; switch its power off and on.",
  "wrong-configuration": "The sensor lost its settings and was set up again: its power dips; add a capacitor near it.",
  "glitch-pixel": "Single pixels jump for one frame: check the supply for ripple.",
  "out-of-step": "Updates of the sensor came where none was due: its supply dips, or another program reads it as well.",
  "gap-not-listed": "A gap was too long to be listed row by row: its frames count as missing, and nothing is to be done.",
  "missing-rows-dropped": "Rows that only say why a frame is missing were dropped to make room: check the network.",
  "other": "More kinds of faults than one count tells apart: look at the agent's log (journalctl -u grideye-agent).",
  "count-estimated": "After a stall the number of frames missed was estimated: run less beside the agent.",
  "thermistor-late": "The thermistor was read behind its frame, because the computer was busy.",
  "backlog-forbidden": "Frames of an earlier run are refused: the device's token changed or was revoked; join again.",
  "ring-full": "Frames came faster than they could be sent or kept: check the network, and let the agent spool to disk.",
  "spool-full": "The spool has reached its size: bring the collector back, or raise the spool's limit in agent.toml.",
  "spool-disk-full": "The device's disk is full: free some room.",
  "spool-read-only": "The spool's folder cannot be written: check the disk and its rights.",
  "spool-failed": "The spool's disk fails: look at dmesg and replace the card.",
  "spool-slow": "The device's disk is slow to write, and a loss of power costs more frames than stated: see what else writes to it.",
  "spool-damaged": "A part of the spool was unreadable and was set aside: look at dmesg and replace the card.",
  "lost-in-memory": "The agent was killed or lost power with frames still in memory; spool.mode = \"always\" narrows that to one sync.",
};

// Frames that the collector would not take, counted by the HTTP status of its answer.
const REFUSED = "The collector refused frames: what they hold and why is in the agent's spool folder, under quarantine.";

const CLOCKS = {
  unsynced: "Its clock was never set: give it a network with NTP. Until then times count from its start.",
  stepped: "Its clock was just set by a jump: times before and after do not compare.",
};

const BACKLOG_NOTED = 100;

/** What to do about a device, most pressing first; nothing where all is well. */
export function adviceFor(device, isSilent) {
  const sentences = [];
  if (isSilent) sentences.push("It is silent: see that the agent runs (systemctl status grideye-agent) and reaches this address.");
  const runs = device.rivals ?? [];
  if (runs.length > 0) sentences.push(`Two agents send as ${device.device} (runs ${runs.join(", ")}): give each its own \`device\` in agent.toml.`);
  const recent = new Set(device.recent_faults);
  for (const [kind] of countedOf(device).filter(([kind]) => recent.has(kind))) {
    const sentence = kind.startsWith("refused-") ? REFUSED : FAULTS[kind];
    if (sentence && !sentences.includes(sentence)) sentences.push(sentence);
  }
  if (CLOCKS[device.clock]) sentences.push(CLOCKS[device.clock]);
  if (device.backlog > BACKLOG_NOTED) sentences.push("Frames wait on the device and are being sent; they come in behind the live ones.");
  return sentences;
}

/** What was counted in this run and happens no more: a device is not to be looked at for that. */
export function pastOf(device, recent_s) {
  const recent = new Set(device.recent_faults);
  const past = byKind(Object.fromEntries(countedOf(device).filter(([kind]) => !recent.has(kind))));
  return past === "" ? "" : `Past, and not in the last ${duration(recent_s)}: ${past}.`;
}

/** Everything that is counted, the most frequent first. */
function countedOf(device) {
  const kinds = Object.entries({ ...device.dropped, ...device.errors }).filter(([, count]) => count > 0);
  return kinds.sort((a, b) => b[1] - a[1]);
}

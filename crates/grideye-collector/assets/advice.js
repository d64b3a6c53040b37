// How to fix each fault, in one sentence. Names are those of the wire: recordings/README.md.

import { byKind, duration } from "./words.js";

const FAULTS = {
  "nack": "The sensor does not answer at its address: check wiring, power and the address (0x68 or 0x69, pin AD_SELECT).",
  "bus-error": "The bus is disturbed: shorten the wires, keep them away from mains and motors, and check the pull-ups.",
  "bus-timeout": "Something holds the bus low: switch the sensor's power off and on, and look for a shorted wire.",
  "bus-hung": "The bus hung and was recovered: if this repeats, check power and pull-ups.",
  "unplugged": "The bus is gone: plug the adapter in again, or enable I2C (raspi-config, Interface Options).",
  "short-transfer": "Transfers end too early: try another adapter or a slower bus.",
  "host-stalled": "The computer was busy for longer than one frame: run less beside the agent, or raise the agent's priority.",
  "not-ready": "The sensor is starting or was reset: wait 2 s. If this stays, its power fails under load.",
  "stuck-high": "All bits read 1: the sensor has no power, or SDA is not connected.",
  "all-zero": "All words are 0: the sensor is in reset, or SDA is shorted to ground.",
  "frozen": "The sensor repeats one frame: switch its power off and on.",
  "wrong-configuration": "The sensor lost its settings and was set up again because its supply dips: add a capacitor near it.",
  "glitch-pixel": "Single pixels jump for one frame: check the supply for ripple.",
  "out-of-step": "The sensor updated when no update was due: its supply dips, or another program reads it too.",
  "gap-not-listed": "A gap was too long to list row by row: its frames count as missing. You need to do nothing.",
  "missing-rows-dropped": "Rows that only say why a frame is missing were dropped to make room: check the network.",
  "other": "The agent saw more kinds of faults than it counts separately: read its log (journalctl -u grideye-agent).",
  "count-estimated": "After a stall the number of missing frames was estimated: run less beside the agent.",
  "thermistor-late": "The thermistor was read after its frame because the computer was busy.",
  "backlog-forbidden": "The collector refuses frames of an earlier boot because the device's token changed or was revoked: join again.",
  "ring-full": "Frames came faster than the agent could send or store them: check the network, and turn the agent's spool on.",
  "spool-full": "The spool is full: bring the collector back, or raise the spool's limit in agent.toml.",
  "spool-disk-full": "The device's disk is full: free some space.",
  "spool-read-only": "The agent cannot write its spool folder: check the disk and the folder's permissions.",
  "spool-failed": "The spool's disk fails: read dmesg and replace the card.",
  "spool-slow": "The device's disk is slow, so a power cut costs more frames than stated: find what else writes to it.",
  "spool-damaged": "Part of the spool was unreadable and was set aside: read dmesg and replace the card.",
  "lost-by-collector": "The collector's store was replaced by an older one, and the agent no longer holds these frames: restore a newer backup, if there is one.",
  "lost-in-memory": "The agent was killed or lost power with frames in memory: set spool.mode = \"always\" to lose at most one sync.",
};

// Frames that the collector refused, counted by the HTTP status of its answer.
const REFUSED = "The collector refused frames: the agent's spool folder lists them and the reasons under quarantine.";

const CLOCKS = {
  unsynced: "The device's clock was never set: give it a network with NTP. Until then its times count from its start.",
  stepped: "The device's clock just jumped: times before and after do not compare.",
};

const BACKLOG_NOTED = 100;

/** What to do about a device, most pressing first; nothing where all is well. */
export function adviceFor(device, isSilent) {
  const sentences = [];
  if (isSilent) sentences.push("The device is silent: check that the agent runs (systemctl status grideye-agent) and reaches this address, and that its token was not revoked (grideye token list).");
  const boots = device.rivals ?? [];
  if (boots.length > 0) sentences.push(`Two agents send as ${device.device} (boots ${boots.join(", ")}): give each its own \`device\` in agent.toml.`);
  const recent = new Set(device.recent_faults);
  for (const [kind] of countedOf(device).filter(([kind]) => recent.has(kind))) {
    const sentence = kind.startsWith("refused-") ? REFUSED : FAULTS[kind];
    if (sentence && !sentences.includes(sentence)) sentences.push(sentence);
  }
  if (CLOCKS[device.clock]) sentences.push(CLOCKS[device.clock]);
  if (device.backlog > BACKLOG_NOTED) sentences.push("The device is sending spooled frames; they arrive after the live ones.");
  return sentences;
}

/** Faults of this boot that no longer happen, so nobody looks at a device because of them. */
export function pastOf(device, recent_s) {
  const recent = new Set(device.recent_faults);
  const past = byKind(Object.fromEntries(countedOf(device).filter(([kind]) => !recent.has(kind))));
  return past === "" ? "" : `Earlier, but not in the last ${duration(recent_s)}: ${past}.`;
}

/** Everything counted, most frequent first. */
function countedOf(device) {
  const kinds = Object.entries({ ...device.dropped, ...device.errors }).filter(([, count]) => count > 0);
  return kinds.sort((a, b) => b[1] - a[1]);
}

// What `grideye demo` recorded: a line above the panel that ends in the verdict and the report.

import { ask } from "./ask.js";
import { count } from "./words.js";

const ASK_MS = 500;

const line = Object.assign(document.createElement("p"), { id: "recorded", className: "panel", role: "status" });
line.textContent = "Recording. The verdict and a link to the report appear here.";
document.querySelector("#wall").prepend(line);
follow();

async function follow() {
  const { recorded } = await ask("/v1/opening");
  if (!recorded) {
    setTimeout(follow, ASK_MS);
    return;
  }
  const { recording, name, frames, verdict } = recorded;
  const link = (href, textContent) => Object.assign(document.createElement("a"), { href, textContent });
  line.dataset.verdict = verdict.replace(" ", "_");
  line.replaceChildren(`Recorded ${name}, ${count(frames, "frame", "frames")}. `, strong(`Verdict: ${verdict}. `), link("/report", "Open the report"), " ", link(`#recording=${recording}`, "Play the recording"));
}

function strong(text) {
  return Object.assign(document.createElement("strong"), { textContent: text });
}

// What `grideye demo` recorded: a line under the panel that ends in the report.

import { ask } from "./ask.js";
import { count } from "./words.js";

const ASK_MS = 500;

const line = Object.assign(document.createElement("p"), { id: "recorded", className: "panel", role: "status" });
line.textContent = "Recording. A link to its report appears here.";
document.querySelector("#beside").after(line);
follow();

async function follow() {
  const { recorded } = await ask("/v1/opening");
  if (!recorded) {
    setTimeout(follow, ASK_MS);
    return;
  }
  const { recording, name, frames } = recorded;
  const link = (href, textContent) => Object.assign(document.createElement("a"), { href, textContent });
  line.replaceChildren(`Recorded ${name}, ${count(frames, "frame", "frames")}. `, link("/report", "Open the report"), " ", link(`#recording=${recording}`, "Play the recording"));
}

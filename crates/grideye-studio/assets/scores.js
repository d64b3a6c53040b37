// The verdict, and the scores beside those of chance and of the sensor itself.

import { fieldsOf, say } from "./words.js";

const VERDICTS = {
  agrees: ["Agrees", "The sensor sees what this scene predicts. A blank frame, shuffled pixels or the room without people would have scored lower."],
  disagrees: ["Disagrees", "The sensor does not see what this scene predicts. Something is elsewhere or has another temperature, or the sensor is turned or mirrored."],
  cannot_tell: ["Cannot tell", "These frames cannot distinguish this scene from a wrong one. They are evidence neither for it nor against it."],
};
// Name on the wire, title, decimals, factor, unit.
const SHOWN = [
  ["correlation", "C, correlation", 2, 1, ""],
  ["gain", "Gain over the blank frame", 2, 1, ""],
  ["mutual_information_grey", "EMI, mutual information", 2, 1, " bit"],
  ["image_similarity", "IS, image similarity", 0, 100, " %"],
  ["rmse", "Root mean square", 2, 1, " °C"],
];

export class Scores {
  #root;
  #fields;

  constructor(root) {
    this.#root = root;
    this.#fields = fieldsOf(root);
  }

  /** Shows why there is no verdict. */
  none(why) {
    this.#show("none", "No verdict yet", why);
    this.#list([]);
    say(this.#fields.because, "");
    say(this.#fields.window, "");
    this.#fields.scores.replaceChildren();
  }

  /** Shows the collector's answer. */
  show(answer) {
    if (!answer.comparison) {
      this.none(sentence(answer.why ?? "no frames were compared"));
      return;
    }
    const { verdict, reasons, would_change: change, scores } = answer.comparison;
    this.#show(verdict, ...(VERDICTS[verdict] ?? [verdict, ""]));
    say(this.#fields.because, reasons[0] ?? "");
    this.#list([...reasons, `What would change it: ${change}`]);
    say(this.#fields.window, windowOf(answer));
    this.#fields.scores.replaceChildren(...SHOWN.filter(([name]) => scores[name]).map((shown) => row(shown, scores[shown[0]])));
  }

  #show(state, title, meaning) {
    this.#root.dataset.verdict = state;
    say(this.#fields.verdict, title);
    say(this.#fields.chip, title);
    say(this.#fields.meaning, meaning);
  }

  #list(texts) {
    const list = this.#fields.reasons;
    if (list.dataset.texts === texts.join("\n")) return;
    list.dataset.texts = texts.join("\n");
    list.replaceChildren(...texts.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  }
}

function windowOf({ frames, seconds, from_s: from, to_s: to, comparison }) {
  const where = comparison.protocol === "dynamic" ? `, seconds ${from.toFixed(1)} to ${to.toFixed(1)} of the scene` : "";
  return `Compared: ${comparison.real_frames} of the ${frames} frames of ${seconds.toFixed(1)} s${where}.`;
}

function row([, title, decimals, scale, unit], score) {
  const line = document.createElement("tr");
  const head = Object.assign(document.createElement("th"), { textContent: title, scope: "row" });
  const number = (value) => (value === null || value === undefined ? "–" : `${plain(value * scale, decimals)}${unit}`);
  const values = [score.value, score.blank, score.shuffled?.mean, score.ceiling].map(number);
  line.append(head, ...values.map((text) => Object.assign(document.createElement("td"), { textContent: text })));
  return line;
}

/** A rounded zero has no sign. */
function plain(value, decimals) {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

function sentence(text) {
  const [what, hint] = text.split("\nhint: ");
  const whole = hint ? `${what}; ${hint}` : what;
  return `${whole[0].toUpperCase()}${whole.slice(1)}.`;
}

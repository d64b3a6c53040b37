// The verdict in one sentence, and the scores with their floors and ceiling.

import { fieldsOf, say, sayMarked } from "./words.js";

// Name on the wire, its label, decimals, and its factor.
const SHOWN = [
  ["correlation", "C, correlation", 2, 1, ""],
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
    sayMarked(this.#fields.because, "");
    say(this.#fields.window, "");
    this.#fields.scores.replaceChildren();
  }

  /** Shows the collector's answer. */
  show(answer) {
    if (!answer.comparison) {
      this.none(sentence(answer.why ?? "no frames were compared"));
      return;
    }
    const { verdict, headline, next_step: next, reasons, scores } = answer.comparison;
    const [title, found] = headline.split(/: (.*)/s);
    this.#show(verdict, title, `${found[0].toUpperCase()}${found.slice(1)}`);
    sayMarked(this.#fields.because, next === "" ? "" : `Next: ${next}`);
    this.#list(reasons.slice(1));
    say(this.#fields.window, windowOf(answer));
    this.#fields.scores.replaceChildren(...SHOWN.filter(([name]) => scores[name]).map((shown) => row(shown, scores[shown[0]])));
  }

  #show(state, title, meaning) {
    this.#root.dataset.verdict = state;
    say(this.#fields.verdict, title);
    sayMarked(this.#fields.meaning, meaning);
  }

  #list(texts) {
    const list = this.#fields.reasons;
    if (list.dataset.texts === texts.join("\n")) return;
    list.dataset.texts = texts.join("\n");
    list.replaceChildren(...texts.map(() => document.createElement("li")));
    texts.forEach((text, index) => sayMarked(list.children[index], text));
  }
}

function windowOf({ seconds, from_s: from, to_s: to, comparison }) {
  const where = comparison.protocol === "dynamic" ? `, seconds ${from.toFixed(1)} to ${to.toFixed(1)} of the scene` : "";
  return `Compared: ${seconds.toFixed(1)} s${where}.`;
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

// The list of everything in a scene. Arrow keys select the next item.

import { WORDS, choices, isSame, itemOf } from "./things.js";
import { say } from "./words.js";

export class ThingList {
  #list;
  #choices = [];
  #on;

  constructor(list, on) {
    this.#list = list;
    this.#on = on;
    list.addEventListener("click", (event) => {
      const option = event.target.closest("[role=option]");
      if (option) on.choose(this.#choices[[...list.children].indexOf(option)]);
    });
    list.addEventListener("keydown", (event) => this.#key(event));
  }

  show(scene, chosen) {
    this.#choices = choices(scene);
    while (this.#list.children.length > this.#choices.length) this.#list.lastElementChild.remove();
    while (this.#list.children.length < this.#choices.length) this.#list.append(option(this.#list.children.length));
    this.#choices.forEach((choice, index) => this.#label(this.#list.children[index], scene, choice, chosen));
    const place = this.#place(chosen);
    const shown = place < 0 ? null : this.#list.children[place].id;
    if (shown !== null && shown !== this.#list.getAttribute("aria-activedescendant")) scrollInList(this.#list, this.#list.children[place]);
    if (place < 0) this.#list.removeAttribute("aria-activedescendant");
    else this.#list.setAttribute("aria-activedescendant", this.#list.children[place].id);
  }

  /** Selects the item `by` places further, in a circle. */
  next(chosen, by) {
    const place = this.#place(chosen);
    const from = place < 0 && by < 0 ? 0 : place;
    this.#on.choose(this.#choices[(from + by + this.#choices.length) % this.#choices.length]);
  }

  #place(chosen) {
    return this.#choices.findIndex((choice) => chosen !== null && isSame(choice, chosen));
  }

  #label(element, scene, choice, chosen) {
    const item = itemOf(scene, choice);
    const [kind, name, about] = element.children;
    const is = chosen !== null && isSame(choice, chosen);
    element.setAttribute("aria-selected", String(is));
    element.dataset.of = choice.row === undefined ? choice.kind : "waypoint";
    say(kind, choice.row === undefined ? WORDS[choice.kind] : "waypoint");
    say(name, choice.row === undefined ? (item?.name ?? "") : String(choice.row + 1));
    say(about, item === null || choice.row !== undefined ? "" : aboutOf(item));
  }

  #key(event) {
    const at = this.#choices.findIndex((_, index) => this.#list.children[index].getAttribute("aria-selected") === "true");
    const last = this.#choices.length - 1;
    const to = { ArrowUp: Math.max(0, at - 1), ArrowDown: Math.min(last, at + 1), Home: 0, End: last }[event.key];
    if (to === undefined || event.ctrlKey || event.altKey || event.metaKey) return;
    this.#on.choose(this.#choices[to]);
    event.preventDefault();
    event.stopPropagation();
  }
}

/** Scrolls only the list, so that the page does not move under the pointer. */
function scrollInList(list, { offsetTop: top, offsetHeight: height }) {
  if (top < list.scrollTop) list.scrollTop = top;
  else if (top + height > list.scrollTop + list.clientHeight) list.scrollTop = top + height - list.clientHeight;
}

const POSTURES = { stand: "stands", walk: "walks", sit: "sits", lie: "lies" };

/** What the drawings do not show: that an item is left out, what a person does, or how warm it is. */
function aboutOf(item) {
  if (item.keys.present === false) return "not present";
  if (item.kind === "sensor") return "";
  if (item.kind === "object" && item.bodies.length === 0) return "outside the room, left out";
  if (item.keys.person) return POSTURES[item.keys.person.posture ?? (item.way ? "walk" : "stand")] ?? "";
  const celsius = item.keys.temperature_c ?? item.bodies?.[0]?.celsius;
  return celsius === undefined ? "" : `${celsius} °C`;
}

function option(index) {
  const element = document.createElement("li");
  element.id = `thing-${index}`;
  element.setAttribute("role", "option");
  element.append(...["kind", "name", "about"].map((className) => Object.assign(document.createElement("span"), { className })));
  return element;
}

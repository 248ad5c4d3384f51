// The buttons of the film: the first flights with an outcome, and the starts. Each stays the same
// element while what it says changes, so that neither a click nor the keyboard's focus is lost.

import { number } from "touchdown/common/format.js";
import { STARTS } from "touchdown/watch/trials.js";

/** @typedef {import("touchdown/watch/trials.js").Trials} Trials */

/** What the first episode or flight with an outcome is called. */
export const FIRSTS = /** @type {const} */ ([
  ["crashed", "first crash"],
  ["timed out", "first time-out"],
  ["landed", "first landing"],
]);

export class Marks {
  /** @type {[string, HTMLButtonElement][]} */
  #buttons;

  /**
   * @param {HTMLElement} place
   * @param {(outcome: string) => void} choose
   */
  constructor(place, choose) {
    this.#buttons = FIRSTS.map(([outcome, text]) => {
      const button = newButton(text, () => choose(outcome));
      button.dataset["outcome"] = outcome;
      button.hidden = true;
      return [outcome, button];
    });
    place.replaceChildren(...this.#buttons.map(([, button]) => button));
  }

  /** @param {Trials} trials */
  update(trials) {
    for (const [outcome, button] of this.#buttons) button.hidden = !trials.first(outcome);
  }
}

export class Starts {
  /** @type {[number, HTMLButtonElement][]} */
  #buttons;

  /**
   * @param {HTMLElement} place
   * @param {(start: number) => void} choose
   */
  constructor(place, choose) {
    this.#buttons = STARTS.map((start) => [start, newButton("…", () => choose(start))]);
    place.replaceChildren(...this.#buttons.map(([, button]) => button));
  }

  /** @param {Trials} trials @param {number|null} policy @param {number} chosen the start */
  update(trials, policy, chosen) {
    for (const [start, button] of this.#buttons) {
      const trial = policy === null ? undefined : trials.at(policy, start);
      button.dataset["outcome"] = trial?.outcome ?? "";
      button.setAttribute("aria-pressed", String(start === chosen));
      button.title = `start ${start}: ${trial?.outcome ?? "not flown yet"}`;
      button.textContent = trial ? number(trial.episodeReturn) : "…";
    }
  }
}

/** @param {string} text @param {() => void} clicked */
function newButton(text, clicked) {
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = text;
  button.addEventListener("click", clicked);
  return button;
}

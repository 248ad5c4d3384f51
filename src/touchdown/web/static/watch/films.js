// Which run flies on the stage: one at a time, of those that the page can fly.

import { readBinary } from "touchdown/common/data.js";
import { loadEngine } from "touchdown/engine/engine.js";
import { Film } from "touchdown/watch/film.js";

/** @typedef {import("touchdown/watch/history.js").RunHistory} RunHistory */
/** @typedef {import("touchdown/watch/source.js").Source} Source */

export class Films {
  /** @type {Map<string, RunHistory>} */
  #flyable = new Map();
  /** @type {Film|null} */
  #film = null;
  #engine = loadEngine(readBinary("lander.wasm"));
  #loading = false;

  /**
   * @param {HTMLElement} place
   * @param {HTMLElement} details
   * @param {Source} source
   * @param {ConstructorParameters<typeof Film>[5]} look
   */
  constructor(place, details, source, look) {
    this.place = place;
    this.details = details;
    this.source = source;
    this.look = look;
    this.which = /** @type {HTMLSelectElement} */ (place.querySelector("#which"));
    this.which.addEventListener("change", () => void this.#open());
  }

  /** @param {RunHistory[]} histories */
  update(histories) {
    const found = histories.filter(canFly);
    const known = [...this.#flyable.keys()].join();
    if (found.map((each) => each.key).join() !== known) {
      this.#flyable = new Map(found.map((each) => [each.key, each]));
      const chosen = this.which.value;
      this.which.replaceChildren(...found.map((each) => new Option(each.label, each.key)));
      if (this.#flyable.has(chosen)) this.which.value = chosen;
      this.which.hidden = found.length < 2;
    }
    this.place.hidden = !found.length;
    if (this.#film) this.#film.update();
    else if (found.length) void this.#open();
  }

  /** Flies a training episode of a run. @param {string} run @param {number} episode */
  async flyEpisode(run, episode) {
    if (!this.#flyable.has(run)) return;
    if (this.which.value !== run) {
      this.which.value = run;
      await this.#open();
    }
    await this.#film?.flyEpisode(episode);
    if (this.place.getBoundingClientRect().top > innerHeight)
      this.place.scrollIntoView({ block: "start" });
  }

  async #open() {
    if (this.#loading) return;
    this.#loading = true;
    try {
      const engine = await this.#engine;
      const history = this.#flyable.get(this.which.value);
      if (!history || this.#film?.history === history) return;
      this.#film?.close();
      this.#film = new Film(this.place, this.details, engine, this.source, history, this.look);
    } finally {
      this.#loading = false;
    }
  }
}

/** Whether the page has something of a run to fly. @param {RunHistory} history */
function canFly(history) {
  const facts = history.facts;
  return !!facts?.can_replay && (facts.policies.length > 0 || facts.has_best || facts.has_flights);
}

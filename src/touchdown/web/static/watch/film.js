// The film of learning: a slider over the saved policies, which fly the same starts; and training
// episodes as they were.

import { replay } from "touchdown/watch/flight.js";
import { number } from "touchdown/watch/cards.js";
import { NetworkView } from "touchdown/watch/network-view.js";
import { Stage } from "touchdown/watch/stage.js";
import { policyName, STARTS, Trials } from "touchdown/watch/trials.js";
import { drawAlongFlight, drawOverTraining } from "touchdown/watch/values.js";

/** @typedef {import("touchdown/engine/engine.js").Engine} Engine */
/** @typedef {import("touchdown/engine/engine.js").NetworkPolicy} NetworkPolicy */
/** @typedef {import("touchdown/watch/flight.js").Flown} Flown */
/** @typedef {import("touchdown/watch/history.js").RunHistory} RunHistory */
/** @typedef {import("touchdown/watch/source.js").Source} Source */
/** @typedef {import("touchdown/watch/theme.js").Colours} Colours */

const MARKS = /** @type {const} */ ([
  ["crashed", "first crash"], ["timed out", "first hover"], ["landed", "first landing"],
]);

export class Film {
  /** @type {NetworkPolicy|null} */
  #network = null;
  /** @type {Flown|null} */
  #flown = null;
  #policy = -1;
  #start = STARTS[0] ?? 0;
  #request = 0;
  #overTraining = false;
  #follows = true;
  #episode = 0;
  #stale = false;

  /**
   * @param {HTMLElement} place
   * @param {HTMLElement} details
   * @param {Engine} engine
   * @param {Source} source
   * @param {RunHistory} history
   * @param {() => {colours: Colours, axis: import("touchdown/watch/history.js").Axis}} look
   */
  constructor(place, details, engine, source, history, look) {
    this.engine = engine;
    this.source = source;
    this.history = history;
    this.look = look;
    this.trials = new Trials(engine, source, history);
    this.trials.onTrial = () => this.#showTrials();
    const scene = query(place, ".film-stage", HTMLElement);
    this.slider = query(place, "#policy", HTMLInputElement);
    this.said = query(place, "#policy-said", HTMLOutputElement);
    this.marks = query(place, ".marks", HTMLElement);
    this.starts = query(place, ".starts", HTMLElement);
    this.through = query(place, "#through", HTMLButtonElement);
    this.back = query(place, "#back", HTMLButtonElement);
    this.caption = query(place, "#flight-said", HTMLElement);
    this.details = details;
    this.view = new NetworkView(query(details, "#network", HTMLCanvasElement));
    this.networkSaid = query(details, "#network-said", HTMLElement);
    this.along = query(details, "#along", HTMLElement);
    this.alongSaid = query(details, "#along-said", HTMLElement);
    this.over = query(details, "#over", HTMLElement);
    this.stage = new Stage(scene);
    this.stage.onStep = () => this.#drawNetwork();
    this.stage.onEnd = () => this.#next();
    this.slider.addEventListener("input", () => {
      this.#follows = this.slider.valueAsNumber === this.trials.policies.length - 1;
      this.#overTraining = false;
      this.#show();
    });
    this.through.addEventListener("click", () => {
      this.#overTraining = !this.#overTraining;
      this.#episode = 0;
      if (this.#overTraining) {
        this.#follows = false;
        if (this.slider.value === this.slider.max) this.slider.value = "0";
        this.stage.isPlaying = true;
        this.stage.speed = 4;
      }
      this.#show();
    });
    this.back.addEventListener("click", () => this.#show());
    this.update();
  }

  /** The run or the look has changed: more policies, another axis, light or dark. */
  update() {
    const policies = this.trials.policies;
    const last = policies.length - 1;
    this.slider.max = String(Math.max(0, last));
    this.slider.disabled = last < 1;
    this.through.disabled = last < 1;
    const isLate = this.#follows && !this.#episode && policies[last] !== this.#policy;
    if (isLate) this.slider.value = String(last);
    if (last >= 0 && (isLate || !this.#flown)) this.#show();
    this.#showTrials();
    this.#drawNetwork();
    void this.trials.run();
  }

  /** Flies a training episode as it was. @param {number} episode */
  async flyEpisode(episode) {
    const request = ++this.#request;
    this.#overTraining = false;
    this.#episode = episode;
    try {
      const recorded = await this.source.episode(this.history.key, episode);
      const flown = replay(this.engine, recorded);
      if (request !== this.#request) return;
      const row = this.history.episodes.get("episode").indexOf(episode);
      const steps = this.history.episodes.get("env_steps")[row] ?? 0;
      const saved = this.history.facts?.policies ?? [];
      const before = saved.findLast((at) => at <= steps - recorded.steps);
      const network = before === undefined ? null : await this.trials.network(before);
      if (request !== this.#request) return network?.free();
      const known = this.history.episodes.get("episode_return")[row];
      this.#take(flown, `training episode ${number(episode)}`, network, before ?? 0);
      this.caption.textContent = `Training episode ${number(episode)} from start ${recorded.start}, with ` +
        `its random actions: ${ending(flown)}` +
        (known === undefined ? "." : `; recorded return ${number(known, 1)}.`);
      this.back.hidden = false;
      this.caption.dataset["return"] = String(flown.returns.at(-1));
    } catch (error) {
      this.#fail(request, error);
    }
  }

  close() {
    this.#request++;
    this.#network?.free();
  }

  #next() {
    const last = Number(this.slider.max);
    if (!this.#overTraining) return this.stage.seek(0);
    if (this.slider.valueAsNumber >= last) {
      this.#overTraining = false;
      this.#showThrough();
      return this.stage.seek(0);
    }
    this.slider.value = String(this.slider.valueAsNumber + 1);
    return void this.#show();
  }

  /** The policy at the slider flies the chosen start. */
  async #show() {
    const request = ++this.#request;
    const place = this.slider.valueAsNumber;
    const policy = this.trials.policies[place];
    this.#episode = 0;
    this.back.hidden = true;
    this.#showThrough();
    if (policy === undefined) return;
    const count = this.trials.policies.length;
    const name = policyName(policy);
    this.said.textContent = count > 1 ? `${name}, ${place + 1} of ${count}` : name;
    this.slider.setAttribute("aria-valuetext", this.said.textContent);
    try {
      const network = await this.trials.network(policy);
      const flown = await this.trials.fly(policy, this.#start);
      if (request !== this.#request) return network.free();
      this.#take(flown, name, network, policy);
      this.caption.textContent = `Greedy flight from start ${this.#start}: ${ending(flown)}.`;
      this.#showTrials();
    } catch (error) {
      this.#fail(request, error);
    }
  }

  /** @param {Flown} flown @param {string} label @param {NetworkPolicy|null} network @param {number} policy */
  #take(flown, label, network, policy) {
    this.#network?.free();
    this.#network = network;
    this.#flown = flown;
    this.#policy = policy;
    this.details.hidden = !network;
    if (network) {
      const dead = this.view.take(network, flown);
      this.networkSaid.textContent = deadSaid(dead, network, this.history);
      const gamma = this.history.facts?.settings?.gamma ?? 1;
      this.alongSaid.textContent =
        (this.#episode ? `Q of the policy ${policyName(policy)}, before this episode. ` : "") +
        `Returned: the sum of the rewards that followed, discounted by γ = ${gamma}.` +
        (flown.outcome === "timed out" ? " The time limit cut it off." : "");
    }
    this.#stale = true;
    this.stage.take(flown, label);
    this.#drawValues();
  }

  #drawValues() {
    if (!this.#network || !this.#flown || !this.#stale) return;
    this.#stale = false;
    void drawAlongFlight(this.along, this.#network, this.#flown, this.history, this.look().colours);
  }

  #drawNetwork() {
    const observation = this.#flown?.observations[this.stage.step];
    if (!this.#network || !observation) return;
    const scale = this.history.facts?.settings?.reward_scale ?? 1;
    this.view.draw(this.#network, observation, this.look().colours, scale);
  }

  #showThrough() {
    this.through.textContent = this.#overTraining ? "Stop the film" : "Play the film of learning";
  }

  /** The marks of the slider, the starts, and Q over training. */
  #showTrials() {
    const { policies } = this.trials;
    const last = Math.max(1, policies.length - 1);
    this.marks.replaceChildren(...MARKS.flatMap(([outcome, text]) => {
      const place = this.trials.first(outcome);
      if (place < 0) return [];
      const mark = document.createElement("button");
      mark.type = "button";
      mark.textContent = text;
      mark.dataset["outcome"] = outcome;
      mark.style.setProperty("--at", String(place / last));
      mark.addEventListener("click", () => this.#goTo(place, outcome));
      return [mark];
    }));
    const policy = policies[this.slider.valueAsNumber];
    this.starts.replaceChildren(...STARTS.map((start) => this.#startButton(start, policy)));
    if (this.trials.problem) this.caption.textContent = `It cannot be flown here: ${this.trials.problem}`;
    if (!this.details.hidden) {
      const { axis, colours } = this.look();
      void drawOverTraining(this.over, this.trials, axis, colours);
    }
  }

  /** @param {number} start @param {number|undefined} policy */
  #startButton(start, policy) {
    const trial = policy === undefined ? undefined : this.trials.at(policy, start);
    const button = document.createElement("button");
    button.type = "button";
    button.dataset["outcome"] = trial?.outcome ?? "";
    button.setAttribute("aria-pressed", String(start === this.#start));
    button.title = `start ${start}: ${trial?.outcome ?? "not flown yet"}`;
    button.textContent = trial ? number(trial.episodeReturn) : "…";
    button.addEventListener("click", () => {
      this.#start = start;
      void this.#show();
    });
    return button;
  }

  /** Shows the flight behind a mark. @param {number} place @param {string} outcome */
  #goTo(place, outcome) {
    const policy = this.trials.policies[place];
    this.#start = STARTS.find((start) =>
      policy !== undefined && this.trials.at(policy, start)?.outcome === outcome) ?? this.#start;
    this.slider.value = String(place);
    this.#follows = this.#overTraining = false;
    void this.#show();
  }

  /** @param {number} request @param {unknown} error */
  #fail(request, error) {
    if (request !== this.#request) return;
    this.caption.textContent = error instanceof Error ? error.message : String(error);
  }
}

/** @param {Flown} flown */
function ending(flown) {
  const value = flown.returns.at(-1) ?? 0;
  return `${flown.outcome ?? "not ended"}, return ${number(value, 1)}, ${flown.actions.length} steps`;
}

/** @param {number[]} dead @param {NetworkPolicy} network @param {RunHistory} history */
function deadSaid(dead, network, history) {
  const sizes = network.layerSizes.slice(1, -1);
  const colours = "Blue: positive, red: negative, relative to each unit's largest output in this flight.";
  if (history.facts?.settings?.activation !== "relu") return colours;
  const each = dead.map((count, place) => `${count} of ${sizes[place]}`);
  return `${colours} Framed: dead units, 0 throughout this flight (${each.join(", ")}).`;
}

/**
 * @template {Element} T
 * @param {ParentNode} place
 * @param {string} selector
 * @param {new () => T} kind
 * @returns {T}
 */
function query(place, selector, kind) {
  const found = place.querySelector(selector);
  if (!(found instanceof kind)) throw new Error(`the page has no ${selector}`);
  return found;
}

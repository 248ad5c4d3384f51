// The film of learning: a slider over the saved policies, which fly the same starts; and training
// episodes as they were.

import { part } from "touchdown/common/parts.js";
import { number } from "touchdown/common/format.js";
import { Marks, Starts } from "touchdown/watch/choices.js";
import { replay } from "touchdown/watch/flight.js";
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

export class Film {
  /** @type {NetworkPolicy|null} */
  #network = null;
  /** @type {Flown|null} */
  #flown = null;
  /** @type {number|null} the policy that flies, or will as soon as it is here */
  #policy = null;
  #start = STARTS[0] ?? 0;
  #request = 0;
  #overTraining = false;
  #follows = true;
  #episode = 0;
  #stale = false;
  #closing = new AbortController();

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
    const scene = part(place, ".film-stage", HTMLElement);
    this.slider = part(place, "#policy", HTMLInputElement);
    this.said = part(place, "#policy-said", HTMLOutputElement);
    this.marks = new Marks(part(place, ".marks", HTMLElement), (outcome) => this.#goToFirst(outcome));
    this.starts = new Starts(part(place, ".starts", HTMLElement), (start) => {
      this.#start = start;
      void this.#show();
    });
    this.through = part(place, "#through", HTMLButtonElement);
    this.back = part(place, "#back", HTMLButtonElement);
    this.caption = part(place, "#flight-said", HTMLElement);
    this.details = details;
    this.view = new NetworkView(part(details, "#network", HTMLCanvasElement));
    this.networkSaid = part(details, "#network-said", HTMLElement);
    this.along = part(details, "#along", HTMLElement);
    this.alongSaid = part(details, "#along-said", HTMLElement);
    this.over = part(details, "#over", HTMLElement);
    this.stage = new Stage(scene);
    this.stage.onStep = () => this.#drawNetwork();
    this.stage.onEnd = () => this.#next();
    const { signal } = this.#closing; // the elements stay on the page for the next film
    this.slider.addEventListener("input", () => {
      const { policies } = this.trials;
      this.#follows = this.slider.valueAsNumber === policies.length - 1;
      this.#overTraining = false;
      this.#policy = policies[this.slider.valueAsNumber] ?? this.#policy;
      void this.#show();
    }, { signal });
    this.through.addEventListener("click", () => this.#playOrStop(), { signal });
    this.back.addEventListener("click", () => void this.#show(), { signal });
    this.update();
  }

  /** The run or the look has changed: more policies, another axis, light or dark. */
  update() {
    const policies = this.trials.policies;
    const last = policies.length - 1;
    this.slider.max = String(Math.max(0, last));
    this.slider.disabled = last < 1;
    this.through.disabled = last < 1;
    const before = this.#policy;
    this.#policy = this.#chosen(policies);
    this.#sayPolicy();
    if (this.#policy !== before && !this.#episode) void this.#show();
    this.#showTrials();
    this.#drawNetwork();
    void this.trials.run();
  }

  /**
   * The policy to fly. The newest, if the film follows training; else the one that was chosen, or
   * if the run has deleted that one, the one before.
   * @param {number[]} policies
   */
  #chosen(policies) {
    const policy = this.#policy;
    const newest = policies.at(-1) ?? null;
    if (policy === null || (this.#follows && !this.#episode)) return newest;
    return policies.findLast((each) => each <= policy) ?? newest;
  }

  /** Where the policy is among those of the run. */
  get #place() {
    return this.#policy === null ? -1 : this.trials.policies.indexOf(this.#policy);
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

  /** Takes the film off the page, whose elements another one may use then. */
  close() {
    this.#request++;
    this.#closing.abort();
    this.trials.stop();
    this.stage.close();
    this.#network?.free();
    this.#network = null;
  }

  #playOrStop() {
    this.#overTraining = !this.#overTraining;
    if (this.#overTraining) {
      this.#follows = false;
      if (this.slider.value === this.slider.max) this.#policy = this.trials.policies[0] ?? null;
      this.stage.isPlaying = true;
      this.stage.speed = 4;
    }
    void this.#show();
  }

  #next() {
    if (!this.#overTraining) return this.stage.seek(0);
    const next = this.trials.policies[this.#place + 1];
    if (next === undefined) {
      this.#overTraining = false;
      this.#showThrough();
      return this.stage.seek(0);
    }
    this.#policy = next;
    return void this.#show();
  }

  /** The policy flies the chosen start. */
  async #show() {
    const request = ++this.#request;
    const policy = this.#policy;
    this.#episode = 0;
    this.back.hidden = true;
    this.#showThrough();
    if (policy === null) return;
    const name = policyName(policy);
    this.#sayPolicy();
    try {
      const network = await this.trials.network(policy);
      if (request !== this.#request) return network.free();
      const flown = this.#fly(network, policy);
      this.#take(flown, name, network, policy);
      this.caption.textContent = `Greedy flight from start ${this.#start}: ${ending(flown)}.`;
      this.#showTrials();
    } catch (error) {
      this.#fail(request, error);
    }
  }

  /** @param {NetworkPolicy} network freed if it cannot fly @param {number} policy */
  #fly(network, policy) {
    try {
      return this.trials.fly(network, policy, this.#start);
    } catch (error) {
      network.free();
      throw error;
    }
  }

  /** @param {Flown} flown @param {string} label @param {NetworkPolicy|null} network @param {number} policy */
  #take(flown, label, network, policy) {
    this.#network?.free();
    this.#network = network;
    this.#flown = flown;
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

  #sayPolicy() {
    if (this.#policy === null) return;
    const place = this.#place;
    const count = this.trials.policies.length;
    const name = policyName(this.#policy);
    const said = count > 1 ? `${name}, ${place + 1} of ${count}` : name;
    if (this.said.textContent !== said) this.said.textContent = said; // it is read aloud
    this.slider.value = String(place);
    this.slider.setAttribute("aria-valuetext", said);
  }

  #showThrough() {
    this.through.textContent = this.#overTraining ? "Stop the film" : "Play the film of learning";
  }

  /** The marks, the starts, and Q over training. */
  #showTrials() {
    this.marks.update(this.trials);
    this.starts.update(this.trials, this.#policy, this.#start);
    const problem = this.#policy === null ? "" : this.trials.problemOf(this.#policy);
    if (problem && !this.#episode) this.caption.textContent = `It cannot be flown here: ${problem}`;
    if (!this.details.hidden) {
      const { axis, colours } = this.look();
      void drawOverTraining(this.over, this.trials, axis, colours);
    }
  }

  /** Shows the first flight with an outcome. @param {string} outcome */
  #goToFirst(outcome) {
    const found = this.trials.first(outcome);
    if (!found) return;
    [this.#policy, this.#start] = found;
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

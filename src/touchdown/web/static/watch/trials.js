// Each saved policy of a run flies the same starts, a flight at a time while the page is idle.

import { expectations, flyPolicy, mean, returnsToGo } from "touchdown/watch/flight.js";

/** @typedef {import("touchdown/engine/engine.js").Engine} Engine */
/** @typedef {import("touchdown/engine/engine.js").NetworkPolicy} NetworkPolicy */
/** @typedef {import("touchdown/watch/history.js").RunHistory} RunHistory */
/** @typedef {import("touchdown/watch/source.js").Source} Source */
/** @typedef {import("touchdown/watch/flight.js").Flown} Flown */

/**
 * What one flight came to.
 * @typedef {object} Trial
 * @property {import("touchdown/engine/lander.js").Outcome|null} outcome
 * @property {number} episodeReturn
 * @property {number} steps
 * @property {number} expected mean of the largest Q over its states, in return points
 * @property {number} returned mean over its states of the discounted sum of the rewards that followed
 */

/** The first starts of the validations. */
export const STARTS = [1_000_000, 1_000_001, 1_000_002, 1_000_003, 1_000_004];

/** Stands for the best policy so far, of a run that saved no others. */
const BEST = -1;

/** What a policy is called. @param {number} policy */
export function policyName(policy) {
  if (policy === BEST) return "best policy so far";
  return policy === 0 ? "before training" : `after ${policy.toLocaleString("en")} steps`;
}

export class Trials {
  /** @type {Map<string, Trial>} by policy and start */
  #done = new Map();
  /** @type {Map<number, string>} why policies cannot be flown */
  #failed = new Map();
  #busy = false;
  #stopped = false;
  /** Called when another flight is done. @type {() => void} */
  onTrial = () => {};

  /**
   * @param {Engine} engine
   * @param {Source} source
   * @param {RunHistory} history
   */
  constructor(engine, source, history) {
    this.engine = engine;
    this.source = source;
    this.history = history;
  }

  /** Environment steps at the saved policies; [BEST] if only that was saved. */
  get policies() {
    const facts = this.history.facts;
    if (facts?.policies.length) return facts.policies;
    return facts?.has_best ? [BEST] : [];
  }

  /** @param {number} policy @param {number} start */
  at(policy, start) {
    return this.#done.get(`${policy}/${start}`);
  }

  /** A network that the caller frees. @param {number} policy */
  async network(policy) {
    return this.engine.newNetwork(await this.source.policy(this.history.key, policy === BEST ? "best" : policy));
  }

  /**
   * Flies a policy, and keeps what the flight came to.
   * @param {NetworkPolicy} network @param {number} policy whose network it is @param {number} start
   */
  fly(network, policy, start) {
    const flown = flyPolicy(this.engine, network, start);
    this.#note(policy, start, network, flown);
    return flown;
  }

  /** Flies what is missing, until all is done; a policy that cannot be flown is left out. */
  async run() {
    if (this.#busy) return;
    this.#busy = true;
    try {
      for (let next = this.#missing(); next; next = this.#missing()) {
        await idle();
        await this.#tryOut(...next);
        if (this.#stopped) return;
        this.onTrial();
      }
    } finally {
      this.#busy = false;
    }
  }

  /** Flies no more. */
  stop() {
    this.#stopped = true;
  }

  /** Why a policy cannot be flown; empty if it can. @param {number} policy */
  problemOf(policy) {
    return this.#failed.get(policy) ?? "";
  }

  /** The first policy with an outcome, and the start; null if there is none. @returns {[number, number]|null} */
  first(/** @type {string} */ outcome) {
    for (const policy of this.policies)
      for (const start of STARTS)
        if (this.at(policy, start)?.outcome === outcome) return [policy, start];
    return null;
  }

  /** @returns {[number, number]|null} */
  #missing() {
    if (this.#stopped) return null;
    for (const start of STARTS)
      for (const policy of this.policies)
        if (!this.at(policy, start) && !this.#failed.has(policy)) return [policy, start];
    return null;
  }

  /** @param {number} policy @param {number} start */
  async #tryOut(policy, start) {
    try {
      const network = await this.network(policy);
      try {
        if (!this.#stopped) this.fly(network, policy, start);
      } finally {
        network.free();
      }
    } catch (error) {
      this.#failed.set(policy, error instanceof Error ? error.message : String(error));
    }
  }

  /** @param {number} policy @param {number} start @param {NetworkPolicy} network @param {Flown} flown */
  #note(policy, start, network, flown) {
    const settings = this.history.facts?.settings;
    const gamma = settings?.gamma ?? 1;
    this.#failed.delete(policy);
    this.#done.set(`${policy}/${start}`, {
      outcome: flown.outcome,
      episodeReturn: flown.returns.at(-1) ?? 0,
      steps: flown.actions.length,
      expected: mean(expectations(network, flown, settings?.reward_scale ?? 1)),
      returned: mean(returnsToGo(flown.rewards, gamma)),
    });
  }
}

function idle() {
  return new Promise((resolve) => {
    if ("requestIdleCallback" in globalThis) requestIdleCallback(resolve, { timeout: 60 });
    else setTimeout(resolve, 20); // Safari has no other
  });
}

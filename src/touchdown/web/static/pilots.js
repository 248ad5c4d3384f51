// The policies that a page was made with.
import { HeuristicPolicy } from "touchdown/heuristic.js";
import { PidPolicy } from "touchdown/pid.js";
import { RandomPolicy } from "touchdown/random.js";

/** @typedef {import("touchdown/engine.js").Engine} Engine */
/** @typedef {import("touchdown/policy.js").Policy} Policy */
/**
 * @typedef {object} Described a policy as the page describes it
 * @property {string} name
 * @property {"network" | "pid" | "heuristic" | "random"} kind
 * @property {string} [file] of a network's weights
 * @property {import("touchdown/pid.js").Gains} [gains] of a PID controller
 */
/** @typedef {Map<string, (seed: number) => Policy>} Policies by name, for a start's seed */

/**
 * @param {Engine} engine
 * @param {Described[]} described
 * @param {(name: string) => Uint8Array<ArrayBuffer>} readBinary
 * @returns {Policies}
 */
export function makePolicies(engine, described, readBinary) {
  /** @type {Policies} */
  const policies = new Map();
  for (const { name, kind, file, gains } of described) {
    if (kind === "network") {
      const network = engine.newNetwork(readBinary(file ?? name));
      policies.set(name, () => network);
    } else if (kind === "pid") {
      policies.set(name, () => new PidPolicy(gains));
    } else if (kind === "heuristic") {
      policies.set(name, () => new HeuristicPolicy());
    } else {
      policies.set(name, (seed) => repeatedly(name, () => new RandomPolicy(seed)));
    }
  }
  return policies;
}

/**
 * A policy that begins each episode as a new one, so that a flight can be repeated.
 * @param {string} name
 * @param {() => Policy} make
 * @returns {Policy}
 */
function repeatedly(name, make) {
  let policy = make();
  return {
    name,
    act: (observation) => policy.act(observation),
    reset: () => {
      policy = make();
    },
  };
}

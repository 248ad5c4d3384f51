// The policies that a page was made with.
import { HeuristicPolicy } from "touchdown/policies/heuristic.js";
import { YOU } from "touchdown/play/link.js";
import { PidPolicy } from "touchdown/policies/pid.js";
import { RandomPolicy } from "touchdown/policies/random.js";

/** @typedef {import("touchdown/engine/engine.js").Engine} Engine */
/** @typedef {import("touchdown/policies/policy.js").Policy} Policy */
/**
 * @typedef {object} Described a policy as the page describes it
 * @property {string} name
 * @property {"network" | "pid" | "heuristic" | "random"} kind
 * @property {string} [file] of a network's weights
 * @property {import("touchdown/policies/pid.js").Gains} [gains] of a PID controller
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
 * Adds the network of a file of weights under the file's name, with a number if that is taken.
 * @param {Engine} engine
 * @param {Policies} policies
 * @param {File} file
 * @returns {Promise<string>} its name
 * @throws {Error} It is no such file; one line says why.
 */
export async function addPolicy(engine, policies, file) {
  const network = engine.newNetwork(await file.arrayBuffer());
  const stem = file.name.replace(/\.safetensors$/, "");
  let name = stem;
  for (let i = 2; name === YOU || policies.has(name); i++) name = `${stem}-${i}`;
  policies.set(name, () => network);
  return name;
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

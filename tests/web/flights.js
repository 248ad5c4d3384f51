// Flies episodes on the engine and records all that it says, to be compared with the native engine.
import { base64, fromBase64 } from "tests/base64.js";
import { loadEngine } from "touchdown/engine/engine.js";
import { HeuristicPolicy } from "touchdown/policies/heuristic.js";
import { PidPolicy } from "touchdown/policies/pid.js";
import { RandomPolicy } from "touchdown/policies/random.js";

/**
 * @typedef {object} Job
 * @property {"ace" | "heuristic" | "pid" | "random"} policy
 * @property {number} seed
 * @property {import("touchdown/engine/lander.js").Settings} settings
 *
 * @typedef {object} Episode Arrays as bytes.
 * @property {Uint8Array} actions [T]
 * @property {Uint8Array} observations [T + 1, 8]
 * @property {Uint8Array} rewards [T]
 * @property {Uint8Array} ends [T]: 1 if terminated, 2 if truncated, 3 if both.
 * @property {object} facts What the lander says at the end.
 */

/**
 * @param {BufferSource} module lander.wasm
 * @param {Uint8Array} weights The policy ace.
 * @param {Job[]} jobs
 * @returns {Promise<{episodes: Episode[], stepsPerSecond: number}>}
 */
export async function fly(module, weights, jobs) {
  const engine = await loadEngine(module);
  const network = engine.newNetwork(weights);
  const policies = {
    ace: network,
    heuristic: new HeuristicPolicy(),
    pid: new PidPolicy(),
    random: new RandomPolicy(7),
  };
  const begin = performance.now();
  const episodes = jobs.map((job) => episode(engine, policies[job.policy], job));
  const seconds = (performance.now() - begin) / 1000;
  network.free();
  const steps = episodes.reduce((total, { actions }) => total + actions.length, 0);
  return { episodes, stepsPerSecond: Math.round(steps / seconds) };
}

/**
 * @param {import("touchdown/engine/engine.js").Engine} engine
 * @param {import("touchdown/policies/policy.js").Policy} policy
 * @param {Job} job
 * @returns {Episode}
 */
function episode(engine, policy, { seed, settings }) {
  const lander = engine.newLander(settings);
  let observation = lander.reset(seed);
  const observations = [...observation];
  const actions = [];
  const rewards = [];
  const ends = [];
  while (lander.outcome === null) {
    const action = policy.act(observation);
    const result = lander.step(action);
    observation = result.observation;
    actions.push(action);
    observations.push(...observation);
    rewards.push(result.reward);
    ends.push(Number(result.terminated) + 2 * Number(result.truncated));
  }
  const { steps, episodeReturn, fuel, outcome } = lander;
  const terrain = lander.terrain();
  const facts = {
    steps, episodeReturn, fuel, outcome,
    bodies: [...lander.bodies()],
    terrain: { ...terrain, xs: [...terrain.xs], heights: [...terrain.heights] },
  };
  lander.free();
  return {
    actions: Uint8Array.from(actions),
    observations: new Uint8Array(Float32Array.from(observations).buffer),
    rewards: new Uint8Array(Float64Array.from(rewards).buffer),
    ends: Uint8Array.from(ends),
    facts,
  };
}

/**
 * `fly` with all bytes in base64, as pages and processes can pass them on.
 *
 * @param {{module: string, weights: string, jobs: Job[]}} request
 */
export async function answer({ module, weights, jobs }) {
  const { episodes, stepsPerSecond } = await fly(fromBase64(module), fromBase64(weights), jobs);
  const encoded = episodes.map(({ facts, ...arrays }) => ({
    facts,
    ...Object.fromEntries(Object.entries(arrays).map(([name, bytes]) => [name, base64(bytes)])),
  }));
  return { episodes: encoded, stepsPerSecond };
}

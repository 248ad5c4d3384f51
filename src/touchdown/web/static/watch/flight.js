// Flights in the page: a policy from a start, or a recorded episode of training again.

import { actionsOf } from "touchdown/watch/source.js";

/** @typedef {import("touchdown/engine/engine.js").Engine} Engine */
/** @typedef {import("touchdown/engine/engine.js").NetworkPolicy} NetworkPolicy */
/** @typedef {import("touchdown/watch/source.js").Recorded} Recorded */

/**
 * A flight of T steps.
 * @typedef {object} Flown
 * @property {number} seed the start
 * @property {import("touchdown/engine/lander.js").Terrain} terrain
 * @property {Float32Array[]} bodies [T + 1] of [9]
 * @property {Float32Array[]} observations [T + 1] of [8]
 * @property {number[]} actions [T]
 * @property {number[]} rewards [T]
 * @property {number[]} returns [T + 1] return so far
 * @property {number[]} fuel [T + 1] return points spent on the engines so far
 * @property {[number, number][]} path [T + 1] x, y of the hull in metres
 * @property {import("touchdown/engine/lander.js").Outcome|null} outcome
 */

/**
 * @param {Engine} engine
 * @param {number} seed
 * @param {(observation: Float32Array, step: number) => number|null} choose null ends the flight
 * @returns {Flown}
 */
function fly(engine, seed, choose) {
  const lander = engine.newLander();
  try {
    let observation = lander.reset(seed).slice();
    /** @type {Flown} */
    const flown = {
      seed, terrain: lander.terrain(), bodies: [], observations: [], actions: [], rewards: [],
      returns: [], fuel: [], path: [], outcome: null,
    };
    const record = () => {
      const bodies = lander.bodies().slice();
      flown.bodies.push(bodies);
      flown.observations.push(observation);
      flown.returns.push(lander.episodeReturn);
      flown.fuel.push(lander.fuel);
      flown.path.push([Number(bodies[0]), Number(bodies[1])]);
    };
    record();
    for (let step = 0; ; step++) {
      const action = choose(observation, step);
      if (action === null) break;
      const result = lander.step(action);
      observation = result.observation.slice();
      flown.actions.push(action);
      flown.rewards.push(result.reward);
      record();
      if (result.terminated || result.truncated) break;
    }
    flown.outcome = lander.outcome ?? null;
    return flown;
  } finally {
    lander.free();
  }
}

/**
 * A greedy flight of a policy.
 * @param {Engine} engine
 * @param {NetworkPolicy} policy
 * @param {number} seed
 */
export function flyPolicy(engine, policy, seed) {
  return fly(engine, seed, (observation) => policy.act(observation));
}

/**
 * A training episode, as it was.
 * @param {Engine} engine
 * @param {Recorded} recorded
 */
export function replay(engine, recorded) {
  const actions = actionsOf(recorded);
  return fly(engine, recorded.start, (_, step) => actions[step] ?? null);
}

/**
 * What was really returned from each state on: the discounted sum of the rewards that followed.
 * @param {number[]} rewards [T]
 * @param {number} gamma
 * @returns {number[]} [T]
 */
export function returnsToGo(rewards, gamma) {
  const out = new Array(rewards.length);
  let sum = 0;
  for (let step = rewards.length - 1; step >= 0; step--) {
    sum = /** @type {number} */ (rewards[step]) + gamma * sum;
    out[step] = sum;
  }
  return out;
}

/**
 * What the network expected at each state in which it chose: its largest value, in return points.
 * @param {NetworkPolicy} policy
 * @param {Flown} flown
 * @param {number} scale of the rewards that it was trained with
 * @returns {number[]} [T]
 */
export function expectations(policy, flown, scale) {
  return flown.rewards.map((_, step) =>
    Math.max(...policy.values(/** @type {Float32Array} */ (flown.observations[step]))) / scale);
}

/** @param {number[]} values */
export function mean(values) {
  return values.reduce((sum, value) => sum + value, 0) / Math.max(1, values.length);
}

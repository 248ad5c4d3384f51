/**
 * What acts.
 *
 * @typedef {object} Policy
 * @property {string} name For people to read.
 * @property {(observation: Float32Array) => number} act The action for an observation [8]: 0 none,
 *   1 left engine, 2 main engine, 3 right engine.
 * @property {((observation: Float32Array) => Float32Array | null)} [values] The value of each
 *   action [4], if the policy computes any.
 * @property {number} [rewardScale] The factor of the rewards that the values estimate; 1 without it.
 * @property {() => void} [reset] Called at the start of each episode.
 */

export {};

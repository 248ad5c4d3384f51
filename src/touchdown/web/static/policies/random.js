/** @import { Policy } from "touchdown/policies/policy.js" */

/**
 * Uniform random actions. The same seed gives the same actions; an episode goes on with the stream
 * of the one before.
 *
 * @implements {Policy}
 */
export class RandomPolicy {
  name = "random";
  #state;

  /** @param {number} [seed] A whole number; its lowest 32 bits are used. */
  constructor(seed = 0) {
    this.#state = seed >>> 0;
  }

  /**
   * @param {Float32Array} [_observation]
   * @returns {number} The action.
   */
  act(_observation) {
    // a counter whose bits are mixed by the finaliser of MurmurHash3 (Appleby)
    this.#state = (this.#state + 0x9e3779b9) >>> 0;
    let mixed = this.#state;
    mixed = Math.imul(mixed ^ (mixed >>> 16), 0x85ebca6b);
    mixed = Math.imul(mixed ^ (mixed >>> 13), 0xc2b2ae35);
    return (mixed ^ (mixed >>> 16)) >>> 30;
  }
}

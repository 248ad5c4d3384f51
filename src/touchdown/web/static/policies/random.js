/** @import { Policy } from "touchdown/policies/policy.js" */
import { scatter, STEP } from "touchdown/common/generator.js";

/**
 * Uniform random actions. The same seed gives the same actions; a new episode continues the random
 * stream.
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
    this.#state = (this.#state + STEP) >>> 0;
    return scatter(this.#state) >>> 30;
  }
}

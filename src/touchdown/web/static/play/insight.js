// What a network thinks of the states of a flight: Q(s, a) and the greedy action.

/** @typedef {import("touchdown/policies/policy.js").Policy} Policy */
/** @typedef {import("touchdown/play/flight.js").Flight} Flight */
/** @typedef {import("touchdown/play/flight.js").FlightState} FlightState */

export class Insight {
  /**
   * @param {Flight} flight
   * @param {Policy | null} critic gives the values; null has none
   */
  constructor(flight, critic) {
    this.flight = flight;
    this.critic = critic;
    /** @type {WeakMap<FlightState, Float32Array>} */
    this.known = new WeakMap();
  }

  /**
   * Q(s, a) in return points after `step` steps, [4]; null without a critic.
   * @param {number} step
   */
  values(step) {
    const state = this.flight.at(step);
    let values = this.known.get(state) ?? null;
    if (!values && this.critic?.values) {
      const scale = this.critic.rewardScale ?? 1;
      values = this.critic.values(this.flight.seen(step))?.map((value) => value / scale) ?? null;
      if (values) this.known.set(state, values);
    }
    return values;
  }
}

/**
 * The largest value minus the second largest.
 * @param {Float32Array} values
 */
export function gapOf(values) {
  const [first = 0, second = 0] = [...values].sort((a, b) => b - a);
  return first - second;
}

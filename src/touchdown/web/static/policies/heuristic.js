/** @import { Policy } from "touchdown/policies/policy.js" */
import { named } from "touchdown/policies/observation.js";

const { fround } = Math;

/**
 * The rule-based controller that comes with Gymnasium's lander, in single precision as there: it
 * turns towards an angle that leads back to the pad, and holds a height that grows with the distance
 * from it.
 *
 * @implements {Policy}
 */
export class HeuristicPolicy {
  name = "heuristic";

  /**
   * @param {Float32Array} observation [8].
   * @returns {number} The action.
   */
  act(observation) {
    const { x, y, vx, vy, angle, angularVelocity, left, right } = named(observation);
    const limit = fround(0.4);
    const threshold = fround(0.05);
    let turn = 0;
    let rise = fround(-vy * 0.5);
    if (!left && !right) {
      const wanted = Math.min(limit, Math.max(-limit, fround(fround(x * 0.5) + vx)));
      const height = fround(fround(0.55) * Math.abs(x));
      turn = fround(fround(fround(wanted - angle) * 0.5) - angularVelocity);
      rise = fround(fround(fround(height - y) * 0.5) - fround(vy * 0.5));
    }
    if (rise > Math.abs(turn) && rise > threshold) return 2;
    if (turn < -threshold) return 3;
    return turn > threshold ? 1 : 0;
  }
}

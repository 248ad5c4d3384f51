/**
 * The PID controller with two control values, a dead band, and one engine per step. It computes in
 * single precision, as `touchdown.control.pid` does for observations of that type.
 *
 * @typedef {object} Gains
 * @property {"absolute" | "signed"} rule Whether the main engine fires if |u_vy| > |u_φ| or only if
 *   u_vy > |u_φ|.
 * @property {number} kp_vertical
 * @property {number} ki_vertical
 * @property {number} kp_angle
 * @property {number} kd_angle
 * @property {number} dead_band
 */

/** @import { Policy } from "touchdown/policies/policy.js" */
import { named } from "touchdown/policies/observation.js";

const { fround } = Math;
const NUMBERS = /** @type {const} */ ([
  "kp_vertical", "ki_vertical", "kp_angle", "kd_angle", "dead_band",
]);

/**
 * The gains that `touchdown tune pid` found for each rule; the policy `pid` uses the signed one's.
 *
 * @type {Readonly<Record<"absolute" | "signed", Readonly<Gains>>>}
 */
export const TUNED = Object.freeze({
  absolute: Object.freeze({
    rule: "absolute",
    kp_vertical: -0.5611325813859696,
    ki_vertical: 0.055735688020000035,
    kp_angle: -0.8164750723514361,
    kd_angle: 0.06973568802000003,
    dead_band: 0.08730647351851298,
  }),
  signed: Object.freeze({
    rule: "signed",
    kp_vertical: -2.5946204523727636,
    ki_vertical: -0.04,
    kp_angle: -2.5179210482232377,
    kd_angle: 0.04,
    dead_band: 0.2919204157891237,
  }),
});

/** @implements {Policy} */
export class PidPolicy {
  #gains;
  #absolute;

  /**
   * @param {Gains} [gains] By default the tuned gains of the signed rule.
   * @throws {Error} A gain is not a finite number, or the rule is unknown.
   */
  constructor(gains = TUNED.signed) {
    this.name = "pid";
    if (gains.rule !== "absolute" && gains.rule !== "signed") {
      throw new Error(`rule = ${JSON.stringify(gains.rule)}: must be absolute or signed`);
    }
    this.#gains = /** @type {Record<typeof NUMBERS[number], number>} */ ({});
    for (const name of NUMBERS) {
      const value = gains[name];
      if (!Number.isFinite(value)) throw new Error(`${name} = ${value}: must be a finite number`);
      this.#gains[name] = fround(value);
    }
    if (gains.dead_band < 0) throw new Error(`dead_band = ${gains.dead_band}: must be at least 0`);
    this.#absolute = gains.rule === "absolute";
  }

  /**
   * The control values u_vy and u_φ.
   *
   * @param {Float32Array} observation [8].
   * @returns {{vertical: number, angle: number}}
   */
  controlValues(observation) {
    const { x, y, vx, vy, angle, angularVelocity } = named(observation);
    const g = this.#gains;
    const error = fround(fround(x + vx) - angle);
    const damping = fround(vx - angularVelocity);
    return {
      vertical: fround(fround(g.kp_vertical * vy) + fround(g.ki_vertical * y)),
      angle: fround(fround(g.kp_angle * error) + fround(g.kd_angle * damping)),
    };
  }

  /**
   * @param {Float32Array} observation [8].
   * @returns {number} The action.
   */
  act(observation) {
    const values = this.controlValues(observation);
    const deadBand = this.#gains.dead_band;
    const vertical = this.#absolute ? Math.abs(values.vertical) : values.vertical;
    if (vertical >= deadBand && vertical > Math.abs(values.angle)) return 2;
    if (values.angle > deadBand) return 3;
    return values.angle < -deadBand ? 1 : 0;
  }
}

// Units of the lander's time and velocity.

export const STEPS_PER_SECOND = 50;

/**
 * The velocity in m/s that an observation holds in units of its own.
 * @param {ArrayLike<number>} observation [8]
 */
export function velocityOf(observation) {
  return { vx: 5 * Number(observation[2]), vy: 7.5 * Number(observation[3]) };
}

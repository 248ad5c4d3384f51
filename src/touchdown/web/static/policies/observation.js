/**
 * The numbers of an observation by their names, in its units; see the lander's page in Gymnasium's
 * documentation.
 *
 * @param {Float32Array} observation [8].
 */
export function named(observation) {
  const [x = 0, y = 0, vx = 0, vy = 0, angle = 0, angularVelocity = 0, left = 0, right = 0] =
    observation;
  return { x, y, vx, vy, angle, angularVelocity, left: left !== 0, right: right !== 0 };
}

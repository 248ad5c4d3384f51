// The ground of a start.

/**
 * @typedef {object} Terrain
 * @property {ArrayLike<number>} xs metres, increasing
 * @property {ArrayLike<number>} heights metres, one for each x
 * @property {number} helipadX1 left edge of the pad in metres
 * @property {number} helipadX2 right edge of the pad in metres
 * @property {number} helipadY height of the pad in metres
 */

/**
 * Height of the ground at x, in metres.
 * @param {Terrain} terrain
 * @param {number} x metres
 */
export function heightAt(terrain, x) {
  const { xs, heights } = terrain;
  const last = xs.length - 1;
  if (x <= at(xs, 0)) return at(heights, 0);
  if (x >= at(xs, last)) return at(heights, last);
  let right = 1;
  while (at(xs, right) < x) right += 1;
  const share = (x - at(xs, right - 1)) / (at(xs, right) - at(xs, right - 1));
  return at(heights, right - 1) * (1 - share) + at(heights, right) * share;
}

/**
 * @param {ArrayLike<number>} values
 * @param {number} index
 */
function at(values, index) {
  const value = values[index];
  if (value === undefined) throw new RangeError(`no value at ${index} of ${values.length}`);
  return value;
}

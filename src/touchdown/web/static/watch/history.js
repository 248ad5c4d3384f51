// What is known of one run: its facts, and its records as columns that grow.

/**
 * @typedef {object} Facts
 * @property {string} label
 * @property {string} group
 * @property {"training"|"finished"|"stopped"|"gone"|"damaged"} status
 * @property {string} error
 * @property {string} env_id
 * @property {number} seed
 * @property {string} alike
 * @property {{gamma: number, reward_scale: number, activation: string, max_env_steps: number,
 *   episodes: number}|null} settings
 * @property {boolean} is_lander
 * @property {boolean} can_replay
 * @property {number|null} threshold
 * @property {boolean} has_flights
 * @property {number[]} policies
 * @property {boolean} has_best
 * @property {{episodes: number, mean_return: number}|null} test
 */

/** @typedef {"episodes"|"updates"|"validations"|"firsts"} RecordName */
/** @typedef {"env_steps"|"seconds"} Axis */

/**
 * A message of the server.
 * @typedef {{run: string, facts?: Facts|null, record?: RecordName, restart?: boolean,
 *   stride?: number, columns?: Record<string, (number|string|null)[]>}} Message
 */

/** Episodes in a moving mean, as in the paper. */
export const WINDOW = 100;

export class Columns {
  /** @type {Record<string, any[]>} */
  #values = {};
  length = 0;
  /** Rows of the file for each that is kept. */
  stride = 1;

  /** @param {string} name @returns {any[]} a value for each row, undefined where there is none */
  get(name) {
    return this.#values[name] ?? [];
  }

  /** @param {Message} message */
  take(message) {
    if (message.restart) {
      this.#values = {};
      this.length = 0;
    }
    this.stride = message.stride ?? 1;
    const columns = message.columns ?? {};
    let rows = 0;
    for (const [name, values] of Object.entries(columns)) {
      const column = (this.#values[name] ??= new Array(this.length).fill(null));
      for (const value of values) column.push(value);
      rows = values.length;
    }
    this.length += rows;
    for (const column of Object.values(this.#values))
      while (column.length < this.length) column.push(null);
  }
}

/** Rows that stand for the episodes of a moving mean. @param {Columns} episodes */
export function rowsOfWindow(episodes) {
  return Math.max(1, Math.round(WINDOW / episodes.stride));
}

export class RunHistory {
  /** @type {Facts|null} */
  facts = null;
  /** Whether the server does not know the run. */
  isUnknown = false;
  episodes = new Columns();
  updates = new Columns();
  validations = new Columns();
  /** The first episode with each outcome, which `episodes` may leave out. */
  firsts = new Columns();

  /** @param {string} key */
  constructor(key) {
    this.key = key;
  }

  get label() {
    return this.facts?.label ?? this.key;
  }

  /** @param {Message} message */
  take(message) {
    if (message.facts) {
      this.facts = message.facts;
      this.isUnknown = false;
    } else if (message.facts === null) {
      this.isUnknown = true;
    } else if (message.record) {
      this[message.record].take(message);
    }
  }

  /**
   * Where rows of a record lie on an axis.
   * @param {RecordName} record
   * @param {Axis} axis
   * @returns {number[]}
   */
  axis(record, axis) {
    const steps = this[record].get("env_steps");
    if (axis === "env_steps") return steps;
    if (record === "episodes") return this.episodes.get("seconds");
    return steps.map((at) => this.secondsAt(at));
  }

  /** Seconds of training at a number of environment steps, between those of two episodes. */
  secondsAt(/** @type {number} */ at) {
    const steps = this.episodes.get("env_steps");
    const seconds = this.episodes.get("seconds");
    if (!steps.length) return 0;
    const after = firstAtLeast(steps, at);
    if (after === steps.length) return seconds[after - 1];
    const before = after ? [steps[after - 1], seconds[after - 1]] : [0, 0];
    const share = (at - before[0]) / Math.max(1, steps[after] - before[0]);
    return before[1] + share * (seconds[after] - before[1]);
  }

  /**
   * The first episode with an outcome.
   * @param {string} outcome
   * @returns {{env_steps: number, seconds: number, episode_return: number}|null}
   */
  first(outcome) {
    const row = this.firsts.get("outcome").indexOf(outcome);
    if (row < 0) return null;
    const [env_steps, seconds, episode_return] =
      ["env_steps", "seconds", "episode_return"].map((name) => this.firsts.get(name)[row]);
    return { env_steps, seconds, episode_return };
  }
}

/** The first index of sorted numbers that is at least a value. */
export function firstAtLeast(/** @type {number[]} */ sorted, /** @type {number} */ value) {
  let low = 0;
  let high = sorted.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (/** @type {number} */ (sorted[middle]) < value) low = middle + 1;
    else high = middle;
  }
  return low;
}

/**
 * Mean of each value and of up to `window - 1` values before it.
 * @param {number[]} values
 * @param {number} window
 */
export function movingMean(values, window = WINDOW) {
  let sum = 0;
  return values.map((value, index) => {
    sum += value - (index >= window ? /** @type {number} */ (values[index - window]) : 0);
    return sum / Math.min(index + 1, window);
  });
}

/**
 * The share of each outcome among the recent episodes, for each episode.
 * @param {string[]} outcomes
 * @param {number} window
 * @returns {Map<string, number[]>}
 */
export function outcomeShares(outcomes, window = WINDOW) {
  const names = [...new Set(outcomes)];
  return new Map(
    names.map((name) => [name, movingMean(outcomes.map((each) => +(each === name)), window)]),
  );
}

/**
 * Means of neighbouring points, so that a long record is drawn fast.
 * @param {number[]} xs
 * @param {(number|null)[]} ys those that are null or not finite are left out
 * @param {number} most number of points
 */
export function binned(xs, ys, most = 400) {
  const size = Math.max(1, Math.ceil(xs.length / most));
  /** @type {{x: number[], y: number[]}} */
  const out = { x: [], y: [] };
  for (let start = 0; start < xs.length; start += size) {
    let sum = 0;
    let count = 0;
    let last = start;
    for (let index = start; index < Math.min(start + size, xs.length); index++) {
      const y = ys[index];
      if (y === null || y === undefined || !Number.isFinite(y)) continue;
      sum += y;
      count++;
      last = index;
    }
    if (count) {
      out.x.push(/** @type {number} */ (xs[last]));
      out.y.push(sum / count);
    }
  }
  return out;
}

/**
 * Indices of rows to draw: all, or every second, third, ..., and the last.
 * @param {number} start
 * @param {number} end
 * @param {number} most
 */
export function thinned(start, end, most) {
  const size = Math.max(1, Math.ceil((end - start) / most));
  const found = [];
  for (let index = start; index < end; index += size) found.push(index);
  if (found.length && found.at(-1) !== end - 1) found.push(end - 1);
  return found;
}

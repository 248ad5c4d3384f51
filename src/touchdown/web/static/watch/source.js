// Where a page has a run from: a server that follows it, or the page itself.

import { decodeBase64, readBinary, readData } from "touchdown/common/data.js";

/** @typedef {import("touchdown/watch/history.js").Message} Message */
/** @typedef {{episode: number, start: number, actions: string, steps: number}} Recorded */
/** @typedef {"live"|"lost"|"file"} Connection */

/**
 * @typedef {object} Source
 * @property {string[]} runs keys of the runs
 * @property {boolean} isLive
 * @property {(take: (message: Message) => void, state: (state: Connection) => void) => void} listen
 * @property {(run: string, steps: number|"best") => Promise<Uint8Array>} policy
 * @property {(run: string, episode: number) => Promise<Recorded>} episode
 */

/** @returns {Source} */
export function openSource() {
  const data = readData();
  return data.live ? fromServer(data.runs) : fromPage(data);
}

/** @param {string[]} runs @returns {Source} */
function fromServer(runs) {
  /** @type {Map<string, Promise<Uint8Array>>} */
  const policies = new Map();

  /** @param {string} path */
  async function get(path) {
    const answer = await fetch(path);
    if (!answer.ok) throw new Error(await answer.text());
    return answer;
  }

  return {
    runs,
    isLive: true,
    listen(take, state) {
      const events = new EventSource(`./events?${runs.map((run) => `run=${encodeURIComponent(run)}`).join("&")}`);
      events.onopen = () => state("live");
      events.onerror = () => state("lost");
      events.onmessage = (event) => take(JSON.parse(event.data));
    },
    policy(run, steps) {
      const path = `./run/${encodeURIComponent(run)}/policy/${steps}`;
      if (steps === "best") return get(path).then(bytesOf); // it changes
      const known = policies.get(path) ?? get(path).then(bytesOf);
      policies.set(path, known);
      known.catch(() => policies.delete(path));
      return known;
    },
    async episode(run, episode) {
      return (await get(`./run/${encodeURIComponent(run)}/episode/${episode}`)).json();
    },
  };
}

/** @param {Response} answer */
async function bytesOf(answer) {
  return new Uint8Array(await answer.arrayBuffer());
}

/** @param {any} data @returns {Source} */
function fromPage(data) {
  return {
    runs: data.runs,
    isLive: false,
    listen(take, state) {
      state("file");
      for (const message of data.messages) take(message);
    },
    async policy(run, steps) {
      return readBinary(`${run}/${steps}`);
    },
    async episode(run, episode) {
      const found = data.episodes[`${run}/${episode}`];
      if (!found) throw new Error(`episode ${episode} is not in this file`);
      return found;
    },
  };
}

/**
 * Actions of a recorded episode, two bits each.
 * @param {Recorded} recorded
 */
export function actionsOf(recorded) {
  const packed = decodeBase64(recorded.actions);
  return Uint8Array.from({ length: recorded.steps }, (_, step) =>
    (/** @type {number} */ (packed[step >> 2]) >> (2 * (step & 3))) & 3,
  );
}

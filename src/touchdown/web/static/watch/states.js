// The states of a run, in words.

/** @type {Record<string, string>} */
const STATES = {
  training: "training",
  finished: "finished",
  stopped: "stopped",
  gone: "deleted",
  damaged: "damaged",
};

/** @param {string} status */
export function stateName(status) {
  return STATES[status] ?? status;
}

// A person's best flights, kept by this browser.

/**
 * @typedef {object} BestFlight
 * @property {string} by
 * @property {number} seed of the start
 * @property {number} return
 * @property {string} outcome
 * @property {number} fuel return points spent on the engines
 * @property {number} steps
 * @property {string} link the flight, as the part of a URL after #
 */

const KEY = "touchdown-best-flights";
const MOST = 10;

export class BestFlights {
  constructor() {
    this.list = read();
  }

  /**
   * Adds a flight, unless it is kept already or ten were better.
   * @param {BestFlight} flight
   * @returns {boolean} whether it is among the best
   */
  add(flight) {
    if (this.list.some((each) => each.link === flight.link)) return false;
    this.list = [...this.list, flight].sort((a, b) => b.return - a.return).slice(0, MOST);
    write(this.list);
    return this.list.includes(flight);
  }

  clear() {
    this.list = [];
    write(this.list);
  }
}

/** @returns {BestFlight[]} */
function read() {
  try {
    const found = JSON.parse(localStorage.getItem(KEY) ?? "[]");
    return Array.isArray(found) ? found.filter(isBestFlight).slice(0, MOST) : [];
  } catch {
    return []; // a browser may forbid storage to a file, or another page wrote there
  }
}

/** @param {BestFlight[]} list */
function write(list) {
  try {
    localStorage.setItem(KEY, JSON.stringify(list));
  } catch {
    // as in read: the table lasts until the page is closed
  }
}

/**
 * @param {any} found
 * @returns {found is BestFlight}
 */
function isBestFlight(found) {
  const texts = [found?.by, found?.outcome, found?.link];
  const numbers = [found?.seed, found?.return, found?.fuel, found?.steps];
  return texts.every((each) => typeof each === "string") && numbers.every(Number.isFinite);
}

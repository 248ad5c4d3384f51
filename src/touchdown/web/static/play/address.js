// The flight in the page's address, after #.
import { checkOf, readLink, writeLink } from "touchdown/play/link.js";

/** @typedef {import("touchdown/play/game.js").Game} Game */
/** @typedef {import("touchdown/play/link.js").Shared} Shared */

export class Address {
  constructor() {
    /** Why the flight of the address was not opened, for the reader; empty if it was. */
    this.complaint = "";
    /** Whether it can be opened as soon as the page has another policy. */
    this.waits = false;
  }

  /**
   * The flight of the address. If it cannot be flown, `complaint` says why.
   * @param {import("touchdown/policies/registry.js").Policies} policies
   * @returns {Shared | null} null if there is none to fly
   */
  read(policies) {
    this.forget();
    try {
      const shared = readLink(location.hash);
      if (!shared) return null;
      const { autopilot, rivals } = shared.setup;
      const unknown = [autopilot, ...rivals].find((name) => name !== "" && !policies.has(name));
      if (unknown === undefined) return shared;
      this.waits = true;
      throw new RangeError(`this page has no policy ${unknown}; add its weights to open it`);
    } catch (error) {
      if (!(error instanceof RangeError)) throw error;
      this.complaint = `The link cannot be opened: ${error.message}.`;
      return null;
    }
  }

  /** The flight of the address is no longer wanted. */
  forget() {
    this.complaint = "";
    this.waits = false;
  }

  /**
   * Puts the present flight in the address, unless a flight there is still to be opened.
   * @param {Game} game
   */
  write(game) {
    if (this.complaint) return;
    const address = `#${linkOf(game)}`;
    if (address === location.hash) return;
    try {
      history.replaceState(null, "", address);
    } catch {
      // a browser may forbid it to a file, or after many changes
    }
  }
}

/**
 * The present flight as the part of a URL after #.
 * @param {Game} game
 */
export function linkOf({ setup, race }) {
  const { lead } = race;
  const complete = race.flights.every((flight) => flight.over);
  const known = lead.over ? lead.commands : [...lead.commands, ...race.planned.slice(lead.steps)];
  return writeLink(setup, lead.byHand ? known : [], complete ? checkOf(race.flights) : null);
}

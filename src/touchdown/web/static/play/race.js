// Flights from one start, side by side in time: the person's and those of its rivals.
import { AUTOPILOT, MAX_STEPS } from "touchdown/play/commands.js";

/** @typedef {import("touchdown/play/flight.js").Flight} Flight */

export class Race {
  /**
   * @param {Flight} lead the flight that a person may command
   * @param {Flight[]} rivals
   * @param {number[]} planned commands of the lead, as in a link
   */
  constructor(lead, rivals, planned = []) {
    this.lead = lead;
    this.rivals = rivals;
    this.planned = planned;
    /** The moment that is shown. */
    this.step = 0;
  }

  get flights() {
    return [this.lead, ...this.rivals];
  }

  /** Steps of the longest flight so far. */
  get recorded() {
    return Math.max(...this.flights.map((flight) => flight.steps));
  }

  /** Whether all flights have ended and the last moment is shown. */
  get over() {
    return this.step >= this.recorded && this.flights.every((flight) => flight.over);
  }

  /** Whether the next step of the lead is known already: recorded, planned, or none. */
  get replaying() {
    return this.step < this.lead.steps || this.step < this.planned.length || this.lead.over;
  }

  /**
   * Shows the next moment, and flies it unless it is recorded.
   * @param {number} command of the lead, where none is planned
   */
  advance(command) {
    if (this.over || this.step >= MAX_STEPS) return;
    for (const flight of this.flights) {
      if (flight.over || flight.steps > this.step) continue;
      flight.fly(flight === this.lead ? (this.planned[this.step] ?? command) : AUTOPILOT);
    }
    this.step += 1;
  }

  /**
   * Shows a recorded moment.
   * @param {number} step
   */
  seek(step) {
    this.step = Math.min(Math.max(Math.round(step), 0), this.recorded);
  }

  /** Forgets what the lead does after the moment shown, so that a person can fly on from there. */
  takeOver() {
    this.planned = [];
    if (this.lead.steps > this.step) this.lead.rewind(this.step);
  }

  close() {
    for (const flight of this.flights) flight.close();
  }
}

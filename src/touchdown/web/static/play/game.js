// The game: a race in time, which plays, pauses, rewinds and is taken over. It draws nothing.
import { AUTOPILOT, IDLE } from "touchdown/play/commands.js";
import { Flight } from "touchdown/play/flight.js";
import { STEPS_PER_SECOND } from "touchdown/common/units.js";
import { YOU } from "touchdown/play/link.js";
import { Race } from "touchdown/play/race.js";

/** @typedef {import("touchdown/play/link.js").Setup} Setup */
/** @typedef {import("touchdown/policies/registry.js").Policies} Policies */
/** @typedef {"started" | "changed" | "ended" | "handed over"} GameEvent */

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
const LONGEST_FRAME = 0.1; // seconds: a page that was hidden does not catch up

export class Game {
  /**
   * @param {import("touchdown/engine/engine.js").Engine} engine
   * @param {Policies} policies
   * @param {Setup} setup
   * @param {(event: GameEvent) => void} onEvent
   */
  constructor(engine, policies, setup, onEvent) {
    this.engine = engine;
    this.policies = policies;
    this.onEvent = onEvent;
    this.setup = setup;
    this.playing = false;
    this.speed = 1;
    /** Whether the autopilot acts where the person does nothing. */
    this.engaged = !setup.byHand;
    this.elapsed = 0; // seconds since the moment shown
    this.race = this.makeRace([]);
  }

  /**
   * Begins a race; it waits for `play`.
   * @param {Setup} setup
   * @param {number[]} [planned] commands of the lead, as in a link
   */
  begin(setup, planned = []) {
    this.race.close();
    this.setup = setup;
    this.playing = false;
    this.engaged = !setup.byHand;
    this.elapsed = 0;
    this.race = this.makeRace(planned);
    this.onEvent("started");
  }

  /** The same race again, without what a person did. */
  restart() {
    this.begin(this.setup);
  }

  /** How far the picture is from the previous moment, 0, to the one shown, 1. */
  get share() {
    return this.playing ? this.elapsed * STEPS_PER_SECOND : 1;
  }

  /** Who flies the lead, in words. */
  get flownBy() {
    const { lead } = this.race;
    const assisted = lead.commands.includes(AUTOPILOT);
    const byHand = lead.steps > 0 ? lead.byHand : this.setup.byHand;
    if (!byHand) return this.setup.autopilot;
    return assisted ? `${YOU} + ${this.setup.autopilot}` : YOU;
  }

  play() {
    if (this.race.over) this.race.seek(0);
    this.playing = true;
    this.elapsed = 0;
    this.onEvent("changed");
  }

  pause() {
    this.playing = false;
    this.onEvent("changed");
  }

  /**
   * Shows another moment and stays there.
   * @param {number} step
   */
  seek(step) {
    this.playing = false;
    this.race.seek(step);
    this.onEvent("changed");
  }

  /**
   * One step onwards, flown if it is not recorded.
   * @param {number | null} held
   */
  step(held) {
    this.playing = false;
    this.advance(held);
    this.onEvent(this.race.over ? "ended" : "changed");
  }

  /**
   * A person presses an engine: they fly on from the moment shown.
   * @returns {boolean} whether they can
   */
  takeOver() {
    const { race } = this;
    if (race.lead.over && race.step >= race.lead.steps) return false;
    race.takeOver();
    if (!this.playing) this.play();
    return true;
  }

  /** Switches the autopilot on or off for what is flown from now on. */
  toggleAutopilot() {
    this.engaged = !this.engaged;
    const { race } = this;
    if (race.replaying && !race.lead.over) race.takeOver();
    this.onEvent("changed");
  }

  /**
   * Time passes.
   * @param {number} seconds
   * @param {number | null} held the command of what a person holds
   */
  tick(seconds, held) {
    if (!this.playing) return;
    this.elapsed += Math.min(seconds, LONGEST_FRAME) * this.speed;
    while (this.elapsed >= 1 / STEPS_PER_SECOND && this.playing) {
      this.elapsed -= 1 / STEPS_PER_SECOND;
      this.advance(held);
      if (this.race.over) {
        this.playing = false;
        this.onEvent("ended");
      } else if (this.planEnded) {
        this.engaged = this.race.planned.at(-1) === AUTOPILOT;
        if (this.engaged) continue; // the link ends while the autopilot flies
        this.playing = false;
        this.onEvent("handed over");
      }
    }
  }

  /** @param {number | null} held */
  advance(held) {
    this.race.advance(held ?? (this.engaged ? AUTOPILOT : IDLE));
  }

  /** Whether the last planned command is flown, but the flight is not over. */
  get planEnded() {
    const { planned, step, lead } = this.race;
    return planned.length > 0 && step === planned.length && !lead.over;
  }

  /** @param {number[]} planned */
  makeRace(planned) {
    const { seed, conditions, autopilot, byHand, rivals } = this.setup;
    const flight = (/** @type {string} */ name) => {
      const make = this.policies.get(name);
      if (!make) throw new RangeError(`this page has no policy ${name}`);
      return new Flight(this.engine, { name, seed, conditions, autopilot: make(seed) });
    };
    const others = rivals.filter((name) => byHand || name !== autopilot);
    return new Race(flight(autopilot), others.map(flight), planned);
  }
}

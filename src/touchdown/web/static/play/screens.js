// The pictures of a race: one with ghosts, or one for each flight.
import { velocityOf } from "touchdown/common/units.js";
import { SceneView } from "touchdown/scene/scene.js";

/** @typedef {import("touchdown/play/game.js").Game} Game */
/** @typedef {import("touchdown/play/flight.js").Flight} Flight */
/** @typedef {import("touchdown/scene/scene.js").Craft} Craft */

/** Of rivals, in their order; the lead has the colours of our films. */
export const RIVAL_COLOURS = ["#56b4e9", "#33c99c", "#dd9abf", "#ff8a4c", "#f0e442", "#b9a3ff"];
const GHOST = 0.6; // opacity

export class Screens {
  /** @param {HTMLElement} place */
  constructor(place) {
    this.place = place;
    this.sideBySide = false;
    /** @type {SceneView[]} */
    this.views = [];
  }

  /**
   * Shows another race, or the same in another way.
   * @param {Game} game
   */
  show({ race, setup }) {
    const count = this.sideBySide ? race.flights.length : 1;
    if (this.views.length !== count) {
      for (const view of this.views) view.close();
      this.views = Array.from({ length: count }, () => new SceneView(this.addCanvas()));
      this.place.replaceChildren(...this.views.map((view) => view.canvas));
      this.place.dataset.count = String(count);
    }
    for (const view of this.views) view.setStart(race.lead.terrain, setup.seed);
  }

  /** @param {Game} game */
  draw(game) {
    const { race } = game;
    const craft = race.flights.map((_, index) => this.craftOf(game, index));
    if (this.sideBySide) {
      this.views.forEach((view, i) => {
        const each = craft[i];
        if (each) view.draw([{ ...each, opacity: 1 }]);
      });
    } else {
      this.views[0]?.draw(craft.reverse(), { banner: true }); // the lead over its rivals
    }
  }

  addCanvas() {
    const canvas = document.createElement("canvas");
    this.place.append(canvas); // so that it has a size
    return canvas;
  }

  /**
   * @param {Game} game
   * @param {number} index of the flight; 0 is the lead
   * @returns {Craft}
   */
  craftOf(game, index) {
    const { race, share } = game;
    const flight = /** @type {Flight} */ (race.flights[index]);
    const isLead = index === 0;
    const step = Math.min(race.step, flight.steps);
    const now = flight.at(step);
    const ended = flight.over && step === flight.steps;
    const before = flight.at(Math.max(ended ? step : step - 1, 0));
    const bodies = now.bodies.map((value, i) => {
      const earlier = before.bodies[i] ?? value;
      return earlier + (value - earlier) * share;
    });
    const trail = flight.path.slice(0, step);
    trail.push([Number(bodies[0]), Number(bodies[1])]);
    const angle = Number(now.observation[4]);
    const dials = { step, return: now.return, fuel: now.fuel, angle, ...velocityOf(now.observation) };
    /** @type {Craft} */
    const craft = {
      bodies,
      engines: ended || now.action === 0 ? [] : [now.action],
      trail,
      label: isLead ? game.flownBy : flight.name,
      outcome: ended ? flight.outcome : null,
    };
    if (isLead || this.sideBySide) craft.dials = dials;
    if (!isLead) {
      craft.opacity = GHOST;
      craft.colour = RIVAL_COLOURS[(index - 1) % RIVAL_COLOURS.length] ?? "";
    }
    return craft;
  }
}

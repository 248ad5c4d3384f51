// What the page shows of a game: the scene, the strips under it and the map of actions.
import { ActionMap, MAPS } from "touchdown/play/action-map.js";
import { LONGEST_NAME, shortened } from "touchdown/common/format.js";
import { Insight } from "touchdown/play/insight.js";
import { Palette } from "touchdown/common/palette.js";
import { onTheme } from "touchdown/common/theme.js";
import { leave } from "touchdown/play/panel.js";
import { Screens } from "touchdown/play/screens.js";
import { Strips } from "touchdown/play/strips.js";
import { element, part } from "touchdown/common/parts.js";

/** @typedef {import("touchdown/play/game.js").Game} Game */
/** @typedef {import("touchdown/policies/policy.js").Policy} Policy */

const STRIPS_EVERY = 3; // frames
const TRAIL = 100; // steps of the path on the map

export class Display {
  constructor() {
    const palette = new Palette();
    this.screens = new Screens(element(".scenes"));
    this.strips = new Strips(element(".strips"), palette);
    this.map = new ActionMap(part(document, ".plot canvas", HTMLCanvasElement), palette);
    /** @type {Insight | null} */
    this.insight = null;
    /** @type {Policy | null} an instance of its own: the one that flies may have a state */
    this.mapped = null;
    this.frames = 0;
    /** Whether the picture is not that of the game. */
    this.stale = true;
    /** Whether the scene is in sight. */
    this.visible = true;
    const outdate = () => (this.stale = true);
    onTheme(outdate);
    addEventListener("resize", outdate);
    new IntersectionObserver(([entry]) => {
      this.visible = entry?.isIntersecting ?? true;
    }).observe(element(".scenes"));
    for (const input of document.querySelectorAll("[name=map]")) {
      input.addEventListener("change", () => {
        this.chooseMap();
        leave(input);
      });
    }
    this.chooseMap();
  }

  /**
   * Another race begins.
   * @param {Game} game
   */
  show(game) {
    const { autopilot, seed } = game.setup;
    const [name, critic] = criticOf(game) ?? ["a network", null];
    this.insight = new Insight(game.race.lead, critic);
    this.mapped = game.policies.get(autopilot)?.(seed) ?? null;
    this.map.restart();
    this.screens.show(game);
    for (const [place, text] of Object.entries({ critic: name, autopilot })) {
      for (const each of document.querySelectorAll(`[data-name=${place}]`)) {
        each.textContent = shortened(text, LONGEST_NAME);
      }
    }
    this.stale = true;
  }

  /**
   * Ghosts in one picture, or a picture for each flight.
   * @param {Game} game
   * @param {boolean} sideBySide
   */
  showSideBySide(game, sideBySide) {
    this.screens.sideBySide = sideBySide;
    this.screens.show(game);
    this.stale = true;
  }

  /** @param {Game} game */
  draw(game) {
    const { lead, step: now } = game.race;
    const step = Math.min(now, lead.steps);
    this.screens.draw(game);
    this.frames += 1;
    if (this.insight && (!game.playing || this.frames % STRIPS_EVERY === 0)) {
      this.strips.draw(game, this.insight);
    }
    if (!this.mapped) return;
    const seen = lead.seen(step);
    const earlier = lead.states.slice(Math.max(step - TRAIL, 0), step + 1);
    this.map.draw(this.mapped, seen, earlier.map((state) => state.observation));
    this.stale = !this.map.isOf(seen);
  }

  chooseMap() {
    const name = part(document, "[name=map]:checked", HTMLInputElement).value;
    const axes = MAPS[name];
    if (!axes) throw new Error(`there is no map ${name}`);
    this.map.axes = axes;
    this.map.restart();
    [element(".plot .across").textContent, element(".plot .up").textContent] = axes.names;
    this.stale = true;
  }
}

/**
 * The policy whose values are shown, and its name: the lead's own if it has values, else the first
 * one that has.
 * @param {Game} game
 * @returns {[string, Policy] | null}
 */
function criticOf({ policies, setup: { autopilot, seed } }) {
  for (const name of [autopilot, ...policies.keys()]) {
    const policy = policies.get(name)?.(seed);
    if (policy?.values) return [name, policy];
  }
  return null;
}

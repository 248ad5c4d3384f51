// Buttons, keys and the time line: play, pause, step, rewind, speed, autopilot.
import { needsKey } from "touchdown/play/controls.js";
import { STEPS_PER_SECOND } from "touchdown/common/units.js";
import { SPEEDS } from "touchdown/play/game.js";
import { leave } from "touchdown/play/panel.js";
import { part } from "touchdown/common/parts.js";

/** @typedef {import("touchdown/play/game.js").Game} Game */
/** @typedef {Record<string, () => void>} Actions by the name in data-do */

const KEYS = /** @type {Record<string, string>} */ ({
  Space: "play",
  Comma: "back",
  Period: "step",
  KeyB: "rewind",
  Backspace: "rewind",
  KeyR: "restart",
  KeyN: "next",
  KeyT: "autopilot",
  KeyV: "view",
  KeyL: "share",
  BracketLeft: "slower",
  BracketRight: "faster",
});

export class Transport {
  /**
   * @param {HTMLElement} bar
   * @param {Game} game
   * @param {Actions} actions besides those of the game
   * @param {() => number | null} held the command of what a person holds
   */
  constructor(bar, game, actions, held) {
    this.game = game;
    this.timeline = part(bar, "input", HTMLInputElement);
    this.clock = part(bar, ".clock", HTMLElement);
    this.speed = part(bar, "select", HTMLSelectElement);
    this.playButton = part(bar, "[data-do=play]", HTMLButtonElement);
    this.autopilot = part(bar, "[data-do=autopilot]", HTMLButtonElement);
    /** @type {Actions} */
    this.actions = {
      play: () => (game.playing ? game.pause() : game.play()),
      back: () => game.seek(game.race.step - 1),
      step: () => game.step(held()),
      rewind: () => game.seek(game.race.step - STEPS_PER_SECOND),
      autopilot: () => game.toggleAutopilot(),
      slower: () => this.changeSpeed(-1),
      faster: () => this.changeSpeed(1),
      ...actions,
    };
    for (const speed of SPEEDS) this.speed.add(new Option(`${speed}×`, String(speed)));
    this.speed.addEventListener("change", () => {
      game.speed = Number(this.speed.value);
      leave(this.speed);
      this.speed.blur();
    });
    this.timeline.addEventListener("input", () => game.seek(Number(this.timeline.value)));
    this.timeline.addEventListener("change", () => leave(this.timeline));
    for (const button of document.querySelectorAll("button[data-do]")) {
      if (!(button instanceof HTMLButtonElement)) continue;
      button.addEventListener("click", () => this.actions[button.dataset.do ?? ""]?.());
    }
    addEventListener("keydown", (event) => this.keyDown(event));
    this.speed.value = String(game.speed);
  }

  /** Shows the state of the game. */
  update() {
    const { race, playing, engaged, setup } = this.game;
    this.timeline.max = String(Math.max(race.recorded, race.planned.length, 1));
    this.timeline.value = String(race.step);
    const seconds = `${(race.step / STEPS_PER_SECOND).toFixed(2)} s`;
    this.timeline.setAttribute("aria-valuetext", seconds);
    this.clock.textContent = seconds;
    this.playButton.setAttribute("aria-label", playing ? "Pause" : "Play");
    this.playButton.classList.toggle("playing", playing);
    this.autopilot.setAttribute("aria-pressed", String(engaged));
    this.autopilot.title = `Autopilot: ${setup.autopilot} (T)`;
  }

  /** @param {KeyboardEvent} event */
  keyDown(event) {
    const name = KEYS[event.code];
    if (!name || event.ctrlKey || event.metaKey || event.altKey) return;
    if (needsKey(event.target, event.code)) return;
    event.preventDefault();
    if (event.repeat && !["back", "step", "rewind"].includes(name)) return;
    this.actions[name]?.();
  }

  /** @param {number} by how many places in SPEEDS */
  changeSpeed(by) {
    const place = SPEEDS.indexOf(this.game.speed) + by;
    this.game.speed = SPEEDS[Math.min(Math.max(place, 0), SPEEDS.length - 1)] ?? 1;
    this.speed.value = String(this.game.speed);
  }
}

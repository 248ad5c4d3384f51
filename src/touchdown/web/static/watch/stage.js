// The stage: a flight on a canvas, with play, pause, a time line and speeds.

import { STEPS_PER_SECOND, velocityOf } from "touchdown/common/units.js";
import { SceneView } from "touchdown/scene/scene.js";

/** @typedef {import("touchdown/watch/flight.js").Flown} Flown */

const HOLD = 1200; // milliseconds that the end is shown
const SPEEDS = [0.5, 1, 2, 4, 8];

export class Stage {
  /** @type {Flown|null} */
  #flown = null;
  #label = "";
  #step = 0;
  #playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  #speed = 2;
  #then = 0;
  #ended = 0;
  #closed = false;
  /** Called when a flight has been shown to its end. @type {() => void} */
  onEnd = () => this.seek(0);
  /** Called whenever another step is shown. @type {(step: number) => void} */
  onStep = () => {};

  /** @param {HTMLElement} place */
  constructor(place) {
    const canvas = document.createElement("canvas");
    canvas.className = "scene";
    canvas.setAttribute("role", "img");
    this.canvas = canvas;
    this.button = element("button", "Pause");
    this.timeline = document.createElement("input");
    this.timeline.type = "range";
    this.timeline.min = "0";
    this.timeline.setAttribute("aria-label", "Step of the flight");
    this.speeds = document.createElement("select");
    this.speeds.setAttribute("aria-label", "Speed");
    for (const speed of SPEEDS) this.speeds.add(new Option(`${speed}×`, String(speed)));
    this.speeds.value = String(this.#speed);
    const bar = element("div", "");
    bar.className = "transport";
    bar.append(this.button, this.timeline, this.speeds);
    this.bar = bar;
    place.append(canvas, bar);
    this.scene = new SceneView(canvas);
    this.button.addEventListener("click", () => {
      this.#playing = !this.#playing;
      if (this.#playing && this.#flown && this.#step >= this.#flown.actions.length) this.#step = 0;
      this.#show();
    });
    this.timeline.addEventListener("input", () => {
      this.#playing = false;
      this.seek(Number(this.timeline.value));
    });
    this.speeds.addEventListener("change", () => {
      this.#speed = Number(this.speeds.value);
    });
    requestAnimationFrame((now) => this.#frame(now));
  }

  get step() {
    return Math.floor(this.#step);
  }

  get isPlaying() {
    return this.#playing;
  }

  /** Play or pause. */
  set isPlaying(playing) {
    this.#playing = playing;
    this.#show();
  }

  /** Steps of the flight per step of the page's time; one of those to choose from. */
  set speed(/** @type {number} */ speed) {
    this.#speed = speed;
    this.speeds.value = String(speed);
  }

  /**
   * Shows another flight, from its start while it plays, else its end.
   * @param {Flown} flown
   * @param {string} label written over the scene
   */
  take(flown, label) {
    this.#flown = flown;
    this.#label = label;
    this.scene.setStart(flown.terrain, flown.seed);
    this.timeline.max = String(flown.actions.length);
    this.canvas.setAttribute("aria-label", `${label}, start ${flown.seed}: ${flown.outcome}`);
    this.seek(this.#playing ? 0 : flown.actions.length);
  }

  /** Shows a step of the flight. @param {number} step */
  seek(step) {
    this.#step = step;
    this.#ended = 0;
    this.#show();
  }

  /** Takes everything off the page. */
  close() {
    this.#closed = true;
    this.scene.close();
    this.canvas.remove();
    this.bar.remove();
  }

  #frame(/** @type {number} */ now) {
    if (this.#closed) return;
    const passed = Math.min(100, now - this.#then);
    this.#then = now;
    if (this.#playing && this.#flown && !document.hidden) {
      const last = this.#flown.actions.length;
      if (this.#step < last) {
        this.#step = Math.min(last, this.#step + (passed / 1000) * STEPS_PER_SECOND * this.#speed);
        this.#show();
      } else if ((this.#ended += passed * this.#speed) > HOLD) {
        this.#ended = 0;
        this.onEnd();
      }
    }
    requestAnimationFrame((next) => this.#frame(next));
  }

  #show() {
    this.button.textContent = this.#playing ? "Pause" : "Play";
    const flown = this.#flown;
    if (!flown) return;
    const step = this.step;
    const last = flown.actions.length;
    this.timeline.value = String(step);
    const observation = /** @type {Float32Array} */ (flown.observations[step]);
    this.scene.draw([{
      bodies: /** @type {Float32Array} */ (flown.bodies[step]),
      engines: step > 0 && step < last ? [/** @type {number} */ (flown.actions[step - 1])] : [],
      trail: flown.path.slice(0, step + 1),
      label: this.#label,
      dials: {
        step,
        return: flown.returns[step] ?? 0,
        fuel: flown.fuel[step] ?? 0,
        ...velocityOf(observation),
        angle: Number(observation[4]),
      },
      outcome: step === last ? flown.outcome : null,
    }]);
    this.onStep(step);
  }
}

/** @param {string} name @param {string} text */
function element(name, text) {
  const made = document.createElement(name);
  made.textContent = text;
  if (made instanceof HTMLButtonElement) made.type = "button";
  return made;
}

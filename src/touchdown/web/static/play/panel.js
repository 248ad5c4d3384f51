// The form beside the flight: who flies, rivals, start and conditions.
import { RANGES } from "touchdown/play/conditions.js";
import { MAX_SEED, YOU } from "touchdown/play/link.js";
import { RIVAL_COLOURS } from "touchdown/play/screens.js";

/** @typedef {import("touchdown/play/link.js").Setup} Setup */
/** @typedef {import("touchdown/play/conditions.js").Conditions} Conditions */

const LARGEST_DRAWN = 9999; // of random starts: a number that people can tell each other

export class Panel {
  /**
   * @param {HTMLFormElement} form
   * @param {string[]} names of the policies
   * @param {(setup: Setup) => void} onChange
   */
  constructor(form, names, onChange) {
    this.form = form;
    this.onChange = onChange;
    this.autopilot = names[0] ?? "";
    this.offer(names);
    this.fill("conditions", RANGES.map(slider));
    form.addEventListener("submit", (event) => event.preventDefault());
    form.addEventListener("input", (event) => this.showValue(event.target));
    form.addEventListener("change", (event) => {
      if (event.target instanceof HTMLInputElement && event.target.type === "file") return;
      this.showValue(event.target);
      this.onChange(this.read());
      leave(event.target);
    });
    this.button("random").addEventListener("click", () => this.drawStart());
    this.button("normal").addEventListener("click", () => {
      for (const { name, normal } of RANGES) this.set(name, String(normal));
      this.onChange(this.read());
    });
  }

  /**
   * The policies to choose from.
   * @param {string[]} names
   */
  offer(names) {
    this.fill("policies", [YOU, ...names].map((name) => chip("radio", "by", name)));
    this.fill("rivals", names.map((name) => chip("checkbox", "rival", name)));
  }

  /** A random start. */
  drawStart() {
    this.set("seed", String(Math.floor(Math.random() * (LARGEST_DRAWN + 1))));
    this.onChange(this.read());
  }

  /** @returns {Setup} */
  read() {
    const fields = new FormData(this.form);
    const by = String(fields.get("by") ?? YOU);
    if (by !== YOU) this.autopilot = by;
    const seed = Math.min(Math.max(Math.floor(Number(fields.get("seed"))) || 0, 0), MAX_SEED);
    const conditions = /** @type {Conditions} */ ({});
    for (const { name } of RANGES) conditions[name] = Number(fields.get(name));
    return {
      seed,
      byHand: by === YOU,
      autopilot: this.autopilot,
      rivals: fields.getAll("rival").map(String),
      conditions,
    };
  }

  /** @param {Setup} setup */
  write(setup) {
    this.autopilot = setup.autopilot;
    this.set("seed", String(setup.seed));
    for (const { name } of RANGES) this.set(name, String(setup.conditions[name]));
    const by = setup.byHand ? YOU : setup.autopilot;
    const shown = setup.rivals.filter((name) => name !== by);
    for (const input of this.form.querySelectorAll("input")) {
      if (input.name === "by") input.checked = input.value === by;
      if (input.name !== "rival") continue;
      input.checked = shown.includes(input.value);
      input.disabled = input.value === by;
      const colour = RIVAL_COLOURS[shown.indexOf(input.value) % RIVAL_COLOURS.length];
      input.parentElement?.style.setProperty("--dot", colour ?? "transparent");
    }
  }

  /**
   * @param {string} place
   * @param {HTMLElement[]} elements
   */
  fill(place, elements) {
    this.form.querySelector(`[data-place="${place}"]`)?.replaceChildren(...elements);
  }

  /**
   * @param {string} name
   * @param {string} value
   */
  set(name, value) {
    const input = this.form.elements.namedItem(name);
    if (!(input instanceof HTMLInputElement)) throw new Error(`the form has no ${name}`);
    input.value = value;
    this.showValue(input);
  }

  /** @param {EventTarget | null} input */
  showValue(input) {
    if (!(input instanceof HTMLInputElement) || input.type !== "range") return;
    const { text } = valueOf(input.name, Number(input.value));
    const amount = input.parentElement?.querySelector(".amount");
    if (amount) amount.textContent = text;
    input.setAttribute("aria-valuetext", text);
  }

  /** @param {string} name */
  button(name) {
    const found = this.form.querySelector(`[data-do="${name}"]`);
    if (!(found instanceof HTMLButtonElement)) throw new Error(`the form has no button ${name}`);
    return found;
  }
}

/**
 * Gives the arrow keys back to the lander, unless a keyboard brought the focus here.
 * @param {EventTarget | null} target
 */
export function leave(target) {
  if (target instanceof HTMLElement && !target.matches(":focus-visible")) target.blur();
}

/**
 * @param {"radio" | "checkbox"} type
 * @param {string} name
 * @param {string} value
 */
function chip(type, name, value) {
  const label = document.createElement("label");
  label.className = "chip";
  label.title = value;
  const input = Object.assign(document.createElement("input"), { type, name, value });
  const text = document.createElement("span");
  text.textContent = value;
  label.append(input, text);
  return label;
}

/** @param {import("touchdown/play/conditions.js").Range} range */
function slider({ name, low, high, step }) {
  const label = document.createElement("label");
  label.className = "slider";
  const text = document.createElement("span");
  text.textContent = valueOf(name, low).label;
  const input = document.createElement("input");
  Object.assign(input, { type: "range", name, min: low, max: high, step });
  const amount = document.createElement("span");
  amount.className = "amount";
  amount.ariaHidden = "true"; // the slider says it
  label.append(text, amount, input);
  return label;
}

/**
 * @param {string} name of a condition
 * @param {number} value
 */
function valueOf(name, value) {
  switch (name) {
    case "gravity":
      return { label: "Gravity", text: `${value.toFixed(1)} m/s²` };
    case "faults":
      return { label: "Engine faults", text: `${Math.round(100 * value)}% of steps` };
    case "noise":
      return { label: "Sensor noise", text: value === 0 ? "none" : `σ = ${value.toFixed(2)}` };
    case "wind":
      return { label: "Wind", text: value === 0 ? "none" : value.toFixed(1) };
    default:
      return { label: "Turbulence", text: value === 0 ? "none" : value.toFixed(1) };
  }
}

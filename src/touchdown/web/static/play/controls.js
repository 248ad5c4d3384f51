// What a person holds down: keys, buttons on the screen, a gamepad.
import { commandOf } from "touchdown/play/commands.js";
import { LEFT_ENGINE, MAIN_ENGINE, RIGHT_ENGINE } from "touchdown/common/actions.js";

const KEYS = /** @type {Record<string, number>} */ ({
  ArrowLeft: LEFT_ENGINE,
  ArrowUp: MAIN_ENGINE,
  ArrowRight: RIGHT_ENGINE,
  KeyA: LEFT_ENGINE,
  KeyW: MAIN_ENGINE,
  KeyD: RIGHT_ENGINE,
});
const STICK = 0.4; // how far a stick must be moved

export class Controls {
  /**
   * @param {HTMLElement[]} buttons each with the action in data-action
   * @param {() => void} onPress when an engine is pressed that was not
   */
  constructor(buttons, onPress) {
    this.onPress = onPress;
    /** @type {Map<string, number>} sources, such as a key, and the actions that they hold */
    this.sources = new Map();
    addEventListener("keydown", (event) => this.keyDown(event));
    addEventListener("keyup", (event) => this.release(event.code));
    addEventListener("blur", () => this.sources.clear());
    for (const button of buttons) this.listenTo(button);
  }

  /** The command of what is held; null if nothing is. */
  get command() {
    return this.sources.size > 0 ? commandOf(new Set(this.sources.values())) : null;
  }

  /** Reads gamepads, which send no events. */
  poll() {
    for (const pad of gamepads()) {
      if (!pad) continue;
      const [across = 0, down = 0] = pad.axes;
      /** @param {number[]} numbers */
      const pressed = (...numbers) => numbers.some((number) => pad.buttons[number]?.pressed);
      const held = [
        [LEFT_ENGINE, across < -STICK || pressed(14)],
        [MAIN_ENGINE, down < -STICK || pressed(0, 7, 12)],
        [RIGHT_ENGINE, across > STICK || pressed(15)],
      ];
      for (const [action, isHeld] of held) {
        const source = `pad ${pad.index} ${action}`;
        if (isHeld) this.press(source, Number(action));
        else this.release(source);
      }
    }
  }

  /** @param {KeyboardEvent} event */
  keyDown(event) {
    const action = KEYS[event.code];
    if (action === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
    if (needsKey(event.target, event.code)) return;
    event.preventDefault(); // arrows would scroll the page
    this.press(event.code, action);
  }

  /** @param {HTMLElement} button */
  listenTo(button) {
    const action = Number(button.dataset.action);
    const source = (/** @type {PointerEvent} */ event) => `pointer ${event.pointerId}`;
    button.addEventListener("pointerdown", (event) => {
      button.setPointerCapture(event.pointerId);
      this.press(source(event), action);
    });
    for (const type of /** @type {const} */ (["pointerup", "pointercancel", "lostpointercapture"])) {
      button.addEventListener(type, (event) => this.release(source(event)));
    }
    button.addEventListener("contextmenu", (event) => event.preventDefault()); // of a long press
  }

  /**
   * @param {string} source
   * @param {number} action
   */
  press(source, action) {
    if (this.sources.get(source) === action) return;
    this.sources.set(source, action);
    this.onPress();
  }

  /** @param {string} source */
  release(source) {
    this.sources.delete(source);
  }
}

/** @returns {(Gamepad | null)[]} */
function gamepads() {
  try {
    return navigator.getGamepads?.() ?? [];
  } catch {
    return []; // a page may forbid it to a frame in it
  }
}

/**
 * Whether an element that has the focus needs a key itself.
 * @param {EventTarget | null} target
 * @param {string} code of the key
 */
export function needsKey(target, code) {
  if (!(target instanceof HTMLElement)) return false;
  if (target.matches("select, textarea, input:is([type=number], [type=text])")) return true;
  if (code === "Space") return target.matches("button, a, summary, input:not([type=range])");
  return code.startsWith("Arrow") && target.matches("input:is([type=range], [type=radio])");
}

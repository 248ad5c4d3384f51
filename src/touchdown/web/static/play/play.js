// The playground: the game on the page.
import { normalConditions } from "touchdown/play/conditions.js";
import { Controls } from "touchdown/play/controls.js";
import { readBinary, readData } from "touchdown/common/data.js";
import { Display } from "touchdown/play/display.js";
import { loadEngine } from "touchdown/engine/engine.js";
import { Game } from "touchdown/play/game.js";
import { Address, linkOf } from "touchdown/play/address.js";
import { checkOf } from "touchdown/play/link.js";
import { Panel } from "touchdown/play/panel.js";
import { element, part } from "touchdown/common/parts.js";
import { addPolicy, makePolicies } from "touchdown/policies/registry.js";
import { describe, ranking } from "touchdown/play/reports.js";
import { showBestFlights } from "touchdown/play/best-flights-table.js";
import { BestFlights } from "touchdown/play/best-flights.js";
import { copyLink } from "touchdown/play/share.js";
import { Transport } from "touchdown/play/transport.js";

/** @typedef {import("touchdown/play/link.js").Setup} Setup */
/** @typedef {import("touchdown/play/game.js").GameEvent} GameEvent */

const DEMO_PAUSE = 2.5; // seconds between the flights that are shown until a person does something

class Playground {
  /**
   * @param {import("touchdown/engine/engine.js").Engine} engine
   * @param {import("touchdown/policies/registry.js").Policies} policies
   * @param {number} seed of the first start
   */
  constructor(engine, policies, seed) {
    this.names = [...policies.keys()];
    this.policies = policies;
    this.display = new Display();
    this.bestFlights = new BestFlights();
    this.calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.address = new Address();
    /** Whether flights are shown until a person does something. */
    this.demo = true;
    this.waited = 0;
    /** @type {import("touchdown/play/link.js").Shared | null} whose flight this is, if a link's */
    this.shared = null;
    this.game = new Game(engine, policies, this.demoSetup(seed), (event) => this.onEvent(event));
    this.controls = new Controls(
      [...document.querySelectorAll("[data-action]")].filter((each) => each instanceof HTMLElement),
      () => this.onPress(),
    );
    this.transport = new Transport(element(".bar"), this.game, this.actions(), () => this.controls.command);
    this.panel = new Panel(part(document, "form", HTMLFormElement), this.names, (setup) => {
      this.endDemo();
      this.begin(setup);
    });
    addEventListener("hashchange", () => {
      if (!this.openLink() && this.address.complaint) this.say(this.address.complaint);
    });
    const file = part(document, "[type=file]", HTMLInputElement);
    file.addEventListener("change", () => void this.addWeights(file));
    showBestFlights(element(".best"), this.bestFlights.list);
    if (!this.openLink()) this.startDemo(seed);
    requestAnimationFrame((now) => this.frame(now, now));
  }

  /** @returns {import("touchdown/play/transport.js").Actions} */
  actions() {
    const { game } = this;
    const inGame = (/** @type {() => void} */ act) => () => {
      this.endDemo();
      act();
    };
    return {
      restart: inGame(() => this.begin(game.setup)),
      next: inGame(() => this.panel.drawStart()),
      fly: inGame(() => this.begin(this.byHand())),
      watch: inGame(() => this.begin({ ...game.setup, byHand: false })),
      autopilot: inGame(() => {
        this.address.forget();
        if (!game.race.lead.over) this.shared = null; // it is another flight now
        game.toggleAutopilot();
      }),
      view: () => this.turnView(),
      share: () => void this.share(),
      clear: () => {
        this.bestFlights.clear();
        showBestFlights(element(".best"), this.bestFlights.list);
      },
    };
  }

  /** @param {number} seed */
  demoSetup(seed) {
    const [autopilot = "", ...others] = this.names;
    return { seed, byHand: false, autopilot, rivals: others, conditions: normalConditions() };
  }

  /** @param {number} seed */
  startDemo(seed) {
    this.demo = true;
    this.waited = 0;
    this.game.begin(this.demoSetup(seed));
    if (!this.calm) this.game.play();
  }

  endDemo() {
    this.demo = false;
    this.showHint();
  }

  /** Says how to fly, until a person does. */
  showHint() {
    const { race, playing, setup } = this.game;
    const ready = setup.byHand && race.recorded === 0 && !playing;
    element(".hint").hidden = !(this.demo || ready);
    part(document, ".hint [data-do=fly]", HTMLButtonElement).hidden = !this.demo;
  }

  /** @returns {Setup} the present start by hand, against the first policy */
  byHand() {
    const { setup } = this.game;
    const rivals = this.names.slice(0, 1);
    return { ...setup, byHand: true, autopilot: this.names[0] ?? "", rivals };
  }

  /**
   * @param {Setup} setup
   * @param {number[]} [planned]
   */
  begin(setup, planned) {
    this.shared = null;
    this.address.forget();
    this.game.begin(setup, planned);
    if (!setup.byHand) this.game.play();
  }

  /**
   * Begins the flight of the page's address.
   * @returns {boolean} whether there is one
   */
  openLink() {
    const shared = this.address.read(this.policies);
    if (!shared) return false;
    const { setup, commands } = shared;
    setup.autopilot ||= this.names[0] ?? "";
    this.endDemo();
    this.begin(setup, commands);
    this.shared = shared;
    if (commands.length > 0) this.game.play();
    return true;
  }

  onPress() {
    if (this.demo) {
      this.endDemo();
      this.begin(this.byHand());
    }
    this.address.forget();
    if (this.game.takeOver()) this.shared = null; // it is another flight now
  }

  /** @param {GameEvent} event */
  onEvent(event) {
    this.display.stale = true;
    if (event === "started") {
      this.display.show(this.game);
      this.panel.write(this.game.setup);
    }
    if (event === "ended" && !this.demo) this.keepFlight();
    if (!this.demo && !this.game.playing) this.address.write(this.game);
    this.showHint();
    element(".after").hidden = !this.game.race.over || this.demo;
    this.say(this.statusAfter(event));
  }

  /** @param {GameEvent} event */
  statusAfter(event) {
    const { game } = this;
    const { complaint } = this.address;
    if (this.demo || complaint) return complaint;
    if (event === "handed over") return "Your turn: the link ends here. Press an engine to fly on.";
    if (!game.race.over) return describe(game);
    const check = this.shared?.check;
    const differs = check && check !== checkOf(game.race.flights);
    return ranking(game) + (differs ? " This flight differs from the shared one." : "");
  }

  keepFlight() {
    const { race, flownBy, setup } = this.game;
    const { lead } = race;
    if (!lead.byHand || !lead.outcome || this.shared) return;
    const { return: episodeReturn, fuel } = lead.at(lead.steps);
    const { outcome, steps } = lead;
    const link = linkOf(this.game);
    this.bestFlights.add({
      by: flownBy, seed: setup.seed, return: episodeReturn, outcome, fuel, steps, link,
    });
    showBestFlights(element(".best"), this.bestFlights.list);
  }

  async share() {
    this.endDemo();
    this.game.pause();
    this.say(await copyLink(`${location.href.split("#")[0]}#${linkOf(this.game)}`));
  }

  /**
   * Another rival, from a file of weights.
   * @param {HTMLInputElement} input
   */
  async addWeights(input) {
    const [file] = input.files ?? [];
    if (!file) return;
    const { engine, policies, setup } = this.game;
    try {
      const name = await addPolicy(engine, policies, file);
      this.names.push(name);
      this.panel.offer(this.names);
      this.panel.write(setup);
      if (this.address.waits) {
        if (!this.openLink()) this.say(this.address.complaint);
      } else {
        this.endDemo();
        this.begin({ ...setup, rivals: [...setup.rivals, name] });
      }
    } catch (error) {
      this.say(`${file.name}: ${error instanceof Error ? error.message : error}.`);
    }
    input.value = ""; // the same file can be chosen again
  }

  turnView() {
    const button = part(document, "[data-do=view]", HTMLButtonElement);
    const sideBySide = button.getAttribute("aria-pressed") === "false";
    button.setAttribute("aria-pressed", String(sideBySide));
    this.display.showSideBySide(this.game, sideBySide);
  }

  /** @param {string} text */
  say(text) {
    const status = element("[role=status]");
    if (status.textContent !== text) status.textContent = text;
  }

  /**
   * @param {number} now milliseconds
   * @param {number} before time of the last frame
   */
  frame(now, before) {
    const { game } = this;
    const seconds = (now - before) / 1000;
    this.controls.poll();
    if (this.display.visible || !this.demo) game.tick(seconds, this.controls.command);
    if (this.demo && game.race.over) {
      this.waited += seconds;
      if (this.waited > DEMO_PAUSE) this.startDemo(game.setup.seed + 1);
    }
    if (game.playing || this.display.stale) {
      this.display.draw(game);
      this.transport.update();
    }
    requestAnimationFrame((next) => this.frame(next, now));
  }
}

const data = readData();
const engine = await loadEngine(readBinary("lander.wasm"));
new Playground(engine, makePolicies(engine, data.policies, readBinary), data.seed);

// The playground: the game on the page.
import { normalConditions } from "touchdown/play/conditions.js";
import { Controls } from "touchdown/play/controls.js";
import { readBinary, readData } from "touchdown/common/data.js";
import { Display } from "touchdown/play/display.js";
import { loadEngine } from "touchdown/engine/engine.js";
import { Game } from "touchdown/play/game.js";
import { checkOf, readLink, writeLink } from "touchdown/play/link.js";
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
    this.complaint = ""; // about the link
    /** Whether flights are shown until a person does something. */
    this.demo = true;
    this.waited = 0;
    /** Whether the flight is that of a link, by whoever made it. */
    this.isShared = false;
    /** @type {string | null} of how a shared flight went where it was shared */
    this.expected = null;
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
      if (!this.openLink() && this.complaint) this.say(this.complaint);
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
        if (!game.race.lead.over) this.isShared = false; // it is another flight now
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
    this.isShared = false;
    this.game.begin(setup, planned);
    if (!setup.byHand) this.game.play();
  }

  /**
   * Begins the flight of the page's address.
   * @returns {boolean} whether there is one
   */
  openLink() {
    try {
      const shared = readLink(location.hash);
      if (!shared) return false;
      const { setup, commands, check } = shared;
      setup.autopilot ||= this.names[0] ?? "";
      const unknown = [setup.autopilot, ...setup.rivals].find((name) => !this.policies.has(name));
      if (unknown !== undefined) throw new RangeError(`this page has no policy ${unknown}`);
      this.endDemo();
      this.begin(setup, commands);
      this.isShared = true;
      this.expected = check;
      if (commands.length > 0) this.game.play();
      return true;
    } catch (error) {
      if (!(error instanceof RangeError)) throw error;
      this.complaint = `The link cannot be opened: ${error.message}.`;
      return false;
    }
  }

  onPress() {
    if (this.demo) {
      this.endDemo();
      this.begin(this.byHand());
    }
    if (this.game.takeOver()) this.isShared = false; // it is another flight now
  }

  /** @param {GameEvent} event */
  onEvent(event) {
    this.display.stale = true;
    if (event === "started") {
      this.display.show(this.game);
      this.panel.write(this.game.setup);
    }
    if (event === "ended" && !this.demo) this.keepFlight();
    if (!this.demo && !this.game.playing) this.writeAddress();
    this.showHint();
    element(".after").hidden = !this.game.race.over || this.demo;
    this.say(this.statusAfter(event));
  }

  /** @param {GameEvent} event */
  statusAfter(event) {
    const { game } = this;
    if (this.demo) return this.complaint;
    if (event === "handed over") return "Your turn: the link ends here. Press an engine to fly on.";
    if (!game.race.over) return describe(game);
    const expected = this.isShared ? this.expected : null;
    const differs = expected !== null && expected !== checkOf(game.race.flights);
    return ranking(game) + (differs ? " This flight differs from the shared one." : "");
  }

  keepFlight() {
    const { race, flownBy, setup } = this.game;
    const { lead } = race;
    if (!lead.byHand || !lead.outcome || this.isShared) return;
    const { return: episodeReturn, fuel } = lead.at(lead.steps);
    const { outcome, steps } = lead;
    const link = this.link();
    this.bestFlights.add({
      by: flownBy, seed: setup.seed, return: episodeReturn, outcome, fuel, steps, link,
    });
    showBestFlights(element(".best"), this.bestFlights.list);
  }

  /** The present flight as the part of a URL after #. */
  link() {
    const { setup, race } = this.game;
    const { lead } = race;
    const complete = race.flights.every((flight) => flight.over);
    const known = lead.over ? lead.commands : [...lead.commands, ...race.planned.slice(lead.steps)];
    return writeLink(setup, lead.byHand ? known : [], complete ? checkOf(race.flights) : null);
  }

  writeAddress() {
    const address = `#${this.link()}`;
    if (address === location.hash) return;
    try {
      history.replaceState(null, "", address);
    } catch {
      // a browser may forbid it to a file, or after many changes
    }
  }

  async share() {
    this.endDemo();
    this.game.pause();
    this.say(await copyLink(`${location.href.split("#")[0]}#${this.link()}`));
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
      this.endDemo();
      this.begin({ ...setup, rivals: [...setup.rivals, name] });
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

// The page on which runs are watched: what comes from the source is drawn, a few times a second.

import { drawCards } from "touchdown/watch/cards.js";
import { drawCurve, drawEpsilon, drawLoss, drawOutcomes, drawQ, ORDER } from "touchdown/watch/charts.js";
import { Films } from "touchdown/watch/films.js";
import { RunHistory } from "touchdown/watch/history.js";
import { onClick } from "touchdown/watch/plot.js";
import { openSource } from "touchdown/watch/source.js";
import { onTheme } from "touchdown/common/theme.js";
import { groupColour, MOST_COLOURS, readColours } from "touchdown/watch/theme.js";

/** @typedef {import("touchdown/watch/source.js").Connection} Connection */

const PAUSE = 400; // milliseconds between two drawings

/** @param {string} id @returns {HTMLElement} */
function byId(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page has no element #${id}`);
  return element;
}

const SAID = {
  live: "live",
  lost: "no connection: the server has ended, or is busy; what you see is what came before",
  file: "saved copy",
};

export function start() {
  const source = openSource();
  const histories = new Map(source.runs.map((key) => [key, new RunHistory(key)]));
  /** @type {import("touchdown/watch/history.js").Axis} */
  let axis = "env_steps";
  let colours = readColours();
  /** @type {{from: number, to: number}|null} */
  let range = null;
  let isDrawing = false;
  let isStale = false;
  let listens = false;
  const films = new Films(byId("flight"), byId("details"), source, () => ({ colours, axis }));

  function view() {
    const all = [...histories.values()];
    const groups = [...new Set(all.map((each) => each.facts?.alike || each.key))];
    const byGroup = groups.length < all.length && all.length > MOST_COLOURS;
    const runs = all.map((history, index) => {
      const at = byGroup ? groups.indexOf(history.facts?.alike || history.key) : index;
      return { history, colour: groupColour(colours, at, byGroup ? groups.length : all.length) };
    });
    return { runs, colours, axis };
  }

  async function drawAll() {
    const shown = view();
    drawCards(byId("runs"), shown.runs);
    drawNotices(shown.runs.map((run) => run.history));
    const each = await drawCurve(byId("curve"), shown, range);
    byId("curve-note").textContent = noteOf(shown, each);
    byId("outcomes-note").textContent = shown.runs.length === 1
      ? "Shares among the last 100 training episodes."
      : "Share of landings (elsewhere of time limits) among the last 100 training episodes.";
    await drawLoss(byId("loss"), shown);
    await drawOutcomes(byId("outcomes"), shown);
    await drawQ(byId("q"), shown);
    await drawEpsilon(byId("epsilon"), shown);
    drawKey(byId("key"), shown.runs.map((run) => run.history));
    films.update(shown.runs.map((run) => run.history));
    if (!listens) {
      listens = true;
      listen();
    }
  }

  /** Draws soon, and once more afterwards if something changes meanwhile. */
  function draw() {
    if (isDrawing || document.hidden) {
      isStale = true;
      return;
    }
    isDrawing = true;
    isStale = false;
    setTimeout(async () => {
      try {
        await drawAll();
      } finally {
        isDrawing = false;
        if (isStale) draw();
      }
    }, PAUSE);
  }

  function listen() {
    const curve = byId("curve");
    onClick(curve, ([run, episode]) => void films.flyEpisode(run, episode));
    /** @type {any} */ (curve).on("plotly_relayout", (/** @type {Record<string, any>} */ change) => {
      if ("xaxis.range[0]" in change)
        range = { from: change["xaxis.range[0]"], to: change["xaxis.range[1]"] };
      else if (change["xaxis.autorange"]) range = null;
      else return;
      draw();
    });
  }

  for (const button of document.querySelectorAll("[data-axis]")) {
    button.addEventListener("click", () => {
      axis = /** @type {typeof axis} */ (/** @type {HTMLElement} */ (button).dataset["axis"]);
      range = null;
      for (const each of document.querySelectorAll("[data-axis]"))
        each.setAttribute("aria-pressed", String(each === button));
      draw();
    });
  }
  byId("all-runs").hidden = !source.isLive;
  onTheme(() => {
    colours = readColours();
    draw();
  });
  document.addEventListener("visibilitychange", () => {
    if (!document.hidden && isStale) draw();
  });
  source.listen(
    (message) => {
      histories.get(message.run)?.take(message);
      draw();
    },
    (state) => sayConnection(state),
  );
  draw();
}

/** @param {Connection} state */
function sayConnection(state) {
  const line = byId("connection");
  line.textContent = SAID[state];
  if (state === "file") delete line.dataset["state"];
  else line.dataset["state"] = state;
}

/** The colours of outcomes, of one run alone. @param {HTMLElement} key @param {RunHistory[]} histories */
function drawKey(key, histories) {
  const found = new Set(histories.length === 1 ? histories[0]?.episodes.get("outcome") : []);
  key.hidden = !found.size;
  key.replaceChildren(...ORDER.filter((outcome) => found.has(outcome)).map((outcome) => {
    const item = document.createElement("li");
    item.textContent = outcome;
    item.dataset["outcome"] = outcome;
    return item;
  }));
}

/** @param {RunHistory[]} histories */
function drawNotices(histories) {
  const texts = histories.flatMap((history) => {
    if (history.isUnknown)
      return [`${history.label}: This run no longer exists. “All runs” lists the others.`];
    if (!history.facts) return [];
    if (history.facts.status === "gone")
      return [`${history.label}: was deleted; what you see is what was read before.`];
    return history.facts.error ? [`${history.label}: ${history.facts.error}`] : [];
  });
  const said = [...document.querySelectorAll("#notices .notice")].map((each) => each.textContent);
  if (said.join("\n") === texts.join("\n")) return; // a screen reader is not told again
  byId("notices").replaceChildren(...texts.map((text) => {
    const line = document.createElement("p");
    line.className = "notice";
    line.textContent = text;
    return line;
  }));
}

/** @param {import("touchdown/watch/charts.js").View} shown @param {number} each */
function noteOf(shown, each) {
  const history = shown.runs[0]?.history;
  const parts = [];
  if (shown.runs.length === 1)
    parts.push("Points: training episodes. Line: mean of the last 100. Diamonds: validations, greedy.");
  else parts.push("Lines: mean of the last 100 training episodes. Dotted: validations, greedy.");
  if (each > 1) parts.push(`One of ${each} episodes is drawn; zoom in for more.`);
  if (history?.facts?.has_flights) parts.push("Click a point to fly that episode.");
  return parts.join(" ");
}

// The charts of the records: each is drawn from histories, by a function of its own.

import { FIRSTS } from "touchdown/watch/choices.js";
import { drawPlot, plain } from "touchdown/watch/plot.js";
import { faded, outcomeColour } from "touchdown/watch/theme.js";
import {
  binned, firstAtLeast, movingMean, outcomeShares, rowsOfWindow, thinned, WINDOW,
} from "touchdown/watch/history.js";

/** @typedef {import("touchdown/watch/history.js").RunHistory} RunHistory */
/** @typedef {import("touchdown/watch/history.js").Axis} Axis */
/** @typedef {import("touchdown/watch/theme.js").Colours} Colours */
/** @typedef {{history: RunHistory, colour: string}} Shown */
/** @typedef {{runs: Shown[], colours: Colours, axis: Axis}} View */

const MOST_POINTS = 1500;
const NO_EPISODES = "no episodes so far";
const NO_UPDATES = "no updates so far";

/** @param {Axis} axis */
const axisName = (axis) => (axis === "seconds" ? "seconds of training" : "environment steps");

/** @param {View} view */
const xaxis = (view) => ({ rangemode: "tozero", tickformat: view.axis === "seconds" ? "" : "~s" });

/**
 * Training episodes, their moving mean, and the validations.
 * @param {HTMLElement} element
 * @param {View} view
 * @param {{from: number, to: number}|null} range of the axis that is looked at; null is all
 * @returns {Promise<number>} of how many episodes one is drawn
 */
export async function drawCurve(element, view, range) {
  const isOne = view.runs.length === 1;
  const traces = [];
  let leftOut = 1;
  for (const { history, colour } of view.runs) {
    const xs = history.axis("episodes", view.axis);
    const returns = history.episodes.get("episode_return");
    const means = movingMean(returns, rowsOfWindow(history.episodes));
    const start = range ? Math.max(0, firstAtLeast(xs, range.from) - 1) : 0;
    const end = range ? Math.min(xs.length, firstAtLeast(xs, range.to) + 1) : xs.length;
    const drawn = thinned(start, end, isOne ? MOST_POINTS : MOST_POINTS / 3);
    const size = Math.ceil((end - start) / Math.max(1, drawn.length)) * history.episodes.stride;
    leftOut = Math.max(leftOut, size);
    if (isOne) traces.push(episodesOf(history, view, drawn, xs));
    traces.push({
      x: drawn.map((row) => xs[row]),
      y: drawn.map((row) => means[row]),
      customdata: drawn.map((row) => [history.key, history.episodes.get("episode")[row]]),
      name: plain(history.label),
      mode: "lines",
      line: { color: colour, width: 2 },
      hovertemplate: `${isOne ? "" : "%{fullData.name}<br>"}mean of ${WINDOW} episodes: %{y:.1f}<extra></extra>`,
    });
    traces.push(validationsOf(history, view, colour, isOne));
  }
  const one = isOne ? view.runs[0] : undefined;
  const threshold = view.runs[0]?.history.facts?.threshold ?? null;
  await drawPlot(element, traces, view.colours, {
    x: axisName(view.axis),
    y: "episode return",
    xaxis: xaxis(view),
    yaxis: returnsRange(view),
    revision: view.axis,
    empty: NO_EPISODES,
    shapes: threshold === null ? [] : [thresholdLine(threshold, view.colours)],
    annotations: one ? firstsOf(one.history, view) : [],
  });
  return leftOut;
}

/** @param {RunHistory} history @param {View} view @param {number[]} drawn @param {number[]} xs */
function episodesOf(history, view, drawn, xs) {
  const episodes = history.episodes;
  const outcomes = episodes.get("outcome");
  const lowest = lowestShown(history);
  return {
    x: drawn.map((row) => xs[row]),
    y: drawn.map((row) => Math.max(lowest, episodes.get("episode_return")[row])),
    customdata: drawn.map((row) => [
      history.key,
      episodes.get("episode")[row],
      episodes.get("episode_return")[row],
      outcomes[row],
      episodes.get("steps")[row],
    ]),
    name: "episodes",
    mode: "markers",
    marker: {
      color: drawn.map((row) => outcomeColour(view.colours, outcomes[row])),
      symbol: drawn.map((row) =>
        episodes.get("episode_return")[row] < lowest ? "triangle-down" : "circle"),
      size: 5,
      opacity: 0.55,
    },
    hovertemplate:
      "episode %{customdata[1]}: %{customdata[3]}<br>return %{customdata[2]:.1f}, " +
      "%{customdata[4]} steps<extra></extra>",
  };
}

/** @param {RunHistory} history @param {View} view @param {string} colour @param {boolean} isOne */
function validationsOf(history, view, colour, isOne) {
  const rows = history.validations;
  return {
    x: history.axis("validations", view.axis),
    y: rows.get("mean_return"),
    customdata: rows.get("mean_return").map((_, row) => [
      null, null, rows.get("worst_return")[row], rows.get("best_return")[row],
    ]),
    name: isOne ? "validation" : plain(history.label),
    mode: "lines+markers",
    line: { color: isOne ? view.colours.ink : faded(colour, 0.55), width: 1, dash: "dot" },
    marker: { symbol: "diamond", size: isOne ? 8 : 5, color: isOne ? view.colours.ink : colour },
    hovertemplate:
      `${isOne ? "" : "%{fullData.name}<br>"}validation: mean %{y:.1f}<br>` +
      "%{customdata[2]:.0f} to %{customdata[3]:.0f}<extra></extra>",
  };
}

/** Lower returns are drawn at the edge, so that they do not squeeze the rest. */
function lowestShown(/** @type {RunHistory} */ history) {
  const sorted = history.episodes.get("episode_return").toSorted((a, b) => a - b);
  if (sorted.length < 20) return sorted[0] ?? 0;
  return sorted[Math.floor(sorted.length * 0.03)];
}

/** @param {View} view */
function returnsRange(view) {
  return view.runs.length === 1 ? {} : { rangemode: "normal" };
}

/** @param {number} threshold @param {Colours} colours */
function thresholdLine(threshold, colours) {
  return {
    type: "line", xref: "paper", x0: 0, x1: 1, y0: threshold, y1: threshold,
    line: { color: colours.muted, width: 1, dash: "dash" },
  };
}

/** Marks of the first crash, the first time-out and the first landing. */
function firstsOf(/** @type {RunHistory} */ history, /** @type {View} */ view) {
  if (!history.facts?.is_lander) return [];
  const lowest = lowestShown(history);
  return FIRSTS.flatMap(([outcome, text], place) => {
    const first = history.first(outcome);
    if (!first) return [];
    return [{
      x: first[view.axis], y: Math.max(lowest, first.episode_return), text, showarrow: true, arrowhead: 0,
      arrowwidth: 1, arrowcolor: view.colours.muted, ax: 22, ay: 24 + 16 * place,
      xanchor: "left", font: { size: 11, color: view.colours.ink },
      bgcolor: faded(view.colours.card, 0.8),
    }];
  });
}

/** @param {HTMLElement} element @param {View} view */
export function drawLoss(element, view) {
  const traces = view.runs.map(({ history, colour }) =>
    line(history, binned(history.axis("updates", view.axis), history.updates.get("loss")), colour, ".3g"));
  return drawPlot(element, traces, view.colours, {
    x: axisName(view.axis), y: "loss", xaxis: xaxis(view), revision: view.axis, empty: NO_UPDATES,
    yaxis: { type: "log", exponentformat: "power", nticks: 5 },
  });
}

/** @param {HTMLElement} element @param {View} view */
export function drawEpsilon(element, view) {
  const traces = view.runs.map(({ history, colour }) =>
    line(history, binned(history.axis("episodes", view.axis), history.episodes.get("epsilon")), colour, ".3f"));
  return drawPlot(element, traces, view.colours, {
    x: axisName(view.axis), y: "ε", xaxis: xaxis(view), revision: view.axis, empty: NO_EPISODES,
    yaxis: { rangemode: "tozero" },
  });
}

/** @param {HTMLElement} element @param {View} view */
export function drawQ(element, view) {
  const isOne = view.runs.length === 1;
  const traces = view.runs.flatMap(({ history, colour }) => {
    const xs = history.axis("updates", view.axis);
    const mean = line(history, binned(xs, history.updates.get("mean_q")), colour, ".1f");
    if (!isOne) return [mean];
    const top = line(history, binned(xs, history.updates.get("max_q")), faded(colour, 0.45), ".1f");
    return [{ ...top, name: "maximum" }, { ...mean, name: "mean" }];
  });
  return drawPlot(element, traces, view.colours, {
    x: axisName(view.axis), y: "Q", xaxis: xaxis(view), revision: view.axis, empty: NO_UPDATES, legend: isOne,
    hovermode: isOne ? "x unified" : "closest",
  });
}

/**
 * Of one run the share of each outcome; of several, the share of landings or of time limits.
 * @param {HTMLElement} element @param {View} view
 */
export function drawOutcomes(element, view) {
  const only = view.runs.length === 1 ? view.runs[0] : undefined;
  const traces = only ? mixOf(only.history, view) : view.runs.map(({ history, colour }) => {
    const shares = sharesOf(history);
    const wanted = history.facts?.is_lander ? "landed" : "timed out";
    const xs = history.axis("episodes", view.axis);
    return line(history, binned(xs, shares.get(wanted) ?? xs.map(() => 0)), colour, ".0%");
  });
  return drawPlot(element, traces, view.colours, {
    x: axisName(view.axis), y: "share", xaxis: xaxis(view), revision: view.axis, empty: NO_EPISODES,
    yaxis: { range: [0, 1], tickformat: ".0%" }, hovermode: only ? "x unified" : "closest",
  });
}

/** The order of outcomes, from the best. */
export const ORDER = ["landed", "timed out", "crashed", "out of bounds", "terminated"];

/** @param {RunHistory} history @param {View} view */
function mixOf(history, view) {
  const shares = sharesOf(history);
  const xs = history.axis("episodes", view.axis);
  return ORDER.filter((outcome) => shares.has(outcome)).map((outcome) => {
    const points = binned(xs, shares.get(outcome) ?? []);
    const colour = outcomeColour(view.colours, outcome);
    return {
      ...points, name: outcome, mode: "lines", stackgroup: "all", fillcolor: faded(colour, 0.6),
      line: { color: colour, width: 0.5 }, hovertemplate: "%{y:.0%}",
    };
  });
}

/** @param {RunHistory} history */
function sharesOf(history) {
  return outcomeShares(history.episodes.get("outcome"), rowsOfWindow(history.episodes));
}

/** @param {RunHistory} history @param {{x: number[], y: number[]}} points @param {string} colour @param {string} format */
function line(history, points, colour, format) {
  return {
    ...points, name: plain(history.label), mode: "lines", line: { color: colour, width: 1.75 },
    hovertemplate: `%{y:${format}}`,
  };
}

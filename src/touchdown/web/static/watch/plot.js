// Plotly with our look: one chart in one element, drawn again when its data or the theme change.

/** @typedef {import("touchdown/watch/theme.js").Colours} Colours */
/** @typedef {Record<string, any>} Trace */

/**
 * @typedef {object} PlotlyScript
 * @property {(element: HTMLElement, traces: Trace[], layout: object, config: object) => Promise<void>} react
 * @property {{resize: (element: HTMLElement) => void}} Plots
 */

/** @returns {PlotlyScript} */
function plotly() {
  return /** @type {any} */ (globalThis).Plotly;
}

const CONFIG = {
  displayModeBar: false,
  doubleClick: "reset",
  responsive: true,
  scrollZoom: false,
  showTips: false,
};

/** Text for Plotly, which reads tags and entities in it. */
export function plain(/** @type {string} */ text) {
  return text.replace(/[&<>]/g, (sign) => `&#${sign.charCodeAt(0)};`);
}

/** @param {string} text @param {Colours} colours */
function axisTitle(text, colours) {
  return { text, font: { size: 11, color: colours.muted }, standoff: 6 };
}

/** A text in the middle of a chart. @param {string} text @param {Colours} colours */
function said(text, colours) {
  const middle = { xref: "paper", yref: "paper", x: 0.5, y: 0.5 };
  return { ...middle, text, showarrow: false, font: { size: 12, color: colours.muted } };
}

/**
 * @param {HTMLElement} element
 * @param {Trace[]} traces
 * @param {Colours} colours
 * @param {{x: string, y: string, xaxis?: object, yaxis?: object, legend?: boolean,
 *   hovermode?: string, shapes?: object[], annotations?: object[], revision?: string,
 *   empty?: string}} options where `empty` is said instead of a chart without points
 */
export function drawPlot(element, traces, colours, options) {
  const axis = {
    automargin: true,
    color: colours.muted,
    gridcolor: colours.line,
    zerolinecolor: colours.line,
    linecolor: colours.line,
    tickfont: { size: 11 },
    fixedrange: matchMedia("(pointer: coarse)").matches, // so that a finger scrolls the page
  };
  const isEmpty = traces.every((trace) => !trace.x?.length);
  const shown = isEmpty ? { ...axis, showgrid: false, showticklabels: false, zeroline: false } : axis;
  const layout = {
    autosize: true,
    margin: { l: 44, r: 10, t: 8, b: 36 },
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: "inherit", color: colours.ink, size: 12 },
    hoverlabel: {
      bgcolor: colours.card,
      bordercolor: colours.line,
      font: { color: colours.ink, size: 12 },
      namelength: -1,
    },
    hovermode: options.hovermode ?? "closest",
    showlegend: options.legend ?? false,
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { size: 11 } },
    xaxis: { ...shown, title: axisTitle(options.x, colours), ...options.xaxis },
    yaxis: { ...shown, title: axisTitle(options.y, colours), ...options.yaxis },
    shapes: isEmpty ? [] : options.shapes ?? [],
    annotations: isEmpty ? [said(options.empty ?? "", colours)] : options.annotations ?? [],
    uirevision: options.revision ?? "same", // what the reader has zoomed to stays
  };
  return plotly().react(element, traces, layout, CONFIG);
}

/**
 * Calls a function with the custom data of a point that is clicked, if it begins with something.
 * @param {HTMLElement} element a drawn chart
 * @param {(data: any) => void} clicked
 */
export function onClick(element, clicked) {
  const chart = /** @type {any} */ (element);
  chart.on("plotly_click", (/** @type {{points: {customdata?: any}[]}} */ event) => {
    const found = event.points.find((point) => point.customdata?.[0]);
    if (found) clicked(found.customdata);
  });
}

// The scale of a picture: metres of the scene to pixels.

/** Metres that a picture shows above y = 0. */
export const WIDTH = 20;
export const HEIGHT = 40 / 3;
/** Metres of ground below y = 0, where the dials are. */
export const DASHBOARD = 5 / 3;
/** Width over height of a picture. */
export const ASPECT = WIDTH / (HEIGHT + DASHBOARD);
/** Gymnasium's units of length per metre: the pixels of a picture 600 pixels wide. */
export const UNITS_PER_METRE = 30;

export class Frame {
  /** @param {number} width of the picture in pixels */
  constructor(width) {
    this.width = width;
    this.height = Math.round(width / ASPECT);
    this.pixelsPerMetre = width / WIDTH;
    /** Pixels per pixel of a picture 600 pixels wide. */
    this.scale = this.pixelsPerMetre / UNITS_PER_METRE;
  }

  /** @param {number} metres */
  column(metres) {
    return metres * this.pixelsPerMetre;
  }

  /** @param {number} metres above the lowest point of the scene */
  row(metres) {
    return (HEIGHT - metres) * this.pixelsPerMetre;
  }
}

/**
 * A canvas that is not on the page, and its context.
 * @param {number} width
 * @param {number} height
 */
export function makeCanvas(width, height) {
  const canvas = document.createElement("canvas");
  canvas.width = width;
  canvas.height = height;
  return { canvas, context: contextOf(canvas) };
}

/**
 * @param {HTMLCanvasElement} canvas
 * @returns {CanvasRenderingContext2D}
 */
export function contextOf(canvas) {
  const context = canvas.getContext("2d");
  if (!context) throw new Error("this browser has no 2D canvas");
  return context;
}

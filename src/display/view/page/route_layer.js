// @ts-check
// The borders of the stage and the route. They are constant while the dragon moves, so they are drawn once for each camera, and then copied.

/** @typedef {import('./camera.js').Camera} Camera */
/** @typedef {import('./camera.js').Box} Box */
/** @typedef {import('./show.js').Run} Run */
/**
 * @typedef {object} Underlay what lies under the route, drawn in metres
 * @property {string} key tells two of them apart
 * @property {(context: CanvasRenderingContext2D, pixel_m: number) => void} draw
 */

/** Points per path: the cost of stroking a path grows faster than its length. */
const POINTS_A_PATH = 64;
/** Opacity of routes in the colours of several dragons, which are fainter than the boards. */
const ROUTE_ALPHA = 0.4;
/** Widths of the line around the stage, and of that of the crowd, in pixels. */
const [STAGE_PX, CROWD_PX] = [2, 3];
/** Dashes of the line of the crowd, and distance of the lines of a hatched area, in pixels. */
const [DASHES_PX, HATCH_PX] = [[9, 6], 9];

export class RouteLayer {
  #canvas = document.createElement('canvas');
  #context = /** @type {CanvasRenderingContext2D} */ (this.#canvas.getContext('2d', { alpha: false }));
  #drawn = '';
  /** @type {Run | null} */ #run = null;
  /** @type {{path: Path2D, box: Box, colour: string | null}[]} its colour with several dragons */ #parts = [];
  #stage = new Path2D();
  #crowd = new Path2D();
  /** @type {{path: Path2D, box: Box}[]} areas to keep out of */ #keepOut = [];

  /**
   * Draws the ground, the borders of the stage and the route.
   * @param {CanvasRenderingContext2D} context
   * @param {Camera} camera
   * @param {Run | null} run
   * @param {{ground: string, ink: string, edge: string}} colours
   * @param {Underlay | null} underlay
   */
  draw(context, camera, run, { ground, ink, edge }, underlay = null) {
    const { width, height } = context.canvas;
    const wanted = [camera.x, camera.y, camera.scale, width, height, run?.run_id, ground, underlay?.key].join();
    if (wanted !== this.#drawn) {
      this.#drawn = wanted;
      if (run !== this.#run) this.#read(run);
      Object.assign(this.#canvas, { width, height });
      this.#paint(camera, ground, ink, edge, underlay);
    }
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.#canvas, 0, 0);
  }

  /** @param {Run | null} run */
  #read(run) {
    const lone = run === null ? [] : [{ route: run.route, colour: null }];
    const routes = run?.dragons ?? lone;
    this.#parts = routes.flatMap(({ route, colour }) => parts(route).map((part) => ({ ...part, colour })));
    this.#run = run;
    this.#stage = closed(run?.outline ?? []).path;
    this.#crowd = open(run?.crowd ?? []).path;
    this.#keepOut = (run?.keep_out ?? []).map(closed);
  }

  /** @param {Camera} camera @param {string} ground @param {string} ink @param {string} edge @param {Underlay | null} underlay */
  #paint(camera, ground, ink, edge, underlay) {
    const ratio = this.#canvas.width / camera.width;
    const { x, y, width, height } = camera;
    const scale = camera.scale * ratio;
    this.#context.fillStyle = ground;
    this.#context.fillRect(0, 0, this.#canvas.width, this.#canvas.height);
    this.#context.setTransform(scale, 0, 0, -scale, (width * ratio) / 2 - x * scale, (height * ratio) / 2 + y * scale);
    underlay?.draw(this.#context, 1 / camera.scale);
    this.#context.lineWidth = STAGE_PX / camera.scale;
    this.#context.strokeStyle = edge;
    this.#context.stroke(this.#stage);
    const seen = camera.seen(0);
    this.#context.lineWidth = 1 / camera.scale;
    for (const area of this.#keepOut) this.#hatch(area, seen, HATCH_PX / camera.scale);
    this.#context.lineWidth = CROWD_PX / camera.scale;
    this.#context.setLineDash(DASHES_PX.map((dash) => dash / camera.scale));
    this.#context.stroke(this.#crowd);
    this.#context.setLineDash([]);
    this.#context.lineWidth = 1 / camera.scale;
    this.#context.strokeStyle = ink;
    for (const { path, box, colour } of this.#parts) {
      this.#context.strokeStyle = colour ?? ink;
      this.#context.globalAlpha = colour === null ? 1 : ROUTE_ALPHA;
      if (box.x0 < seen.x1 && box.x1 > seen.x0 && box.y0 < seen.y1 && box.y1 > seen.y0) this.#context.stroke(path);
    }
    this.#context.globalAlpha = 1;
  }

  /**
   * Draws an area with lines at 45°, as far as it is seen.
   * @param {{path: Path2D, box: Box}} area
   * @param {Box} seen
   * @param {number} gap_m
   */
  #hatch({ path, box }, seen, gap_m) {
    const [x0, x1] = [Math.max(box.x0, seen.x0), Math.min(box.x1, seen.x1)];
    const [y0, y1] = [Math.max(box.y0, seen.y0), Math.min(box.y1, seen.y1)];
    const lines = new Path2D();
    for (let level = Math.ceil((x0 + y0) / gap_m) * gap_m; level < x1 + y1; level += gap_m) {
      lines.moveTo(level - y0, y0);
      lines.lineTo(level - y1, y1);
    }
    this.#context.save();
    this.#context.clip(path);
    this.#context.stroke(lines);
    this.#context.restore();
    this.#context.stroke(path);
  }
}

/** @param {readonly number[]} corners x, y, x, y, … */
function closed(corners) {
  const line = open(corners);
  if (corners.length > 0) line.path.closePath();
  return line;
}

/** @param {readonly number[]} points x, y, x, y, … */
function open(points) {
  const path = new Path2D();
  const box = { x0: Infinity, y0: Infinity, x1: -Infinity, y1: -Infinity };
  for (let at = 0; at + 1 < points.length; at += 2) {
    const [x, y] = [points[at], points[at + 1]];
    path.lineTo(x, y);
    box.x0 = Math.min(box.x0, x);
    box.x1 = Math.max(box.x1, x);
    box.y0 = Math.min(box.y0, y);
    box.y1 = Math.max(box.y1, y);
  }
  return { path, box };
}

/** @param {readonly number[]} route x, y, x, y, … */
function parts(route) {
  const found = [];
  for (let first = 0; first + 3 < route.length; first += POINTS_A_PATH * 2) {
    found.push(open(route.slice(first, first + POINTS_A_PATH * 2 + 2)));
  }
  return found;
}

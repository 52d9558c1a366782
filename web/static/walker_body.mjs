// @ts-check
// Poses the walker that the server drew: each part keeps its outline and moves with its segment. Names and frames of the
// segments are those of server/charts/src/walker/segment.rs.

/**
 * @typedef {[number, number]} Place Forward and up, m.
 * @typedef {{knee: Place, ankle: Place, heel: Place, toe: Place}} Leg
 * @typedef {{hip: Place, shoulder: Place, left: Leg, right: Leg}} StickFigure
 * @typedef {StickFigure & {domain: string, forces_n: Place[], activations?: number[]}} Frame
 * @typedef {{x: number, y: number, degrees: number}} Placement
 */

/** Units of the drawing per metre. */
export const UNITS = 100;
/** Forces below this have no centre of pressure worth drawing, N. */
const LEAST_FORCE_N = 10;
const ARROW_HEAD = 5;

/** @type {(walker: StickFigure) => Record<string, [Place, Place, Place, number]>} Origin, direction, and its angle at rest. */
const frames = ({ hip, shoulder, left, right }) => ({
  trunk: [hip, hip, shoulder, -90],
  "left.thigh": [hip, hip, left.knee, 90],
  "left.shank": [left.knee, left.knee, left.ankle, 90],
  "left.foot": [left.ankle, left.heel, left.toe, 0],
  "right.thigh": [hip, hip, right.knee, 90],
  "right.shank": [right.knee, right.knee, right.ankle, 90],
  "right.foot": [right.ankle, right.heel, right.toe, 0],
});

/**
 * Where the segments are in a drawing whose origin is on the ground below the hip.
 * @param {StickFigure} walker
 * @returns {Record<string, Placement>}
 */
export function placements(walker) {
  /** @type {Record<string, Placement>} */
  const placed = {};
  for (const [name, [origin, from, to, rest]] of Object.entries(frames(walker))) {
    const degrees = (Math.atan2(from[1] - to[1], to[0] - from[0]) * 180) / Math.PI - rest;
    placed[name] = { x: (origin[0] - walker.hip[0]) * UNITS, y: -origin[1] * UNITS, degrees };
  }
  return placed;
}

/** @param {Element} part @param {Record<string, Placement>} placed */
function place(part, placed) {
  const at = placed[String(part.getAttribute("data-segment"))];
  part.setAttribute("transform", `translate(${at.x.toFixed(1)} ${at.y.toFixed(1)})rotate(${at.degrees.toFixed(1)})`);
}

/**
 * An arrow from a place on the ground.
 * @param {number} x @param {number} right @param {number} down
 */
export function arrow(x, right, down) {
  const length = Math.hypot(right, down);
  const head = Math.min(ARROW_HEAD, length) / Math.max(length, 1e-9);
  const barb = (/** @type {number} */ side) =>
    `${(x + right - head * (right + side * 0.5 * down)).toFixed(1)} ${(down - head * (down - side * 0.5 * right)).toFixed(1)}`;
  const tip = `${(x + right).toFixed(1)} ${down.toFixed(1)}`;
  return `M${x.toFixed(1)} 0L${tip}M${barb(1)}L${tip}L${barb(-1)}`;
}

/** Parts of one body. */
export class Body {
  /** @param {Element} group */
  constructor(group) {
    this.parts = [...group.querySelectorAll("[data-segment]")];
  }

  /** @param {Record<string, Placement>} placed */
  pose(placed) {
    for (const part of this.parts) place(part, placed);
  }
}

export class Walker {
  /** @param {SVGSVGElement} svg */
  constructor(svg) {
    this.body = new Body(/** @type {Element} */ (svg.querySelector("[data-body]")));
    this.ghost = svg.querySelector("[data-ghost]");
    this.ghostBody = this.ghost && new Body(this.ghost);
    this.scale = Number(svg.dataset.forceScale);
    this.forces = ["left", "right"].map((side) => svg.querySelector(`[data-force=${side}]`));
    this.muscles = [...svg.querySelectorAll("[data-muscle]")].map((path) => ({
      path,
      muscle: Number(path.getAttribute("data-muscle")),
      peak: Number(path.getAttribute("data-peak")),
      via: String(path.getAttribute("data-via"))
        .split(",")
        .map((point) => point.split(" "))
        .map(([segment, x, y]) => ({ segment, x: Number(x), y: Number(y) })),
    }));
  }

  /** @param {Frame} frame */
  pose(frame) {
    const placed = placements(frame);
    this.body.pose(placed);
    const [leftHeel, leftToe, rightHeel, rightToe] = frame.forces_n;
    this.force(this.forces[0], frame.left, leftHeel, leftToe, frame.hip[0]);
    this.force(this.forces[1], frame.right, rightHeel, rightToe, frame.hip[0]);
    for (const { path, muscle, peak, via } of this.muscles) {
      const share = peak > 0 ? Math.min((frame.activations?.[muscle] ?? 0) / peak, 1) : 0;
      const points = via.map(({ segment, x, y }) => {
        const at = placed[segment];
        const [sine, cosine] = [Math.sin((at.degrees * Math.PI) / 180), Math.cos((at.degrees * Math.PI) / 180)];
        return `${(at.x + x * cosine - y * sine).toFixed(1)} ${(at.y + x * sine + y * cosine).toFixed(1)}`;
      });
      path.setAttribute("d", `M${points.join("L")}`);
      path.setAttribute("stroke-width", (1.2 + 3.8 * share).toFixed(1));
      path.setAttribute("stroke-opacity", (0.25 + 0.75 * share).toFixed(2));
    }
  }

  /**
   * The ground reaction force at the centre of pressure of a foot.
   * @param {Element | null} path @param {Leg} leg @param {Place} heel @param {Place} toe @param {number} hip
   */
  force(path, leg, heel, toe, hip) {
    const [forward, up] = [heel[0] + toe[0], heel[1] + toe[1]];
    const pressure = (heel[1] * leg.heel[0] + toe[1] * leg.toe[0]) / up;
    const line = up < LEAST_FORCE_N ? "" : arrow((pressure - hip) * UNITS, forward / this.scale, -up / this.scale);
    path?.setAttribute("d", line);
  }

  /** @param {StickFigure | null} walker The pose of the second walker; without one it is hidden. */
  poseGhost(walker) {
    this.ghost?.setAttribute("visibility", walker ? "visible" : "hidden");
    if (walker) this.ghostBody?.pose(placements(walker));
  }
}

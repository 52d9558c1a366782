// @ts-check
// Reads the lines of a chart from its drawing, to a tenth of its units. The CSV file of each figure has the exact values.

/** @typedef {[number, number]} Point */
/** @typedef {{key: string, runs: Point[][], isDots: boolean}} Line */

/** @type {WeakMap<SVGSVGElement, Line[]>} */
const known = new WeakMap();

/**
 * The runs of a path as drawn here: lines to a place, to the side, up or down.
 * @param {Element} path
 */
function runsOf(path) {
  /** @type {Point[][]} */
  const runs = [];
  let [x, y] = [0, 0];
  for (const [, step, numbers] of (path.getAttribute("d") ?? "").matchAll(/([MLHV])([^MLHV]*)/g)) {
    const [first, second] = numbers.trim().split(/[ ,]+/).map(Number);
    if (step === "V") y = first;
    else x = first;
    if (step === "M" || step === "L") y = second;
    if (step === "M") runs.push([]);
    runs.at(-1)?.push([x, y]);
  }
  return runs;
}

/** Reads a chart again after its drawing has changed. @param {SVGSVGElement} chart */
export function forgetLines(chart) {
  known.delete(chart);
}

/** @param {SVGSVGElement} chart @returns {Line[]} */
export function linesOf(chart) {
  const before = known.get(chart);
  if (before) return before;
  const key = (/** @type {Element} */ element) => String(element.getAttribute("class"));
  const lines = [...chart.querySelectorAll("path.line")].map((path) => ({ key: key(path), runs: runsOf(path), isDots: false }));
  const dots = [...chart.querySelectorAll("circle.dot")].map((dot) => ({
    key: key(dot),
    runs: [[/** @type {Point} */ ([Number(dot.getAttribute("cx")), Number(dot.getAttribute("cy"))])]],
    isDots: true,
  }));
  const found = lines.concat(dots);
  known.set(chart, found);
  return found;
}

/**
 * The height of a line at a place of the x axis.
 * @param {Line} line @param {number} x
 * @returns {number | null}
 */
export function heightAt(line, x) {
  for (const run of line.runs) {
    for (let i = 1; i < run.length; i += 1) {
      const [[x0, y0], [x1, y1]] = [run[i - 1], run[i]];
      if (x0 <= x && x <= x1) return x1 > x0 ? y0 + ((x - x0) / (x1 - x0)) * (y1 - y0) : y1;
    }
  }
  return null;
}

/**
 * The place of a line that is nearest to a point.
 * @param {Line} line @param {Point} point
 * @returns {Point}
 */
export function nearestOn(line, [x, y]) {
  /** @type {Point} */
  let best = [Infinity, Infinity];
  const away = (/** @type {Point} */ place) => Math.hypot(place[0] - x, place[1] - y);
  for (const run of line.runs) {
    run.forEach((to, i) => {
      const from = run[Math.max(i - 1, 0)];
      const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
      const square = dx * dx + dy * dy;
      const share = square > 0 ? Math.min(Math.max(((x - from[0]) * dx + (y - from[1]) * dy) / square, 0), 1) : 0;
      /** @type {Point} */
      const place = [from[0] + share * dx, from[1] + share * dy];
      if (away(place) < away(best)) best = place;
    });
  }
  return best;
}

/**
 * What a place on an axis stands for, with as many digits as the drawing is good for.
 * @param {string | undefined} axis
 * @param {number} place
 */
export function valueAt(axis, place) {
  const [begin, end, from, to] = String(axis).split(" ").map(Number);
  const value = from + ((place - begin) / (end - begin)) * (to - from);
  const step = Math.abs((to - from) / (end - begin)) / 10;
  const decimals = Math.min(Math.max(-Math.floor(Math.log10(step)) - 1, 0), 8);
  return Number(value.toFixed(decimals));
}

/**
 * The name of a line in the legend of its figure, or in the one that figures share.
 * @param {SVGSVGElement} chart
 * @param {string} key
 */
export function nameOf(chart, key) {
  const colour = key.match(/c\d/)?.[0];
  const legends = [chart.closest("figure"), chart.closest(".charts")?.previousElementSibling];
  const keys = legends.flatMap((legend) => [...(legend?.querySelectorAll(`.key.${colour}:not(.band, .stance)`) ?? [])]);
  const dash = key.split(" ").at(-1);
  const alike = keys.find((element) => element.classList.contains(String(dash))) ?? keys[0];
  return alike?.parentElement?.textContent ?? "";
}

// @ts-check
// One cursor for the walker and all charts over the gait cycle. In a chart of both legs, each leg has its own line, because
// its cycle begins with its own heel strike. Dragging in any chart moves the walker and all charts.

import { heightAt, linesOf } from "./chart_lines.mjs";

const SVG = "http://www.w3.org/2000/svg";

/** @typedef {{colour: string, begins: number}} Cycle The lines that follow it (`*`: all), and where in the stride it begins, percent. */

/** @type {Set<(share: number) => void>} */
const seekers = new Set();
/** Share of the stride. */
let now = 0;

/**
 * A drawing over a chart, in a layer of its own, so that a cursor that moves does not draw the chart again.
 * @param {SVGSVGElement} chart
 */
function layerOver(chart) {
  const box = document.createElement("div");
  box.className = "with_cursor";
  chart.replaceWith(box);
  const layer = document.createElementNS(SVG, "svg");
  layer.setAttribute("class", "chart cursor_layer");
  layer.setAttribute("viewBox", String(chart.getAttribute("viewBox")));
  layer.setAttribute("aria-hidden", "true");
  box.append(chart, layer);
  return layer;
}

/** @param {number} percent */
const wrapped = (percent) => ((percent % 100) + 100) % 100;

class ChartCursor {
  /** @param {SVGSVGElement} chart */
  constructor(chart) {
    this.chart = chart;
    this.right = this.axis();
    const [bottom, top] = String(chart.dataset.up).split(" ").map(Number);
    this.cycles = String(chart.dataset.cycles)
      .split(",")
      .map((cycle) => cycle.split(" "))
      .map(([colour, begins]) => ({ colour, begins: Number(begins) }));
    const layer = layerOver(chart);
    this.marks = this.cycles.map(({ colour, begins }) => {
      const bar = document.createElementNS(SVG, "path");
      bar.setAttribute("class", `cursor ${colour === "*" ? "" : colour}`);
      bar.setAttribute("d", `M0 ${top}V${bottom}`);
      const dots = this.linesOf(colour).map((line) => {
        const dot = document.createElementNS(SVG, "circle");
        dot.setAttribute("class", `cursor_dot ${line.key.match(/c\d/)?.[0]}`);
        dot.setAttribute("r", "5");
        return { line, dot };
      });
      layer.append(bar, ...dots.map(({ dot }) => dot));
      return { colour, begins, bar, dots };
    });
    chart.addEventListener("zoom", () => this.readAgain());
  }

  /** Where the axis begins and ends, and the percentages there. */
  axis() {
    return String(this.chart.dataset.right).split(" ").map(Number);
  }

  /** The lines of a cycle, without a reference, which does not move. @param {string} colour */
  linesOf(colour) {
    return linesOf(this.chart).filter(({ key }) => (colour === "*" || key.includes(` ${colour} `)) && !key.endsWith(" dotted"));
  }

  /** Reads the chart after it was zoomed. */
  readAgain() {
    this.right = this.axis();
    for (const { colour, dots } of this.marks) this.linesOf(colour).forEach((line, i) => (dots[i].line = line));
    this.draw();
  }

  /** @param {number} percent Of the axis. */
  place(percent) {
    const [begin, end, from, to] = this.right;
    return begin + ((percent - from) / (to - from)) * (end - begin);
  }

  draw() {
    for (const { begins, bar, dots } of this.marks) {
      const x = this.place(wrapped(100 * now - begins));
      const isShown = this.right[0] - 0.1 <= x && x <= this.right[1] + 0.1;
      bar.setAttribute("visibility", isShown ? "visible" : "hidden");
      bar.setAttribute("transform", `translate(${x.toFixed(1)} 0)`);
      for (const { line, dot } of dots) {
        const y = isShown ? heightAt(line, x) : null;
        dot.setAttribute("visibility", y === null ? "hidden" : "visible");
        dot.setAttribute("cx", x.toFixed(1));
        if (y !== null) dot.setAttribute("cy", y.toFixed(1));
      }
    }
  }

  /** @param {PointerEvent} event @returns {number} Percent of the axis under the pointer. */
  under(event) {
    const matrix = this.chart.getScreenCTM();
    if (!matrix) return 0;
    const { x } = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
    const [begin, end, from, to] = this.right;
    return Math.min(Math.max(from + ((x - begin) / (end - begin)) * (to - from), 0), 99.99);
  }

  /** @param {number} percent @returns {Cycle} The cycle whose line is nearest. */
  nearest(percent) {
    const away = (/** @type {Cycle} */ { begins }) => Math.abs(wrapped(100 * now - begins) - percent);
    return this.cycles.reduce((best, cycle) => (away(cycle) < away(best) ? cycle : best));
  }
}

/** A cursor on closed curves: a dot where each line is now. */
class OrbitCursor {
  /** @param {SVGSVGElement} chart */
  constructor(chart) {
    const layer = layerOver(chart);
    this.limitCycles = String(chart.dataset.moments)
      .split(",")
      .map((limitCycle) => {
        const [colour, ...numbers] = limitCycle.split(" ");
        const dot = document.createElementNS(SVG, "circle");
        dot.setAttribute("class", `cursor_dot ${colour}`);
        dot.setAttribute("r", "6");
        layer.append(dot);
        return { dot, numbers };
      });
  }

  draw() {
    for (const { dot, numbers } of this.limitCycles) {
      const moment = Math.round(now * (numbers.length / 2 - 1));
      dot.setAttribute("cx", numbers[2 * moment]);
      dot.setAttribute("cy", numbers[2 * moment + 1]);
    }
  }
}

/** @type {Map<Element, ChartCursor | OrbitCursor>} */
const cursors = new Map();
/** Those on the screen. @type {Set<ChartCursor | OrbitCursor>} */
const seen = new Set();

const observer = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    const chart = /** @type {SVGSVGElement} */ (target);
    const cursor = cursors.get(chart) ?? (chart.dataset.cycles ? new ChartCursor(chart) : new OrbitCursor(chart));
    cursors.set(target, cursor);
    if (isIntersecting) seen.add(cursor);
    else seen.delete(cursor);
    cursor.draw();
  }
});

/** @param {number} share Of the stride, from right heel strike. */
export function showCursor(share) {
  now = share;
  for (const cursor of seen) cursor.draw();
}

/** @param {(share: number) => void} seeker Called with the share of the stride that was dragged to. */
export function followCursor(seeker) {
  seekers.add(seeker);
  for (const chart of document.querySelectorAll("svg.chart[data-cycles]")) chart.classList.add("draggable");
  for (const chart of document.querySelectorAll("svg.chart:is([data-cycles], [data-moments])")) observer.observe(chart);
}

/** What is being dragged. @type {{cursor: ChartCursor, cycle: Cycle} | null} */
let drag = null;

/** @param {PointerEvent} event */
function dragTo(event) {
  if (!drag) return;
  const share = wrapped(drag.cursor.under(event) + drag.cycle.begins) / 100;
  for (const seeker of seekers) seeker(share);
}

document.addEventListener("pointerdown", (event) => {
  const cursor = cursors.get(/** @type {Element} */ (event.target).closest?.("svg.chart[data-cycles]") ?? document.body);
  if (!(cursor instanceof ChartCursor) || event.button !== 0) return;
  drag = { cursor, cycle: cursor.nearest(cursor.under(event)) };
  dragTo(event);
});
document.addEventListener("pointermove", dragTo);
for (const end of ["pointerup", "pointercancel"]) document.addEventListener(end, () => (drag = null));

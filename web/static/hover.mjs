// @ts-check
// Shows values of a chart beside the pointer or finger, or below a small chart: over a gait cycle those of all lines, otherwise that of the nearest
// point. The CSV file of each figure has the exact values, even for users without a pointer.

import { heightAt, linesOf, nameOf, nearestOn, valueAt } from "./chart_lines.mjs";

/** How far from a line the pointer may be, in units of the drawing. */
const REACH = 60;

const readout = document.createElement("div");
readout.className = "readout";
readout.setAttribute("aria-hidden", "true");
readout.hidden = true;
document.body.append(readout);
const here = document.createElementNS("http://www.w3.org/2000/svg", "circle");
here.setAttribute("r", "5");

function hide() {
  readout.hidden = true;
  here.remove();
}

/** @param {SVGSVGElement} chart @param {number} y */
function along(chart, y) {
  const height = valueAt(chart.dataset.up, y);
  const value = chart.dataset.logarithmic === "true" ? (10 ** height).toPrecision(2) : String(height);
  return value.replace("-", "\u2212");
}

/**
 * The values of all lines at a place of the cycle.
 * @param {SVGSVGElement} chart @param {number} x
 */
function acrossLines(chart, x) {
  const [begin, end] = String(chart.dataset.right).split(" ").map(Number);
  if (x < begin || x > end) return [];
  const values = linesOf(chart).flatMap((line) => {
    const y = heightAt(line, x);
    return y === null ? [] : [`${nameOf(chart, line.key)}: ${along(chart, y)}`];
  });
  here.remove();
  return values.length ? [`${valueAt(chart.dataset.right, x)} %; ${chart.dataset.along}`, ...values] : [];
}

/**
 * The nearest point of any line.
 * @param {SVGSVGElement} chart @param {DOMPoint} at
 */
function nearest(chart, at) {
  const away = (/** @type {[number, number]} */ place) => Math.hypot(place[0] - at.x, place[1] - at.y);
  const places = linesOf(chart).map((line) => ({ key: line.key, place: nearestOn(line, [at.x, at.y]) }));
  places.sort((a, b) => away(a.place) - away(b.place));
  const [best] = places;
  if (!best || away(best.place) > REACH) return [];
  here.setAttribute("class", `here ${best.key.match(/c\d/)?.[0]}`);
  here.setAttribute("cx", String(best.place[0]));
  here.setAttribute("cy", String(best.place[1]));
  if (here.parentNode !== chart) chart.append(here);
  const { right, across } = chart.dataset;
  return [
    nameOf(chart, best.key),
    `${across}: ${valueAt(right, best.place[0])}`,
    `${chart.dataset.along}: ${along(chart, best.place[1])}`,
  ];
}

/**
 * Beside the pointer, or below or above a chart of which it would cover a large part.
 * @param {string[]} lines @param {PointerEvent} event @param {Element} chart
 */
function say(lines, event, chart) {
  readout.replaceChildren(...lines.map((line) => Object.assign(document.createElement("div"), { textContent: line })));
  readout.hidden = false;
  const drawing = chart.getBoundingClientRect();
  const isBeside = drawing.width >= 3 * readout.offsetWidth;
  const isBelow = drawing.bottom + readout.offsetHeight <= innerHeight;
  const left = isBeside ? event.pageX + 14 : drawing.left + scrollX;
  const outside = isBelow ? drawing.bottom : drawing.top - readout.offsetHeight;
  const room = document.documentElement.clientWidth - readout.offsetWidth - 8;
  readout.style.left = `${Math.max(Math.min(left, room), 4)}px`;
  readout.style.top = `${isBeside ? event.pageY + 18 : outside + scrollY}px`;
}

/** @param {PointerEvent} event */
function show(event) {
  const link = /** @type {Element} */ (event.target).closest?.("svg.chart a");
  if (link) {
    here.remove();
    return say([String(link.getAttribute("aria-label"))], event, /** @type {Element} */ (link.closest("svg")));
  }
  const chart = /** @type {SVGSVGElement | null} */ (/** @type {Element} */ (event.target).closest?.("svg[data-right]"));
  const matrix = chart?.getScreenCTM();
  if (!chart || !matrix) return hide();
  const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
  const lines = chart.dataset.cycles ? acrossLines(chart, at.x) : nearest(chart, at);
  if (lines.length === 0) return hide();
  say(lines, event, chart);
}

for (const kind of ["pointermove", "pointerdown"]) document.addEventListener(kind, (event) => show(/** @type {PointerEvent} */ (event)));
document.addEventListener("scroll", hide, { passive: true });

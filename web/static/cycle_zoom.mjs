// @ts-check
// Zooms the charts over the gait cycle to a part of it: between two typed percentages, or by dragging across a chart while its
// zoom is open. All charts of the page show the same part. Without this script they show the whole cycle.

import { forgetLines } from "./chart_lines.mjs";

const SVG = "http://www.w3.org/2000/svg";
/** What moves along the x axis. */
const ALONG = "path:is(.line, .band, .mark, .span, .stance, .swing, .toe_off)";
/** Smallest part, percent: lines are drawn to a tenth of a unit of the drawing. */
const LEAST = 5;

/** @typedef {[number, number]} Part From and to, percent of the cycle. */

/** Charts by their drawings. @type {Map<SVGSVGElement, ZoomedChart>} */
const charts = new Map();

/** @param {string} name @param {Record<string, string>} attributes */
function drawn(name, attributes) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
}

/** @param {Part} part @returns {number[]} About five round percentages. */
function ticksOf([from, to]) {
  const step = [1, 2, 5, 10, 20].find((step) => (to - from) / step <= 6) ?? 20;
  const first = Math.ceil(from / step);
  return Array.from({ length: Math.floor(to / step) - first + 1 }, (_, i) => (first + i) * step);
}

class ZoomedChart {
  /** @param {SVGSVGElement} chart @param {number} number Of the chart on the page. */
  constructor(chart, number) {
    this.chart = chart;
    [this.begin, this.end] = String(chart.dataset.right).split(" ").map(Number);
    [this.bottom, this.top] = String(chart.dataset.up).split(" ").map(Number);
    this.whole = String(chart.dataset.right);
    this.paths = [...chart.querySelectorAll(ALONG)].map((path) => ({ path, d: String(path.getAttribute("d")) }));
    this.dots = [...chart.querySelectorAll("circle.dot")].map((dot) => ({ dot, x: Number(dot.getAttribute("cx")) }));
    const above = [...chart.querySelectorAll("text.label:not(.start)")].filter((text) => Number(text.getAttribute("y")) < this.top);
    this.names = above.map((text) => ({ text, x: Number(text.getAttribute("x")) }));
    this.usual = [...chart.querySelectorAll("text.tick.x, path.grid[d$='v5']")];
    this.ticks = drawn("g", {});
    const clip = drawn("clipPath", { id: `part-${number}` });
    const size = { x: String(this.begin), y: "0", width: String(this.end - this.begin), height: String(this.bottom + 1) };
    clip.append(drawn("rect", size));
    chart.append(clip, this.ticks);
    this.clip = `url(#part-${number})`;
  }

  /** @param {Part} part */
  show([from, to]) {
    const isWhole = from === 0 && to === 100;
    const width = this.end - this.begin;
    const [left, right] = [this.begin + (from / 100) * width, this.begin + (to / 100) * width];
    const moved = (/** @type {number} */ x) => this.begin + ((x - left) / (right - left)) * width;
    const clip = (/** @type {Element} */ element) =>
      isWhole ? element.removeAttribute("clip-path") : element.setAttribute("clip-path", this.clip);
    for (const { path, d } of this.paths) {
      const along = (/** @type {string} */ _, /** @type {string} */ step, /** @type {string} */ x) => step + moved(Number(x)).toFixed(1);
      path.setAttribute("d", isWhole ? d : d.replace(/([MLH])([-\d.]+)/g, along));
      clip(path);
    }
    for (const { dot, x } of this.dots) {
      dot.setAttribute("cx", moved(x).toFixed(1));
      clip(dot);
    }
    for (const { text, x } of this.names) {
      text.setAttribute("x", moved(x).toFixed(1));
      text.toggleAttribute("hidden", moved(x) < this.begin || moved(x) > this.end);
    }
    for (const tick of this.usual) tick.toggleAttribute("hidden", !isWhole);
    const ticks = isWhole ? [] : ticksOf([from, to]);
    const tickAt = (/** @type {number} */ percent) => {
      const x = moved(this.begin + (percent / 100) * width).toFixed(1);
      const text = drawn("text", { class: "tick x", x, y: String(this.bottom + 27) });
      text.textContent = String(percent);
      return [drawn("path", { class: "grid", d: `M${x} ${this.bottom}v5` }), text];
    };
    this.ticks.replaceChildren(...ticks.flatMap(tickAt));
    this.chart.dataset.right = isWhole ? this.whole : `${this.begin} ${this.end} ${from} ${to}`;
    forgetLines(this.chart);
    this.chart.dispatchEvent(new Event("zoom"));
  }

  /** @param {PointerEvent} event @returns {number} The place under the pointer, in units of the drawing. */
  under(event) {
    const matrix = this.chart.getScreenCTM();
    const x = matrix ? new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse()).x : this.begin;
    return Math.min(Math.max(x, this.begin), this.end);
  }

  /** @param {number} x @returns {number} Percent of the cycle, in the part that is shown. */
  percentAt(x) {
    const [begin, end, from, to] = String(this.chart.dataset.right).split(" ").map(Number);
    return from + ((x - begin) / (end - begin)) * (to - from);
  }
}

/** @param {Part} part */
function showPart(part) {
  for (const chart of charts.values()) chart.show(part);
  const isWhole = part[0] === 0 && part[1] === 100;
  for (const reset of document.querySelectorAll(".zoom_reset")) reset.toggleAttribute("hidden", isWhole);
  for (const zoom of document.querySelectorAll("details.zoom")) zoom.toggleAttribute("hidden", !isWhole);
}

/** @returns {HTMLDetailsElement | null} The zoom that is open. */
const opened = () => document.querySelector("details.zoom[open]");

/** @param {HTMLElement} title */
function addControls(title) {
  const name = title.querySelector("h3, h4")?.textContent ?? "";
  const zoom = document.createElement("details");
  zoom.className = "zoom";
  zoom.innerHTML = `<summary>Zoom</summary><form>
    <label>from <input name="from" type="number" min="0" max="100" step="any" value="0" required></label>
    <label>to <input name="to" type="number" min="0" max="100" step="any" value="100" required> %</label>
    <button class="button quiet">Show</button> <span class="hint">or drag across a chart</span></form>`;
  zoom.querySelector("summary")?.setAttribute("aria-label", `Zoom: ${name}`);
  const form = /** @type {HTMLFormElement} */ (zoom.querySelector("form"));
  const [from, to] = /** @type {HTMLInputElement[]} */ ([...form.querySelectorAll("input")]);
  // Ends in the other order are swapped.
  const check = () => to.setCustomValidity(Math.abs(Number(to.value) - Number(from.value)) < LEAST ? `The part must be at least ${LEAST} % of the cycle.` : "");
  form.addEventListener("input", check);
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    // A browser does not check what a script filled in.
    const ends = /** @type {Part} */ ([Number(from.value), Number(to.value)].sort((a, b) => a - b));
    [from.value, to.value] = ends.map(String);
    check();
    if (!form.reportValidity()) return;
    zoom.open = false;
    showPart(ends);
    reset.focus();
  });
  zoom.addEventListener("toggle", () => {
    if (zoom.open) for (const other of document.querySelectorAll("details.zoom[open]")) if (other !== zoom) other.removeAttribute("open");
    document.body.classList.toggle("chooses_part", opened() !== null);
  });
  const reset = document.createElement("button");
  reset.type = "button";
  reset.className = "zoom_reset";
  reset.textContent = "Reset zoom";
  reset.setAttribute("aria-label", `Reset zoom: ${name}`);
  reset.hidden = true;
  reset.addEventListener("click", () => {
    showPart([0, 100]);
    title.querySelector("summary")?.focus();
  });
  title.querySelector("h3, h4")?.after(reset, zoom);
}

document.querySelectorAll("figure svg.chart[data-cycles]").forEach((element, number) => {
  const chart = /** @type {SVGSVGElement} */ (element);
  const title = /** @type {HTMLElement | null} */ (chart.closest("figure")?.querySelector(".title"));
  if (!title) return;
  charts.set(chart, new ZoomedChart(chart, number));
  addControls(title);
});

/** The part that is being chosen. @type {{chart: ZoomedChart, start: number, area: Element} | null} */
let choice = null;

function endChoice() {
  choice?.area.remove();
  choice = null;
}

// Before the cursor, which moves with the pointer otherwise.
document.addEventListener(
  "pointerdown",
  (event) => {
    const chart = charts.get(/** @type {SVGSVGElement} */ (/** @type {Element} */ (event.target).closest?.("svg.chart")));
    if (!chart || !opened() || event.button !== 0) return;
    event.stopPropagation();
    event.preventDefault();
    const { top, bottom } = chart;
    const area = drawn("rect", { class: "part", y: String(top), height: String(bottom - top), width: "0" });
    chart.chart.append(area);
    choice = { chart, start: chart.under(event), area };
  },
  true,
);
document.addEventListener("pointermove", (event) => {
  if (!choice) return;
  const x = choice.chart.under(event);
  choice.area.setAttribute("x", String(Math.min(x, choice.start)));
  choice.area.setAttribute("width", String(Math.abs(x - choice.start)));
});
document.addEventListener("pointerup", (event) => {
  if (!choice) return;
  const ends = [choice.start, choice.chart.under(event)].map((x) => choice?.chart.percentAt(x) ?? 0).sort((a, b) => a - b);
  endChoice();
  if (ends[1] - ends[0] < LEAST) return;
  opened()?.removeAttribute("open");
  showPart([Math.round(ends[0]), Math.round(ends[1])]);
});
document.addEventListener("pointercancel", endChoice);
document.addEventListener("keydown", (event) => {
  if (event.key !== "Escape") return;
  endChoice();
  opened()?.removeAttribute("open");
});

// @ts-check
// Shows the values of the nearest point of a line chart beside the pointer or finger. They are read from the drawing, to a tenth
// of its units. The CSV file of each figure has the exact values, even for users without a pointer.

/** How far from a point the pointer may be, in units of the drawing. */
const REACH = 60;

/** @typedef {{ x: number, y: number, key: string }} Place */

/** @type {WeakMap<SVGSVGElement, Place[]>} */
const known = new WeakMap();

/**
 * The points of a path as drawn here: lines to a place, to the side, up or down.
 * @param {Element} path
 * @returns {Place[]}
 */
function placesOf(path) {
  const key = String(path.getAttribute("class"));
  const places = [];
  let [x, y] = [0, 0];
  for (const [, step, numbers] of (path.getAttribute("d") ?? "").matchAll(/([MLHV])([^MLHV]*)/g)) {
    const [first, second] = numbers.trim().split(/[ ,]+/).map(Number);
    if (step === "V") y = first;
    else x = first;
    if (step === "M" || step === "L") y = second;
    places.push({ x, y, key });
  }
  return places;
}

/** @param {SVGSVGElement} chart */
function places(chart) {
  const before = known.get(chart);
  if (before) return before;
  const dots = [...chart.querySelectorAll("circle.dot")].map((dot) => ({
    x: Number(dot.getAttribute("cx")),
    y: Number(dot.getAttribute("cy")),
    key: String(dot.getAttribute("class")),
  }));
  const found = [...chart.querySelectorAll("path.line")].flatMap(placesOf).concat(dots);
  known.set(chart, found);
  return found;
}

/**
 * What a place on an axis stands for, with as many digits as the drawing is good for.
 * @param {string | undefined} axis
 * @param {number} place
 */
function valueAt(axis, place) {
  const [begin, end, from, to] = String(axis).split(" ").map(Number);
  const value = from + ((place - begin) / (end - begin)) * (to - from);
  const step = Math.abs((to - from) / (end - begin)) / 10;
  const decimals = Math.min(Math.max(-Math.floor(Math.log10(step)) - 1, 0), 8);
  return Number(value.toFixed(decimals));
}

/**
 * The name of a line in the legend of its figure.
 * @param {SVGSVGElement} chart
 * @param {string} key
 */
function nameOf(chart, key) {
  const colour = key.match(/c\d/)?.[0];
  const keys = [...(chart.closest("figure")?.querySelectorAll(`.legend .key.${colour}:not(.band)`) ?? [])];
  const dash = key.split(" ").at(-1);
  const alike = keys.find((element) => element.classList.contains(String(dash))) ?? keys[0];
  return alike?.parentElement?.textContent ?? "";
}

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

/** @param {PointerEvent} event */
function show(event) {
  const chart = /** @type {SVGSVGElement | null} */ (/** @type {Element} */ (event.target).closest?.("svg[data-right]"));
  const matrix = chart?.getScreenCTM();
  if (!chart || !matrix) return hide();
  const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
  const away = (/** @type {Place} */ place) => Math.hypot(place.x - at.x, place.y - at.y);
  const nearest = places(chart).reduce((/** @type {Place | null} */ best, place) => (best && away(best) <= away(place) ? best : place), null);
  if (!nearest || away(nearest) > REACH) return hide();
  const { right, up, across, along, logarithmic } = chart.dataset;
  const height = valueAt(up, nearest.y);
  const value = logarithmic === "true" ? (10 ** height).toPrecision(2) : height;
  const lines = [nameOf(chart, nearest.key), `${across}: ${valueAt(right, nearest.x)}`, `${along}: ${value}`];
  readout.replaceChildren(...lines.map((line) => Object.assign(document.createElement("div"), { textContent: line })));
  readout.hidden = false;
  const room = document.documentElement.clientWidth - readout.offsetWidth - 8;
  readout.style.left = `${Math.max(Math.min(event.pageX + 14, room), 4)}px`;
  readout.style.top = `${event.pageY + 18}px`;
  here.setAttribute("class", `here ${nearest.key.match(/c\d/)?.[0]}`);
  here.setAttribute("cx", String(nearest.x));
  here.setAttribute("cy", String(nearest.y));
  if (here.parentNode !== chart) chart.append(here);
}

for (const kind of ["pointermove", "pointerdown"]) document.addEventListener(kind, (event) => show(/** @type {PointerEvent} */ (event)));
document.addEventListener("scroll", hide, { passive: true });

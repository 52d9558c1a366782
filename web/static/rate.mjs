// @ts-check
// Two motions, synchronised by gait cycle or by time, with the same scale and colours. The server computes the positions.

import { mayMove, showStrips } from "./reduced_motion.mjs";
import { Clocks } from "./stride_clock.mjs";

/** @typedef {[number, number]} Place */

/** A stride where both are shown at the same share of their cycles, s. */
const STRIDE_S = 1.4;
/** Size of the drawing in its own units; it is drawn with the points that the screen has. */
const [WIDTH, HEIGHT] = [640, 420];
const box = /** @type {HTMLElement | null} */ (document.querySelector("[data-pair]"));

if (box) {
  const state = /** @type {HTMLElement} */ (document.querySelector("[data-state]"));
  const play = /** @type {HTMLButtonElement} */ (document.querySelector("[data-play]"));
  const scrub = /** @type {HTMLInputElement} */ (document.querySelector("[data-scrub]"));
  const pace = /** @type {HTMLSelectElement} */ (document.querySelector("[data-pace]"));
  const form = /** @type {HTMLFormElement} */ (document.querySelector("[data-answer]"));
  const save = /** @type {HTMLButtonElement} */ (form.querySelector("[type=submit]"));
  const canvases = /** @type {HTMLCanvasElement[]} */ ([...box.querySelectorAll("canvas")]);
  const speed = /** @type {HTMLSelectElement} */ (document.querySelector("[data-speed]"));
  const clocks = new Clocks(canvases.map((canvas) => Number(canvas.dataset.seconds) || STRIDE_S), STRIDE_S);
  save.disabled = true;
  let playing = mayMove();
  if (!playing) showStrips(document);
  let last = 0;

  /** @param {string} side @returns {Promise<Place[][]>} */
  const load = async (side) => {
    const reply = await fetch(`/api/v1/blind-pairs/${box.dataset.pair}/motions/${side}`);
    if (!reply.ok) throw new Error(`${reply.status}`);
    return (await reply.json()).figures;
  };

  /** @param {HTMLCanvasElement} canvas @param {Place[][]} motion @param {number} phase */
  const draw = (canvas, motion, phase) => {
    const points = canvas.clientWidth * (window.devicePixelRatio || 1);
    if (points === 0) return;
    const size = [Math.round(points), Math.round((points * HEIGHT) / WIDTH)];
    // Setting it wipes the canvas, also to the same size.
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    pen.setTransform(size[0] / WIDTH, 0, 0, size[1] / HEIGHT, 0, 0);
    const figure = motion[Math.min(Math.floor(phase * motion.length), motion.length - 1)];
    const scale = HEIGHT / 2.1;
    const middle = figure[0][0];
    /** @param {Place} place @returns {Place} */
    const at = ([x, z]) => [WIDTH / 2 + (x - middle) * scale, HEIGHT - 30 - z * scale];
    /** @param {number[]} joints @param {number} width @param {number[]} dash */
    const line = (joints, width, dash) => {
      pen.lineWidth = width;
      pen.setLineDash(dash);
      pen.beginPath();
      joints.forEach((joint, i) => (i ? pen.lineTo(...at(figure[joint])) : pen.moveTo(...at(figure[joint]))));
      pen.stroke();
    };
    const colour = getComputedStyle(canvas).color;
    pen.clearRect(0, 0, WIDTH, HEIGHT);
    pen.strokeStyle = colour;
    pen.lineCap = "round";
    line([1, 0], 6, []);
    const [hip, shoulder] = [figure[0], figure[1]];
    const head = at([hip[0] + (shoulder[0] - hip[0]) * 1.18, hip[1] + (shoulder[1] - hip[1]) * 1.18]);
    pen.lineWidth = 3;
    pen.beginPath();
    pen.arc(...head, 0.1 * scale, 0, 2 * Math.PI);
    pen.stroke();
    line([0, 2, 3, 4, 5, 3], 4, []);
    line([0, 6, 7, 8, 9, 7], 4, [9, 7]);
    pen.setLineDash([]);
    pen.lineWidth = 1;
    pen.beginPath();
    pen.moveTo(0, HEIGHT - 30);
    pen.lineTo(WIDTH, HEIGHT - 30);
    pen.stroke();
  };

  try {
    const motions = await Promise.all(canvases.map((canvas) => load(String(canvas.dataset.side))));
    const begun = performance.now();
    const show = () => {
      canvases.forEach((canvas, i) => draw(canvas, motions[i], clocks.strides(i) % 1));
      const percent = 100 * clocks.place;
      scrub.value = String(percent);
      scrub.setAttribute("aria-valuetext", `${percent.toFixed(0)} %`);
    };
    /** @param {number} now */
    const step = (now) => {
      // The first frame can be from before the motion was loaded.
      if (playing) clocks.at += (Math.max(now - last, 0) / 1000) * Number(speed.value);
      last = now;
      show();
      requestAnimationFrame(step);
    };
    last = begun;
    show();
    requestAnimationFrame(step);
    const label = () => (play.textContent = playing ? "Pause" : "Play");
    label();
    play.addEventListener("click", () => {
      playing = !playing;
      label();
    });
    scrub.addEventListener("input", () => {
      playing = false;
      label();
      clocks.place = Number(scrub.value) / 100;
    });
    pace.addEventListener("change", () => clocks.keep(/** @type {import("./stride_clock.mjs").Pace} */ (pace.value)));
    const took = /** @type {HTMLInputElement} */ (form.elements.namedItem("response_ms"));
    // Runs before the form data are collected.
    form.addEventListener("submit", () => (took.value = String(Math.round(performance.now() - begun))), { capture: true });
    save.disabled = false;
    state.textContent = "";
  } catch (error) {
    state.textContent = "The gaits cannot be loaded. Reload the page before you answer.";
  }
}

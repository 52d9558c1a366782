// @ts-check
// Two motions, synchronised by gait cycle or by time, with the same scale and colours. The server computes the positions, and
// draws the body in the pictures for those without scripts.

import { mayMove, showStrips } from "./reduced_motion.mjs";
import { Clocks } from "./stride_clock.mjs";
import { Body, UNITS, placements } from "./walker_body.mjs";

/** @typedef {[number, number]} Place */

/** A stride where both are shown at the same share of their cycles, s. */
const STRIDE_S = 1.4;
/** Half the width of the drawing and the space below the ground, in its units. */
const [HALF_WIDTH, BELOW] = [80, 8];
/** From hip to the top of the head and a little more, in lengths of the trunk. */
const TOP_OF_HEAD = 1.7;
const box = /** @type {HTMLElement | null} */ (document.querySelector("[data-pair]"));

if (box) {
  const state = /** @type {HTMLElement} */ (document.querySelector("[data-state]"));
  const play = /** @type {HTMLButtonElement} */ (document.querySelector("[data-play]"));
  const scrub = /** @type {HTMLInputElement} */ (document.querySelector("[data-scrub]"));
  const pace = /** @type {HTMLSelectElement} */ (document.querySelector("[data-pace]"));
  const form = /** @type {HTMLFormElement} */ (document.querySelector("[data-answer]"));
  const answers = /** @type {NodeListOf<HTMLButtonElement>} */ (form.querySelectorAll("[type=submit]"));
  const drawings = /** @type {SVGSVGElement[]} */ ([...box.querySelectorAll("svg[data-side]")]);
  const speed = /** @type {HTMLSelectElement} */ (document.querySelector("[data-speed]"));
  const clocks = new Clocks(drawings.map((svg) => Number(svg.dataset.seconds) || STRIDE_S), STRIDE_S);
  for (const answer of answers) answer.disabled = true;
  let playing = mayMove();
  const strips = new DOMParser().parseFromString(document.querySelector("[data-strips]")?.textContent ?? "", "text/html");
  const pictures = strips.querySelectorAll("svg.tiles");
  if (!playing) showStrips(document);
  let last = 0;

  /** @param {string} side @returns {Promise<Place[][]>} */
  const load = async (side) => {
    const reply = await fetch(`/api/v1/blind-pairs/${box.dataset.pair}/motions/${side}`);
    if (!reply.ok) throw new Error(`${reply.status}`);
    return (await reply.json()).stick_figures;
  };

  /** @param {Place[]} joints @returns {import("./walker_body.mjs").StickFigure} */
  const stickFigureOf = ([hip, shoulder, ...legs]) => {
    const leg = ([knee, ankle, heel, toe] = legs) => ({ knee, ankle, heel, toe });
    return { hip, shoulder, left: leg(legs.slice(0, 4)), right: leg(legs.slice(4)) };
  };

  /** @param {SVGSVGElement} svg @param {Element | undefined} picture @param {Place[][]} motion */
  const walker = (svg, picture, motion) => {
    const parts = picture?.querySelector(".gait-walker")?.children ?? [];
    if (parts.length === 0) throw new Error("no body");
    svg.append(...[...parts].map((part) => document.importNode(part, true)));
    const [hip, shoulder] = motion[0];
    const top = Math.ceil((hip[1] + TOP_OF_HEAD * Math.hypot(shoulder[0] - hip[0], shoulder[1] - hip[1])) * UNITS);
    svg.setAttribute("viewBox", `${-HALF_WIDTH} ${-top} ${2 * HALF_WIDTH} ${top + BELOW}`);
    const body = new Body(svg);
    return (/** @type {number} */ phase) => {
      const place = Math.min(Math.floor(phase * motion.length), motion.length - 1);
      body.pose(placements(stickFigureOf(motion[place])));
    };
  };

  try {
    const motions = await Promise.all(drawings.map((svg) => load(String(svg.dataset.side))));
    const walkers = drawings.map((svg, i) => walker(svg, pictures[i], motions[i]));
    const begun = performance.now();
    const show = () => {
      walkers.forEach((pose, i) => pose(clocks.strides(i) % 1));
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
    for (const answer of answers) answer.disabled = false;
    state.textContent = "";
  } catch (error) {
    state.textContent = "The gaits cannot be loaded. Reload the page before you answer.";
  }
}

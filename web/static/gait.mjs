// @ts-check
// The walker of a gait, or those of two gaits on one clock. The server draws the walker and computes the positions.

import { followCursor, showCursor } from "./cycle_cursor.mjs";
import { MovingGround } from "./moving_ground.mjs";
import { mayMove, showStrips } from "./reduced_motion.mjs";
import { Clocks } from "./stride_clock.mjs";
import { Walker } from "./walker_body.mjs";

/**
 * @typedef {import("./walker_body.mjs").Place} Place
 * @typedef {import("./walker_body.mjs").Leg} Leg
 * @typedef {import("./walker_body.mjs").StickFigure} StickFigure
 * @typedef {import("./walker_body.mjs").Frame} Frame
 * @typedef {{stride_time_s: number, stride_length_m: number, frames: (Frame & {time_s: number})[]}} Motion
 */

/** @type {(a: Place, b: Place, share: number) => Place} */
const between = (a, b, share) => [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share];

/** @type {(a: Leg, b: Leg, share: number) => Leg} */
const legBetween = (a, b, share) => ({
  knee: between(a.knee, b.knee, share),
  ankle: between(a.ankle, b.ankle, share),
  heel: between(a.heel, b.heel, share),
  toe: between(a.toe, b.toe, share),
});

/**
 * The walker at a time within the stride.
 * @param {Motion} motion
 * @param {number} time
 * @returns {Frame}
 */
export function frameAt(motion, time) {
  const frames = motion.frames;
  let after = frames.findIndex((frame) => frame.time_s > time);
  if (after < 0) after = frames.length - 1;
  const [a, b] = [frames[Math.max(after - 1, 0)], frames[after]];
  const span = b.time_s - a.time_s;
  const share = span > 0 ? Math.min(Math.max((time - a.time_s) / span, 0), 1) : 0;
  return {
    hip: between(a.hip, b.hip, share),
    shoulder: between(a.shoulder, b.shoulder, share),
    left: legBetween(a.left, b.left, share),
    right: legBetween(a.right, b.right, share),
    domain: a.domain,
    forces_n: a.forces_n.map((force, i) => between(force, b.forces_n[i], share)),
    activations: a.activations?.map((value, i) => value + ((b.activations?.[i] ?? value) - value) * share),
  };
}

/** Names of the phases, without the leg. */
const PHASES = { DS2: "double support", DS3: "double support", SS2: "single support", SS1: "single support" };

/** @type {(domain: string) => string} `SS2_L` in words. */
const inWords = (domain) => {
  const [phase, side] = domain.split("_");
  return `${PHASES[phase] ?? phase}, ${side === "R" ? "right" : "left"} (${domain})`;
};

/**
 * The reference gait of a walker, which the server wrote into it: joints in mm, one stride at equal time steps.
 * @param {SVGSVGElement} svg
 * @returns {StickFigure[]}
 */
function referenceOf(svg) {
  const written = svg.querySelector("[data-ghost]")?.getAttribute("data-ghost");
  if (!written) return [];
  return written.split(";").map((place) => {
    const mm = place.split(" ").map(Number);
    const joint = (/** @type {number} */ i) => /** @type {Place} */ ([mm[2 * i] / 1000, mm[2 * i + 1] / 1000]);
    const leg = (/** @type {number} */ i) => ({ knee: joint(i), ankle: joint(i + 1), heel: joint(i + 2), toe: joint(i + 3) });
    return { hip: joint(0), shoulder: joint(1), left: leg(2), right: leg(6) };
  });
}

/** A gait with its walker. */
class Scene {
  /**
   * @param {SVGSVGElement} svg
   * @param {Motion} motion
   */
  constructor(svg, motion) {
    this.svg = svg;
    this.motion = motion;
    this.walker = new Walker(svg);
    this.ground = new MovingGround(svg);
    this.reference = referenceOf(svg);
    const stride = `stride ${motion.stride_length_m.toFixed(2)} m in ${motion.stride_time_s.toFixed(2)} s`;
    svg.setAttribute("aria-label", `${svg.getAttribute("aria-label")}: ${stride}`);
  }

  /** @param {number} share Of the gait cycle, 0 to 1. */
  frame(share) {
    return frameAt(this.motion, share * this.motion.stride_time_s);
  }

  /** @param {number} share @returns {StickFigure} */
  referenceAt(share) {
    const place = share * (this.reference.length - 1);
    const before = Math.min(Math.floor(place), this.reference.length - 2);
    const [a, b, within] = [this.reference[before], this.reference[before + 1], place - before];
    return {
      hip: between(a.hip, b.hip, within),
      shoulder: between(a.shoulder, b.shoulder, within),
      left: legBetween(a.left, b.left, within),
      right: legBetween(a.right, b.right, within),
    };
  }

  /**
   * @param {number} strides Whole ones and the share of this one.
   * @param {StickFigure | null} ghost The second walker.
   */
  draw(strides, ghost) {
    const frame = this.frame(strides % 1);
    this.walker.pose(frame);
    this.walker.poseGhost(ghost);
    const start = this.motion.frames[0].hip[0];
    this.ground.draw(Math.floor(strides) * this.motion.stride_length_m + frame.hip[0] - start);
  }
}

/** Where two are side by side. */
const PACES = `<label>Synchronise <select data-pace><option value="share" selected>by gait cycle</option>
  <option value="time">by time</option></select></label>`;

/**
 * The controls of a player, before there is anything to play: they have their place from the start, so that nothing below
 * them moves under a finger when the gaits arrive.
 * @param {HTMLElement} box
 * @param {boolean} isPair
 */
function addControls(box, isPair) {
  const controls = document.createElement("fieldset");
  controls.className = "controls";
  controls.disabled = true;
  controls.innerHTML = `
    <button type="button" class="button quiet" data-play>Play</button>
    <label>Speed <select data-speed><option value="0.25">¼</option><option value="0.5">½</option><option value="1" selected>1</option></select></label>
    ${isPair ? PACES : ""}
    <label class="scrub">Gait cycle <input type="range" min="0" max="100" step="0.5" value="0" data-scrub></label>
    <label><input type="checkbox" data-overlay autocomplete="off"> ${isPair ? "Overlay the gaits" : "Reference gait"}</label>
    <output data-phase>0 %</output>`;
  (document.querySelector("[data-controls]") ?? box).append(controls);
  return controls;
}

/** Plays scenes on one clock: gaits of different length at the same share of their cycles, or each in its own time. */
class Player {
  /**
   * @param {HTMLFieldSetElement} controls
   * @param {Scene[]} scenes
   */
  constructor(controls, scenes) {
    this.scenes = scenes;
    const seconds = scenes.map((scene) => scene.motion.stride_time_s);
    this.clocks = new Clocks(seconds, seconds.reduce((sum, stride) => sum + stride, 0) / seconds.length);
    this.last = 0;
    this.playing = mayMove();
    controls.disabled = false;
    this.button = /** @type {HTMLButtonElement} */ (controls.querySelector("[data-play]"));
    this.speed = /** @type {HTMLSelectElement} */ (controls.querySelector("[data-speed]"));
    this.scrub = /** @type {HTMLInputElement} */ (controls.querySelector("[data-scrub]"));
    this.phase = /** @type {HTMLOutputElement} */ (controls.querySelector("[data-phase]"));
    this.button.addEventListener("click", () => this.setPlaying(!this.playing));
    this.scrub.addEventListener("input", () => {
      this.setPlaying(false);
      this.clocks.place = Number(this.scrub.value) / 100;
      this.draw();
    });
    const pace = /** @type {HTMLSelectElement | null} */ (controls.querySelector("[data-pace]"));
    pace?.addEventListener("change", () => {
      this.clocks.keep(/** @type {import("./stride_clock.mjs").Pace} */ (pace.value));
      this.draw();
    });
    this.overlay = /** @type {HTMLInputElement} */ (controls.querySelector("[data-overlay]"));
    this.overlay.addEventListener("change", () => this.draw());
    followCursor((share) => {
      this.setPlaying(false);
      this.clocks.place = share;
      this.draw();
    });
    this.setPlaying(this.playing);
    this.draw();
  }

  /** @param {boolean} playing */
  setPlaying(playing) {
    this.playing = playing;
    this.button.textContent = playing ? "Pause" : "Play";
    if (playing) {
      this.last = performance.now();
      requestAnimationFrame((now) => this.tick(now));
    }
  }

  /** @param {number} now */
  tick(now) {
    // A walker that the page has replaced stops.
    if (!this.playing || !this.scrub.isConnected) return;
    // The first frame may be of a moment before the button was pressed.
    this.clocks.at += (Math.max(now - this.last, 0) / 1000) * Number(this.speed.value);
    this.last = now;
    this.draw();
    requestAnimationFrame((next) => this.tick(next));
  }

  /** @param {number} place @param {number[]} strides @returns {StickFigure | null} The walker behind a scene. */
  ghost(place, strides) {
    if (!this.overlay.checked) return null;
    const other = this.scenes[1 - place];
    return other ? other.frame(strides[1 - place] % 1) : this.scenes[place].referenceAt(strides[place] % 1);
  }

  draw() {
    const shares = this.scenes.map((_, place) => this.clocks.strides(place));
    this.scenes.forEach((scene, place) => scene.draw(shares[place], this.ghost(place, shares)));
    showCursor(shares[0] % 1);
    const share = this.clocks.place;
    this.scrub.value = String(100 * share);
    // Gaits beside each other may be in different phases.
    const [{ motion }, other] = this.scenes;
    const time = share * this.clocks.round;
    const percent = `${(100 * share).toFixed(0)} %`;
    if (!other) this.phase.textContent = `${percent}, ${time.toFixed(2)} s: ${inWords(frameAt(motion, time).domain)}`;
    else this.phase.textContent = this.clocks.pace === "share" ? percent : `${time.toFixed(2)} s`;
    this.scrub.setAttribute("aria-valuetext", this.phase.textContent);
  }
}

/** @type {(trial: string | undefined) => Promise<Motion>} */
const load = async (trial) => {
  const answer = await fetch(`/api/v1/trials/${trial}/motion`);
  if (!answer.ok) throw new Error(`status ${answer.status}`);
  return answer.json();
};

/**
 * Makes the walkers of a box walk.
 * @param {HTMLElement} box
 */
export function startWalker(box) {
  const walkers = /** @type {NodeListOf<SVGSVGElement>} */ (box.querySelectorAll("[data-trial] svg.gait-walker"));
  const controls = addControls(box, walkers.length > 1);
  for (const hint of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-drag]"))) hint.hidden = false;
  if (!mayMove()) showStrips(box.querySelector("noscript") ? box : document);
  const trial = (/** @type {Element} */ svg) => /** @type {HTMLElement} */ (svg.closest("[data-trial]")).dataset.trial;
  Promise.all([...walkers].map(async (svg) => new Scene(svg, await load(trial(svg)))))
    .then((scenes) => new Player(controls, scenes))
    .catch((error) => {
      controls.textContent = `The animation cannot be loaded (${error.message}). Reload the page to try again.`;
    });
}

for (const box of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll(".walker:not([data-controls])"))) startWalker(box);

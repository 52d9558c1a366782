// @ts-check
// The animated stick figure of a gait, or of two on one clock. The server computes the positions.

import { mayMove, showStrips } from "./reduced_motion.mjs";
import { Clocks } from "./stride_clock.mjs";

/**
 * @typedef {[number, number]} Place
 * @typedef {{knee: Place, ankle: Place, heel: Place, toe: Place}} Leg
 * @typedef {{time_s: number, hip: Place, shoulder: Place, left: Leg, right: Leg, domain: string, forces_n: Place[], activations?: number[]}} Frame
 * @typedef {{stride_time_s: number, stride_length_m: number, frames: Frame[]}} Motion
 */

/**
 * Where the muscles are drawn, in the order of the activations: leg, from and to along hip-knee-ankle (0 to 2), and on
 * which side of the bone, in metres forwards. A scheme: attachments are the model's.
 * @type {["left" | "right", number, number, number][]}
 */
const MUSCLES = [
  ["left", 0.05, 1.05, -0.055],
  ["left", -0.1, 0.4, -0.075],
  ["left", -0.1, 0.4, 0.06],
  ["left", 0.92, 1.9, -0.06],
  ["left", 0.35, 1.08, 0.055],
  ["left", 1.3, 1.95, -0.035],
  ["left", 1.15, 1.9, 0.04],
  ["right", 0.05, 1.0, -0.055],
  ["right", -0.1, 0.4, -0.075],
  ["right", -0.1, 0.4, 0.06],
];

/** Newtons per metre of a drawn force. */
const FORCE_SCALE = 1600;

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
 * The figure at a time within the stride.
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
    time_s: time,
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

/** A gait on a canvas. */
class Scene {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {Motion} motion
   */
  constructor(canvas, motion) {
    this.canvas = canvas;
    this.motion = motion;
    const stride = `stride ${motion.stride_length_m.toFixed(2)} m in ${motion.stride_time_s.toFixed(2)} s`;
    canvas.setAttribute("aria-label", `${canvas.getAttribute("aria-label")}: ${stride}`);
  }

  /**
   * @param {number} share Of the gait cycle, 0 to 1.
   * @param {number} strides Whole ones before.
   */
  draw(share, strides) {
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    if (width === 0) return;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    const pen = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext("2d"));
    pen.scale(ratio, ratio);
    const style = getComputedStyle(document.documentElement);
    const colour = (/** @type {string} */ name) => style.getPropertyValue(name).trim();
    const frame = frameAt(this.motion, share * this.motion.stride_time_s);

    const scale = height / 2.05;
    const ground = height - 0.22 * scale;
    const walked = strides * this.motion.stride_length_m;
    /** @type {(place: Place) => Place} */
    const at = (place) => [width / 2 + (place[0] - frame.hip[0]) * scale, ground - place[1] * scale];
    /** @type {(places: Place[]) => void} */
    const line = (places) => {
      pen.beginPath();
      places.forEach((place, i) => (i === 0 ? pen.moveTo(...at(place)) : pen.lineTo(...at(place))));
      pen.stroke();
    };

    // Ground with a tick every half metre, so that the walking is seen.
    pen.lineCap = pen.lineJoin = "round";
    pen.strokeStyle = colour("--soft");
    pen.fillStyle = colour("--soft");
    pen.lineWidth = 1.5;
    const reach = width / 2 / scale;
    line([[frame.hip[0] - reach, 0], [frame.hip[0] + reach, 0]]);
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "center";
    const first = Math.ceil((walked + frame.hip[0] - reach) * 2);
    for (let half = first; half / 2 <= walked + frame.hip[0] + reach; half += 1) {
      const [x, y] = at([half / 2 - walked, 0]);
      pen.fillRect(x - 0.5, y, 1, half % 2 === 0 ? 8 : 5);
      // No number is cut in two at the edge.
      if (half % 2 === 0 && x > 16 && x < width - 16) pen.fillText(`${half / 2} m`.replace("-", "\u2212"), x, y + 22);
    }

    // Forces.
    pen.strokeStyle = colour("--c1");
    pen.lineWidth = 2.5;
    const feet = [frame.left.heel, frame.left.toe, frame.right.heel, frame.right.toe];
    frame.forces_n.forEach((force, i) => {
      if (Math.hypot(...force) < 10) return;
      const foot = feet[i];
      line([foot, [foot[0] + force[0] / FORCE_SCALE, foot[1] + force[1] / FORCE_SCALE]]);
    });

    // Muscles: thicker and darker, the more active.
    pen.strokeStyle = colour("--c6");
    frame.activations?.forEach((activation, i) => {
      const [side, from, to, forwards] = MUSCLES[i];
      const joints = [frame.hip, frame[side].knee, frame[side].ankle];
      /** @type {(along: number) => Place} */
      const beside = (along) => {
        const bone = along < 1 ? 0 : 1;
        const [a, b] = [joints[bone], joints[bone + 1]];
        const length = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
        const [x, z] = between(a, b, along - bone);
        return [x - (forwards * (b[1] - a[1])) / length, z + (forwards * (b[0] - a[0])) / length];
      };
      pen.globalAlpha = 0.2 + 0.8 * Math.min(activation, 1);
      pen.lineWidth = 2 + 6 * Math.min(activation, 1);
      line([beside(from), beside((from + to) / 2), beside(to)]);
    });
    pen.globalAlpha = 1;

    // The prosthetic side is dashed as well as of another colour.
    const leg = (/** @type {Leg} */ l) => {
      line([frame.hip, l.knee, l.ankle]);
      line([l.ankle, l.heel, l.toe, l.ankle]);
    };
    pen.lineWidth = 5;
    pen.strokeStyle = colour("--c0");
    leg(frame.left);
    pen.strokeStyle = colour("--c3");
    line([frame.hip, frame.right.knee]);
    pen.setLineDash([9, 8]);
    line([frame.right.knee, frame.right.ankle]);
    line([frame.right.ankle, frame.right.heel, frame.right.toe, frame.right.ankle]);
    pen.setLineDash([]);
    pen.strokeStyle = colour("--ink");
    line([frame.hip, frame.shoulder]);
    pen.fillStyle = colour("--ink");
    for (const joint of [frame.hip, frame.left.knee, frame.right.knee, frame.left.ankle, frame.right.ankle]) {
      pen.beginPath();
      pen.arc(...at(joint), 4, 0, 2 * Math.PI);
      pen.fill();
    }
    const [hx, hy] = at(between(frame.hip, frame.shoulder, 1.18));
    pen.beginPath();
    pen.arc(hx, hy, 0.1 * scale, 0, 2 * Math.PI);
    pen.lineWidth = 3;
    pen.stroke();
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
    <output data-phase>0 %</output>`;
  box.append(controls);
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
    for (const scene of scenes) new ResizeObserver(() => this.draw()).observe(scene.canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
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
    if (!this.playing) return;
    // The first frame may be of a moment before the button was pressed.
    this.clocks.at += (Math.max(now - this.last, 0) / 1000) * Number(this.speed.value);
    this.last = now;
    this.draw();
    requestAnimationFrame((next) => this.tick(next));
  }

  draw() {
    this.scenes.forEach((scene, place) => {
      const strides = this.clocks.strides(place);
      scene.draw(strides % 1, Math.floor(strides));
    });
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

for (const box of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll(".walker"))) {
  const canvases = /** @type {HTMLCanvasElement[]} */ ([...box.querySelectorAll("canvas")]);
  const controls = addControls(box, canvases.length > 1);
  if (!mayMove()) showStrips(box);
  Promise.all(canvases.map(async (canvas) => new Scene(canvas, await load(canvas.dataset.trial))))
    .then((scenes) => new Player(controls, scenes))
    .catch((error) => {
      box.style.minHeight = `${box.offsetHeight}px`;
      box.textContent = `The animation cannot be loaded (${error.message}). Reload the page to try again.`;
    });
}

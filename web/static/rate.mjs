// @ts-check
// Two motions on one clock. Both have the same length, scale and colours; positions come from the server.

/** @typedef {[number, number]} Place */

const STRIDE_MS = 1400;
const box = /** @type {HTMLElement | null} */ (document.querySelector("[data-pair]"));

if (box) {
  const state = /** @type {HTMLElement} */ (document.querySelector("[data-state]"));
  const play = /** @type {HTMLButtonElement} */ (document.querySelector("[data-play]"));
  const form = /** @type {HTMLFormElement} */ (document.querySelector("[data-answer]"));
  const save = /** @type {HTMLButtonElement} */ (form.querySelector("[type=submit]"));
  const canvases = /** @type {HTMLCanvasElement[]} */ ([...box.querySelectorAll("canvas")]);
  const speed = /** @type {HTMLSelectElement} */ (document.querySelector("[data-speed]"));
  /** @type {HTMLElement} */ (document.querySelector("[data-controls]")).hidden = false;
  save.disabled = true;
  let playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  const strips = document.querySelector("[data-strips]");
  if (!playing && strips) {
    // Who wants no motion sees both strides as pictures, like those without scripts.
    const pictures = new DOMParser().parseFromString(strips.textContent ?? "", "text/html").body;
    strips.replaceWith(...pictures.childNodes);
  }
  let phase = 0;
  let last = 0;

  /** @param {string} side @returns {Promise<Place[][]>} */
  const load = async (side) => {
    const reply = await fetch(`/api/v1/blind/${box.dataset.pair}/${side}`);
    if (!reply.ok) throw new Error(`${reply.status}`);
    return reply.json();
  };

  /** @param {HTMLCanvasElement} canvas @param {Place[][]} motion */
  const draw = (canvas, motion) => {
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const figure = motion[Math.min(Math.floor(phase * motion.length), motion.length - 1)];
    const scale = canvas.height / 2.1;
    const middle = figure[0][0];
    /** @param {Place} place @returns {Place} */
    const at = ([x, z]) => [canvas.width / 2 + (x - middle) * scale, canvas.height - 30 - z * scale];
    /** @param {number[]} joints @param {number} width @param {number[]} dash */
    const line = (joints, width, dash) => {
      pen.lineWidth = width;
      pen.setLineDash(dash);
      pen.beginPath();
      joints.forEach((joint, i) => (i ? pen.lineTo(...at(figure[joint])) : pen.moveTo(...at(figure[joint]))));
      pen.stroke();
    };
    const colour = getComputedStyle(canvas).color;
    pen.clearRect(0, 0, canvas.width, canvas.height);
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
    pen.moveTo(0, canvas.height - 30);
    pen.lineTo(canvas.width, canvas.height - 30);
    pen.stroke();
  };

  try {
    const motions = await Promise.all(canvases.map((canvas) => load(String(canvas.dataset.side))));
    const begun = performance.now();
    const show = () => canvases.forEach((canvas, i) => draw(canvas, motions[i]));
    /** @param {number} now */
    const step = (now) => {
      // The first frame may be of a moment before the motion was there.
      const passed = Math.max(now - last, 0) / STRIDE_MS;
      if (playing) phase = (phase + passed * Number(speed.value)) % 1;
      last = now;
      show();
      requestAnimationFrame(step);
    };
    last = begun;
    requestAnimationFrame(step);
    const label = () => (play.textContent = playing ? "Pause" : "Play");
    label();
    play.addEventListener("click", () => {
      playing = !playing;
      label();
    });
    const took = /** @type {HTMLInputElement} */ (form.elements.namedItem("response_ms"));
    // Before the form is read to be sent.
    form.addEventListener("submit", () => (took.value = String(Math.round(performance.now() - begun))), { capture: true });
    document.addEventListener("keydown", (event) => {
      const place = ["1", "2", "3"].indexOf(event.key);
      if (place < 0 || /** @type {Element} */ (event.target).closest("textarea")) return;
      const choice = /** @type {HTMLInputElement} */ (form.querySelectorAll(".verdict input")[place]);
      choice.click();
      choice.focus();
    });
    save.disabled = false;
    state.textContent = "";
  } catch (error) {
    state.textContent = "The gaits could not be loaded: reload the page before you answer.";
  }
}

// @ts-check
// The ground under a walker who stays in the middle of the picture: a mark every half metre, and the metres walked.

import { UNITS } from "./walker_body.mjs";

const SVG = "http://www.w3.org/2000/svg";
/** Distance between two marks, m. */
const MARK_M = 0.5;
/** A number so near the edge would be cut in two, in units of the drawing. */
const EDGE = 8;

export class MovingGround {
  /** @param {SVGSVGElement} svg */
  constructor(svg) {
    const { x, width } = svg.viewBox.baseVal;
    this.left = x / UNITS;
    this.right = (x + width) / UNITS;
    const group = /** @type {Element} */ (svg.querySelector("[data-ground]"));
    group.replaceChildren();
    const marks = Math.ceil((this.right - this.left) / MARK_M) + 1;
    this.marks = Array.from({ length: marks }, () => {
      const mark = document.createElementNS(SVG, "g");
      const line = document.createElementNS(SVG, "path");
      line.setAttribute("class", "ground");
      const text = document.createElementNS(SVG, "text");
      text.setAttribute("y", "14");
      mark.append(line, text);
      group.append(mark);
      return { mark, line, text };
    });
  }

  /** @param {number} walked How far the hip has come, m. */
  draw(walked) {
    const first = Math.ceil((walked + this.left) / MARK_M);
    this.marks.forEach(({ mark, line, text }, place) => {
      const metres = (first + place) * MARK_M;
      const x = (metres - walked) * UNITS;
      const whole = Number.isInteger(metres);
      mark.setAttribute("transform", `translate(${x.toFixed(1)} 0)`);
      line.setAttribute("d", whole ? "M0 0v5" : "M0 0v3");
      const inside = x > this.left * UNITS + EDGE && x < this.right * UNITS - EDGE;
      text.textContent = whole && inside ? `${metres} m`.replace("-", "\u2212") : "";
    });
  }
}

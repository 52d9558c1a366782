// @ts-check
// The positions of several strides on one clock: at the same share of the gait cycle, or at the same time.

/** @typedef {"share" | "time"} Pace */

export class Clocks {
  /**
   * @param {number[]} seconds Duration of each stride, s.
   * @param {number} together Duration of the common gait cycle, s, for strides at the same share.
   */
  constructor(seconds, together) {
    this.seconds = seconds;
    this.together = together;
    /** @type {Pace} */
    this.pace = "share";
    /** Since the strides began together, s. */
    this.at = 0;
  }

  /** The range of the scrubber: one stride; by time, the longest one. */
  get round() {
    return this.pace === "share" ? this.together : Math.max(...this.seconds);
  }

  /** @param {Pace} pace The place of the scrubber stays. */
  keep(pace) {
    const place = this.place;
    this.pace = pace;
    this.place = place;
  }

  /** Place within the round, 0 to 1. */
  get place() {
    return (this.at / this.round) % 1;
  }

  set place(share) {
    // The end of a cycle is the start of the next one, so its last instant is used.
    this.at = Math.min(share, 0.9999) * this.round;
  }

  /** @param {number} stride @returns {number} Strides so far: whole ones and the share of this one. */
  strides(stride) {
    return this.at / (this.pace === "share" ? this.together : this.seconds[stride]);
  }
}

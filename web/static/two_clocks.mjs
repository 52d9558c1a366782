// @ts-check
// How far each of several strides is by one clock: at the same share of the gait cycle, or by time.

/** @typedef {"share" | "time"} Pace */

export class Clocks {
  /**
   * @param {number[]} seconds What each stride takes.
   * @param {number} together What a stride takes where all are at the same share.
   */
  constructor(seconds, together) {
    this.seconds = seconds;
    this.together = together;
    /** @type {Pace} */
    this.pace = "share";
    /** Since the strides began together, s. */
    this.at = 0;
  }

  /** What the scrubber goes over: one stride, by time the longest one. */
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

// @ts-check
// With reduced motion, strides are shown as pictures, as without scripts, until the user starts the animation.

/** Whether things may move by themselves. */
export const mayMove = () => !matchMedia("(prefers-reduced-motion: reduce)").matches;

/** @param {ParentNode} place Puts the pictures for those without scripts into a page that has scripts. */
export function showStrips(place) {
  const strips = place.querySelector("noscript[data-strips]");
  const pictures = new DOMParser().parseFromString(strips?.textContent ?? "", "text/html").body;
  strips?.replaceWith(...pictures.childNodes);
}

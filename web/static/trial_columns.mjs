// @ts-check
// Lets a visitor choose the columns of the table of trials, which the browser remembers. Without this script the table has every
// column, and on a narrow screen the first four.

const KEY = "gaitwright-hidden-columns";
/** Columns that a narrow screen shows before anything is chosen. */
const NARROW = ["gait_rmse_rad", "cost_of_transport"];
/** Number and state are always shown. */
const ALWAYS = 2;

const section = document.getElementById("trials");
const chooser = /** @type {HTMLElement | null} */ (section?.querySelector("[data-columns]") ?? null);

/** @type {() => string[] | null} The hidden columns; null if the visitor has chosen none, or the browser keeps nothing. */
function remembered() {
  try {
    const names = JSON.parse(localStorage.getItem(KEY) ?? "null");
    return Array.isArray(names) ? names : null;
  } catch {
    return null;
  }
}

if (section && chooser) {
  const boxes = [...chooser.querySelectorAll("input")];
  const sheet = new CSSStyleSheet();
  document.adoptedStyleSheets.push(sheet);

  /** @type {(hidden: string[]) => void} */
  const apply = (hidden) => {
    const places = boxes.flatMap((box, place) => (hidden.includes(box.value) ? [place + ALWAYS + 1] : []));
    const rules = places.map((place) => `#trials .trials :is(th, td):nth-child(${place}) { display: none; }`);
    sheet.replaceSync(`@media screen { ${rules.join(" ")} }`);
    section.dataset.chosen = "";
  };

  const kept = remembered();
  const narrow = matchMedia("(max-width: 40rem)").matches;
  for (const box of boxes) box.checked = kept ? !kept.includes(box.value) : !narrow || NARROW.includes(box.value);
  if (kept) apply(kept);
  chooser.hidden = false;
  chooser.addEventListener("change", () => {
    const hidden = boxes.filter((box) => !box.checked).map((box) => box.value);
    apply(hidden);
    try {
      localStorage.setItem(KEY, JSON.stringify(hidden));
    } catch {
      // The browser keeps nothing: the choice lasts until the page is left.
    }
  });
}

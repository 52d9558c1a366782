// @ts-check
// Shows times in the time zone of the reader. Without this script they are in UTC, and say so.

const zone = Intl.DateTimeFormat().resolvedOptions().timeZone;

/** @type {(date: Date) => string} `2026-05-01 14:05` in the time zone of the reader. */
function minute(date) {
  const two = (/** @type {number} */ value) => String(value).padStart(2, "0");
  return `${date.getFullYear()}-${two(date.getMonth() + 1)}-${two(date.getDate())} ${two(date.getHours())}:${two(date.getMinutes())}`;
}

/** @type {(date: Date) => string} The time zone at that time: `GMT+1`, `CET`. */
function zoneAt(date) {
  const parts = new Intl.DateTimeFormat("en", { timeZoneName: "short" }).formatToParts(date);
  return parts.find((part) => part.type === "timeZoneName")?.value ?? zone;
}

/** @type {(part: ParentNode) => void} Replaces the times in a part of a page, and the words that name their time zone. */
export function showLocalTimes(part) {
  for (const time of /** @type {NodeListOf<HTMLTimeElement>} */ (part.querySelectorAll("time[datetime]:not([title])"))) {
    const date = new Date(time.dateTime);
    if (Number.isNaN(date.valueOf())) continue;
    time.title = `${date.toISOString().slice(0, 16).replace("T", " ")} UTC (shown: ${zone})`;
    time.textContent = minute(date);
    // A reader of a printed page cannot point at the time.
    time.dataset.printedZone = zoneAt(date);
  }
  for (const named of /** @type {NodeListOf<HTMLElement>} */ (part.querySelectorAll("[data-zone]"))) {
    named.textContent = named.dataset.zone ?? "";
    named.removeAttribute("data-zone");
  }
}

showLocalTimes(document);

// A page on paper says when it was printed.
addEventListener("beforeprint", () => {
  for (const part of document.querySelectorAll("[data-printed]")) part.textContent = ` · printed ${minute(new Date())} ${zoneAt(new Date())}`;
});

// @ts-check
// Keeps a study page current: recorded events load the changed parts of the page, and iterations load those of a running solve.
// Sorting and filtering the trials changes the address and loads only the table.
// Without this script the page is current after a reload, and sorting and filtering reload it.

import { holdsEdits } from "./edited_fields.mjs";
import { showLocalTimes } from "./local_times.mjs";

const live = /** @type {HTMLElement | null} */ (document.getElementById("live"));

/** Shortest time between two updates of a running solve, ms. */
const PAUSE = 500;
/** Time before reconnecting to a service that could not answer, ms. */
const AGAIN = 3000;
/** Recorded events that change the page of a study. */
const RECORDED = ["study_changed", "trial_queued", "trial_started", "trial_ended", "feedback_given", "feedback_retracted", "lab_session_answered", "reported_unsafe", "safety_reviewed", "gait_certified", "execution_reported", "trial_explained"];

/** @type {(node: Node) => string} The summary of a folded part. */
const titleOf = (node) => (node instanceof HTMLDetailsElement ? (node.querySelector("summary")?.textContent ?? "") : "");

/**
 * Replaces the contents of a part, except folded sections that the user is editing.
 * @param {HTMLElement} part
 * @param {Element} next
 */
function replace(part, next) {
  const typed = [...part.querySelectorAll(":scope > details")].filter((folded) => holdsEdits(folded));
  const fresh = [...next.childNodes];
  const kept = typed.filter((folded) => fresh.some((node) => titleOf(node) === titleOf(folded)));
  for (const node of [...part.childNodes]) if (!kept.includes(/** @type {Element} */ (node))) node.remove();
  let before = part.firstChild;
  for (const node of fresh) {
    if (before && kept.some((folded) => titleOf(folded) === titleOf(node))) before = before.nextSibling;
    else part.insertBefore(node, before);
  }
}

/** @type {(shown: ParentNode) => HTMLElement | null} The place of the recommended gait. */
const walkerOf = (shown) => shown.querySelector("[data-walker]");

/** States in which a study needs a person, or has nothing left to do. */
const NOTIFIED = ["waiting", "paused", "finished", "stopped"];
const title = document.title;

/** @type {(state: string) => void} Puts the state in the title of a tab that nobody looks at, until somebody does. */
function notify(state) {
  document.title = document.hidden && NOTIFIED.some((word) => state.startsWith(word)) ? `(${state}) ${title}` : title;
}
document.addEventListener("visibilitychange", () => {
  if (!document.hidden) document.title = title;
});

/**
 * Shows another gait walking when it becomes the recommended one, but not while somebody uses the controls.
 * @param {HTMLElement} shown
 * @param {Document} fresh
 */
async function updateWalker(shown, fresh) {
  const [walker, next] = [walkerOf(shown), walkerOf(fresh)];
  if (!walker || next?.dataset.shown === walker.dataset.shown || walker.contains(document.activeElement)) return;
  if (!next) return walker.remove();
  walker.replaceWith(next);
  const box = /** @type {HTMLElement | null} */ (next.querySelector(".walker"));
  if (box) (await import("./gait.mjs")).startWalker(box);
}

/**
 * Replaces the parts that changed and keeps focus and scroll position.
 * @param {HTMLElement} shown
 * @param {Document} fresh
 */
function update(shown, fresh) {
  for (const part of /** @type {NodeListOf<HTMLElement>} */ (shown.querySelectorAll("[data-part]"))) {
    const next = fresh.querySelector(`[data-part="${part.dataset.part}"]`);
    if (!next || next.innerHTML === part.innerHTML) continue;
    const held = part.contains(document.activeElement) ? document.activeElement : null;
    const name = held?.getAttribute("value") ?? held?.textContent;
    const opened = [...part.querySelectorAll("details[open] > summary")].map((summary) => summary.textContent);
    const across = part.querySelector(".scroll")?.scrollLeft ?? 0;
    replace(part, next);
    part.querySelector(".scroll")?.scrollTo({ left: across });
    for (const summary of part.querySelectorAll("details > summary")) {
      if (opened.includes(summary.textContent)) summary.parentElement?.setAttribute("open", "");
    }
    if (held && !held.isConnected) {
      const alike = [...part.querySelectorAll(held.tagName)].find((e) => (e.getAttribute("value") ?? e.textContent) === name);
      /** @type {HTMLElement | undefined} */ (alike)?.focus();
    }
  }
}

if (live) {
  const study = live.dataset.study;
  let after = live.dataset.after;
  const connection = /** @type {HTMLElement} */ (document.querySelector("[data-connection]"));
  const announced = /** @type {HTMLElement} */ (document.querySelector("[data-announced]"));
  const state = () => live.querySelector("[data-part=state] .state")?.textContent ?? "";
  let last = state();
  let pending = false;
  let again = false;

  /** Loads the changed parts; a request that arrives meanwhile is served afterwards. */
  const refresh = async () => {
    if (pending) {
      again = true;
      return;
    }
    pending = true;
    try {
      const query = new URLSearchParams(location.search);
      query.set("shown", walkerOf(live)?.dataset.shown ?? "");
      const answer = await fetch(`/studies/${study}/live?${query}`);
      if (answer.ok) {
        const fresh = new DOMParser().parseFromString(await answer.text(), "text/html");
        showLocalTimes(fresh);
        update(live, fresh);
        await updateWalker(live, fresh);
      }
      if (state() !== last) {
        last = state();
        announced.textContent = `The study is now: ${last}.`;
        notify(last);
      }
      // The subject withdrew consent: the page shows nothing of the study any more.
      if (answer.status === 409) location.reload();
    } catch {
      // The connection is lost. The event stream reconnects by itself and delivers the missed events.
    } finally {
      pending = false;
      if (again) {
        again = false;
        void refresh();
      }
    }
  };

  /** @param {string} query */
  const list = (query) => {
    history.replaceState(null, "", query);
    void refresh();
  };
  live.addEventListener("click", (event) => {
    const link = /** @type {Element} */ (event.target).closest("a[data-listing]");
    if (!link || event.ctrlKey || event.metaKey || event.shiftKey) return;
    event.preventDefault();
    list(/** @type {string} */ (link.getAttribute("href")));
  });
  const filter = /** @type {HTMLFormElement | null} */ (live.querySelector("form[data-listing]"));
  const filtered = () => {
    if (!filter) return;
    const query = new URLSearchParams(location.search);
    for (const [name, value] of new FormData(filter)) {
      if (name !== "sort" && name !== "order") query.set(name, String(value));
    }
    query.delete("after");
    query.delete("before");
    list(`?${query}`);
  };
  filter?.addEventListener("input", filtered);
  filter?.addEventListener("submit", (event) => {
    event.preventDefault();
    filtered();
  });

  /** @type {Map<string, number>} When each running solve was last updated. */
  const looked = new Map();
  /** @param {MessageEvent} event */
  const follow = async (event) => {
    const { trial_id: trial } = JSON.parse(event.data);
    const now = performance.now();
    if (now - (looked.get(trial) ?? -Infinity) < PAUSE) return;
    looked.set(trial, now);
    const answer = await fetch(`/trials/${trial}/running`).catch(() => null);
    if (answer?.status !== 200) return;
    const fresh = new DOMParser().parseFromString(await answer.text(), "text/html");
    for (const part of ["[data-text]", "[data-chart]"]) {
      const next = fresh.querySelector(part);
      if (next) live.querySelector(`[data-trial="${trial}"] ${part}`)?.replaceWith(next);
    }
  };

  /** Listens to events, and shows since when there is no connection. */
  const listen = () => {
    const source = new EventSource(`/api/v1/studies/${study}/events?after=${after}`);
    for (const kind of RECORDED) {
      source.addEventListener(kind, (event) => {
        after = event.lastEventId || after;
        void refresh();
      });
    }
    source.addEventListener("progress", follow);
    source.addEventListener("open", () => {
      if (connection.hidden) return;
      connection.hidden = true;
      live.classList.remove("stale");
      void refresh();
    });
    source.addEventListener("error", () => {
      // The browser reconnects by itself, except after an error status.
      if (source.readyState === EventSource.CLOSED) setTimeout(listen, AGAIN);
      if (!connection.hidden) return;
      const since = document.createElement("time");
      since.dateTime = new Date().toISOString();
      connection.replaceChildren("No connection to the service since ", since, ". Retrying.");
      showLocalTimes(connection);
      connection.hidden = false;
      live.classList.add("stale");
    });
  };
  listen();
}

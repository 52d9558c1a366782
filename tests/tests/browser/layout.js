// What a reader cannot see or read at the present width. An expression: the list of what is wrong, as JSON.
JSON.stringify((() => {
  const wrong = new Set();
  const all = (selector, within = document) => [...within.querySelectorAll(selector)].filter((e) => e.getClientRects().length > 0);
  const box = (element) => element.getBoundingClientRect();
  const words = (element) => element.textContent.trim().slice(0, 30);

  for (const svg of all("svg.chart")) {
    const frame = svg.closest(".scroll, .across, figure, section, main");
    if (frame.matches(".scroll, .across")) continue;
    const place = box(frame);
    const title = svg.getAttribute("aria-label") ?? "";
    const texts = all("text", svg).map((text) => ({ text, at: box(text) }));
    for (const at of [box(svg), ...texts.map((one) => one.at)]) {
      if (at.left < place.left - 1 || at.right > place.right + 1) wrong.add(`the chart ${title.slice(0, 40)} is cut`);
    }
    texts.forEach((one, i) => {
      for (const other of texts.slice(i + 1)) {
        const wide = Math.min(one.at.right, other.at.right) - Math.max(one.at.left, other.at.left);
        const high = Math.min(one.at.bottom, other.at.bottom) - Math.max(one.at.top, other.at.top);
        // The box of a text is higher than its letters.
        if (wide > 1 && high > 0.4 * Math.min(one.at.height, other.at.height)) {
          wrong.add(`${words(one.text)} covers ${words(other.text)} in the chart ${title.slice(0, 40)}`);
        }
      }
    });
  }

  // A word of a heading that fills several lines.
  for (const heading of all("thead th")) {
    const node = document.createTreeWalker(heading, NodeFilter.SHOW_TEXT).nextNode();
    for (const word of node?.textContent.matchAll(/\p{L}{2,12}/gu) ?? []) {
      const range = document.createRange();
      range.setStart(node, word.index);
      range.setEnd(node, word.index + word[0].length);
      const lines = new Set([...range.getClientRects()].map((line) => Math.round(line.top)));
      if (lines.size > 1) wrong.add(`${word[0]} is broken in the heading ${words(heading)}`);
    }
  }

  for (const controls of all(".controls")) {
    const [button, label] = [controls.querySelector(".button"), controls.querySelector("label")];
    if (!button || !label) continue;
    const [one, other] = [box(button), box(label)];
    const apart = Math.abs((one.top + one.bottom - other.top - other.bottom) / 2);
    // In one row, their middles are at one height.
    if (one.bottom > other.top && other.bottom > one.top && apart > 2) wrong.add(`a button is ${apart.toFixed(0)} px beside its row`);
  }
  return [...wrong].slice(0, 8);
})())

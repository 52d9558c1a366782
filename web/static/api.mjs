// Sends the requests of the REST reference page.

for (const form of document.querySelectorAll("form[data-path]")) {
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const { method, path } = form.dataset;
    const query = new URLSearchParams();
    const headers = {};
    let address = path;
    let body;
    for (const input of form.elements) {
      const value = input.value;
      if (!input.dataset.in || value === "") continue;
      if (input.dataset.in === "path") address = address.replace(`{${input.name}}`, encodeURIComponent(value));
      if (input.dataset.in === "query") query.set(input.name, value);
      if (input.dataset.in === "header") headers[input.name] = value;
      if (input.dataset.in === "body") {
        body = value;
        headers["content-type"] = "application/json";
      }
    }
    const answer = form.querySelector("[data-answer]");
    answer.hidden = false;
    answer.textContent = "…";
    try {
      const tail = query.toString() ? `?${query}` : "";
      if (address.endsWith("/events")) {
        answer.textContent = `Event stream. Follow it with: curl -N ${location.origin}${address}${tail}`;
        return;
      }
      const reply = await fetch(address + tail, { method, headers, body });
      const text = await reply.text();
      let shown = text;
      try {
        shown = JSON.stringify(JSON.parse(text), null, 2);
      } catch {
        // Not JSON: shown unchanged.
      }
      answer.textContent = `${reply.status} ${reply.statusText}\n${shown.slice(0, 20000)}`;
    } catch (error) {
      answer.textContent = `The request could not be sent (${error.message}). Check the connection and try again.`;
    }
  });
}

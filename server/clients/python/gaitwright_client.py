"""A thin client for lab scripts. Needs Python 3.9 or newer, and only the standard library.

Each method is one operation of server/openapi.json; OPERATIONS names them, and a test compares the two.
"""

import json
import time
import urllib.error
import urllib.parse
import urllib.request
import uuid

# method name -> (HTTP method, path of the description)
OPERATIONS = {
    "me": ("get", "/api/v1/me"),
    "subjects": ("get", "/api/v1/subjects"),
    "add_subject": ("post", "/api/v1/subjects"),
    "studies": ("get", "/api/v1/studies"),
    "study": ("get", "/api/v1/studies/{id}"),
    "make_study": ("post", "/api/v1/studies"),
    "change_study": ("patch", "/api/v1/studies/{id}"),
    "start": ("post", "/api/v1/studies/{id}/start"),
    "pause": ("post", "/api/v1/studies/{id}/pause"),
    "resume": ("post", "/api/v1/studies/{id}/resume"),
    "stop": ("post", "/api/v1/studies/{id}/stop"),
    "extend": ("post", "/api/v1/studies/{id}/extend"),
    "fork": ("post", "/api/v1/studies/{id}/fork"),
    "trials": ("get", "/api/v1/studies/{id}/trials"),
    "trial": ("get", "/api/v1/trials/{id}"),
    "gait": ("get", "/api/v1/trials/{id}/gait"),
    "cancel": ("post", "/api/v1/trials/{id}/cancel"),
    "retry": ("post", "/api/v1/trials/{id}/retry"),
    "history": ("get", "/api/v1/studies/{id}/history"),
    "ask": ("post", "/api/v1/studies/{id}/ask"),
    "tell": ("post", "/api/v1/trials/{id}/tell"),
    "prefer": ("post", "/api/v1/studies/{id}/preferences"),
    "preferences": ("get", "/api/v1/studies/{id}/preferences"),
    "retract": ("post", "/api/v1/preferences/{id}/retract"),
    "suggest": ("post", "/api/v1/studies/{id}/suggestions"),
}


class Problem(Exception):
    """A request that the service refused (RFC 9457): status, detail, and the field if one is named."""

    def __init__(self, status, document):
        self.status = status
        self.document = document
        self.field = document.get("field")
        super().__init__(f"{status}: {document.get('detail', document)}")


class Client:
    """Talks to one service. A request that changes something is safely repeated if the connection breaks."""

    def __init__(self, address="http://127.0.0.1:8080", token=None, tries=5, timeout_s=60):
        self.address = address.rstrip("/")
        self.token = token
        self.tries = tries
        self.timeout_s = timeout_s

    def call(self, name, id=None, body=None, query=None, headers=None):
        """Calls an operation by its name in OPERATIONS."""
        method, path = OPERATIONS[name]
        address = self.address + path.replace("{id}", urllib.parse.quote(str(id), safe=""))
        if query:
            address += "?" + urllib.parse.urlencode(query)
        sent = {"accept": "application/json", **(headers or {})}
        data = None
        if self.token:
            sent["authorization"] = f"Bearer {self.token}"
        if method != "get":
            data = json.dumps(body or {}).encode()
            sent["content-type"] = "application/json"
            # Every attempt has the same key, so the change is made once, however many requests arrive.
            sent["idempotency-key"] = str(uuid.uuid4())
        request = urllib.request.Request(address, data=data, headers=sent, method=method.upper())
        for attempt in range(self.tries):
            try:
                with urllib.request.urlopen(request, timeout=self.timeout_s) as answer:
                    return json.load(answer)
            except urllib.error.HTTPError as error:
                try:
                    document = json.load(error)
                except ValueError:
                    document = {"detail": error.reason}
                raise Problem(error.code, document) from None
            except (urllib.error.URLError, ConnectionError, TimeoutError):
                if attempt + 1 == self.tries:
                    raise
                time.sleep(0.2 * 2**attempt)

    def pages(self, name, id=None, filters=None):
        """Every entry of a list, page by page."""
        query = dict(filters or {})
        while True:
            page = self.call(name, id, query=query)
            yield from page["items"]
            if page["next"] is None:
                return
            query["cursor"] = page["next"]

    # who and what
    def me(self):
        return self.call("me")

    def subjects(self):
        return self.pages("subjects")

    def add_subject(self, pseudonym, height_m, body_mass_kg, notes=""):
        body = {"pseudonym": pseudonym, "height_m": height_m, "body_mass_kg": body_mass_kg, "notes": notes}
        return self.call("add_subject", body=body)

    # studies
    def studies(self):
        return self.pages("studies")

    def study(self, study):
        return self.call("study", study)

    def make_study(self, subject_id, **settings):
        return self.call("make_study", body={"subject_id": subject_id, **settings})

    def change_study(self, study, revision=None, **changes):
        headers = {"if-match": f'"{revision}"'} if revision is not None else None
        return self.call("change_study", study, changes, headers=headers)

    def start(self, study, reason=""):
        return self.call("start", study, {"reason": reason})

    def pause(self, study, reason=""):
        return self.call("pause", study, {"reason": reason})

    def resume(self, study, reason=""):
        return self.call("resume", study, {"reason": reason})

    def stop(self, study, reason=""):
        return self.call("stop", study, {"reason": reason})

    def extend(self, study, trial_budget):
        return self.call("extend", study, {"trial_budget": trial_budget})

    def fork(self, study, **differs):
        return self.call("fork", study, differs)

    def history(self, study):
        return self.pages("history", study)

    # trials
    def trials(self, study, **filters):
        return self.pages("trials", study, filters)

    def trial(self, trial):
        return self.call("trial", trial)

    def gait(self, trial):
        return self.call("gait", trial)

    def cancel(self, trial):
        return self.call("cancel", trial)

    def retry(self, trial):
        return self.call("retry", trial)

    # evaluating trials oneself
    def ask(self, study, worker=None):
        """A trial to evaluate. Returns the same trial until its outcome is reported."""
        return self.call("ask", study, {"worker": worker} if worker else {})

    def tell_converged(self, trial, gait_rmse_rad=None, cost_of_transport=None):
        body = {"outcome": "converged", "gait_rmse_rad": gait_rmse_rad, "cost_of_transport": cost_of_transport}
        return self.call("tell", trial, body)

    def tell_not_converged(self, trial, reason):
        return self.call("tell", trial, {"outcome": "not_converged", "reason": reason})

    # answers
    def prefer(self, study, trial_a, trial_b, answer, **more):
        """`answer`: "a", "b" or "no_difference"."""
        return self.call("prefer", study, {"trial_a": trial_a, "trial_b": trial_b, "answer": answer, **more})

    def preferences(self, study):
        return self.pages("preferences", study)

    def retract(self, preference, reason):
        return self.call("retract", preference, {"reason": reason})

    def suggest(self, study, over, bounds, note=""):
        """States that a gait with these bounds would have been better than that of the trial `over`."""
        return self.call("suggest", study, {"over": over, "bounds": bounds, "note": note})

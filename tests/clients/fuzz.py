"""Signs in, makes one object of each kind, and prints the settings of schemathesis with their identifiers.

python fuzz.py SIGN_IN_LINK DESCRIPTION
"""

import json
import sys
import time
import urllib.request
from typing import Any

link = sys.argv[1]
address = link.split("/sign-in/")[0]
cookies: dict[str, str] = {}


class Stay(urllib.request.HTTPRedirectHandler):
    """Keeps the answer that sets the cookie of the session."""

    def redirect_request(self, *_: Any) -> None:
        return None


opener = urllib.request.build_opener(Stay)


def call(method: str, path: str, body: Any = None) -> Any:
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(address + path, data, method=method)
    request.add_header("Origin", address)
    request.add_header("Cookie", "; ".join(f"{name}={value}" for name, value in cookies.items()))
    if body is not None:
        request.add_header("Content-Type", "application/json")
    try:
        answer = opener.open(request)
    except urllib.error.HTTPError as error:
        if error.code != 303:
            raise SystemExit(f"{method} {path}: {error.code} {error.read().decode()}") from error
        answer = error
    for cookie in answer.headers.get_all("Set-Cookie") or []:
        name, value = cookie.split(";")[0].split("=", 1)
        cookies[name] = value
    text = answer.read()
    is_json = "json" in (answer.headers.get("Content-Type") or "")
    return json.loads(text) if is_json else text


call("POST", link.removeprefix(address), None)
v1 = "/api/v1"
person = {"height_m": 1.73, "body_mass_kg": 68.0}
subject = call("POST", f"{v1}/subjects", {"pseudonym": "fuzzed", **person})["id"]
leaving = call("POST", f"{v1}/subjects", {"pseudonym": "withdraws", **person})["id"]


def started(new: dict[str, Any]) -> str:
    study: str = call("POST", f"{v1}/studies", {"subject_id": subject, "muscles": False, "start": True, **new})["id"]
    return study


script = started({"name": "script", "number_of_trials": 5, "evaluation": "script", "answer_source": "people"})
study = started({"name": "fuzzed", "number_of_trials": 6, "answer_source": "both"})
while call("GET", f"{v1}/studies/{study}")["state"] != "finished":
    time.sleep(0.5)
trials = [trial for trial in call("GET", f"{v1}/studies/{study}/trials")["items"] if trial["state"] == "converged"]
trial, other, third = (trial["id"] for trial in trials[:3])
for gait in (trial, other, third):
    call("POST", f"{v1}/trials/{gait}/certificate")
    while call("GET", f"{v1}/jobs/certificate-{gait}")["state"] in ("queued", "running"):
        time.sleep(0.5)
answer = {"trial_a": trial, "trial_b": other, "answer": "a"}
preference = call("POST", f"{v1}/studies/{study}/preferences", answer)["id"]
noted = {"trial_a": other, "trial_b": third, "answer": "cannot_tell"}
assessment = call("POST", f"{v1}/studies/{study}/assessments", noted)["id"]
better = call("GET", f"{v1}/trials/{third}")["action"]
suggestion = call("POST", f"{v1}/studies/{study}/suggestions", {"over": trial, "bounds": better})["id"]
session = call("POST", f"{v1}/studies/{study}/lab-sessions", {"trial_a": trial, "trial_b": other})["id"]
backup = call("POST", f"{v1}/backups")["id"]
device = call("GET", f"{v1}/devices")["items"][0]["id"]
reference = call("GET", f"{v1}/reference-gaits")["items"][0]["id"]
user = call("POST", f"{v1}/users", {"name": "fuzzed", "role": "rater"})["id"]
token = call("POST", f"{v1}/tokens", {"name": "fuzzed", "scopes": ["read"]})["id"]
member = call("POST", f"{v1}/studies/{study}/members", {"kind": "user", "name": "fuzzed"})["id"]

# Names may have every character that prints. No pattern can say which these are, so strings are of one alphabet that prints.
print(f'headers = {{ Origin = "{address}" }}')
print('generation.codec = "shift_jis"')
print(f'[auth.openapi.session]\napi_key = "{cookies["gaitwright_session"]}"')

with open(sys.argv[2], encoding="utf-8") as file:
    description = json.load(file)


def has_dependent_rule(part: Any, seen: frozenset[str] = frozenset()) -> bool:
    """Whether a rule that depends on other values or on the record, which a schema cannot state, is in `x-depends`."""
    if isinstance(part, list):
        return any(has_dependent_rule(item, seen) for item in part)
    if not isinstance(part, dict):
        return False
    name = str(part.get("$ref", "")).rpartition("/")[2]
    named = description["components"]["schemas"][name] if name and name not in seen else None
    parts = [named, *part.values()]
    return "x-depends" in part or any(has_dependent_rule(item, seen | {name}) for item in parts)


def matching(operation: dict[str, Any], settings: str) -> None:
    print(f"[[operations]]\ninclude-operation-id = '{operation['operationId']}'\n{settings}")


for path in description["paths"].values():
    for operation in path.values():
        parameters = operation.get("parameters", [])
        if has_dependent_rule([parameters, operation.get("requestBody")]):
            accepted = '["2xx", "3xx", "401", "403", "404", "409", "422", "429", "5xx"]'
            matching(operation, f"checks.positive_data_acceptance.expected-statuses = {accepted}")
        if any(parameter["name"] == "If-Match" for parameter in parameters):
            matching(operation, 'parameters = { "header.If-Match" = "*" }')
        if operation["operationId"] == "follow_study_events":
            # OpenAPI 3.1 describes the text of a stream, which schemathesis expects in place of an event. HTTP ignores
            # unknown headers.
            off = ("response_schema_conformance", "negative_data_rejection")
            matching(operation, "\n".join(f"checks.{check}.enabled = false" for check in off))
for pattern, value in [
    (r"/subjects/\{id\}/withdraw", leaving),
    (r"/subjects/\{id\}($|/[^w])", subject),
    (r"/studies/\{id\}/ask", script),
    (r"/studies/\{id\}($|/([^a]|ac|ar|as[^k]))", study),
    (r"/trials/\{id\}", trial),
    (r"/preferences/\{id\}", preference),
    (r"/assessments/\{id\}", assessment),
    (r"/suggestions/\{id\}", suggestion),
    (r"/lab-sessions/\{id\}", session),
    (r"/backups/\{id\}", backup),
    (r"/jobs/\{id\}", f"certificate-{trial}"),
    (r"/devices/\{id\}", device),
    (r"/reference-gaits/\{id\}", reference),
    (r"/users/\{id\}", user),
    (r"/tokens/\{id\}", token),
    (r"/study-members/\{id\}", member),
]:
    print(f"[[operations]]\ninclude-path-regex = '{pattern}'\nparameters = {{ \"path.id\" = \"{value}\" }}")

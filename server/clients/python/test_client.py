"""Tests of the client against a small service of their own: `python3 -m unittest` in this folder."""

import http.server
import inspect
import json
import pathlib
import threading
import typing
import unittest
from typing import Any, Optional

from gaitwright_client import Client, JobFailed, Problem
from gaitwright_client.paging import Pages
from gaitwright_client.schemas import Job

DESCRIPTION = pathlib.Path(__file__).resolve().parent.parent.parent / "openapi.json"

# The answer to a request: status, body, and headers. None closes the connection without an answer.
Answer = Optional[tuple[int, Any, dict[str, str]]]


# Content of an answer that breaks off in its headers.
BREAKS_OFF = object()


class Service:
    """Gives prepared answers, and keeps the requests."""

    def __init__(self, *answers: Answer) -> None:
        self.answers = list(answers)
        self.requests: list[tuple[str, str, dict[str, str], bytes]] = []
        service = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def answer(self) -> None:
                headers = {name.lower(): value for name, value in self.headers.items()}
                body = self.rfile.read(int(headers.get("content-length", 0)))
                service.requests.append((self.command, self.path, headers, body))
                answer = service.answers.pop(0)
                if answer is None:
                    self.close_connection = True
                    return
                status, content, more = answer
                if content is BREAKS_OFF:
                    self.wfile.write(b"HTTP/1.1 200 OK\r\ncontent-type: appl")
                    self.close_connection = True
                    return
                data = content if isinstance(content, bytes) else json.dumps(content).encode()
                self.send_response(status)
                for name, value in {"content-length": str(len(data)), **more}.items():
                    self.send_header(name, value)
                self.end_headers()
                self.wfile.write(data)

            do_GET = do_POST = do_PUT = do_PATCH = answer

            def log_message(self, *_: object) -> None:
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        self.client = Client(f"http://127.0.0.1:{self.server.server_port}", "secret", tries=4, timeout_s=5)

    def __enter__(self) -> "Service":
        return self

    def __exit__(self, *_: object) -> None:
        self.server.shutdown()
        self.server.server_close()


def job(state: str) -> Job:
    return typing.cast(Job, {"id": "backup-1", "kind": "backup", "state": state, "reason": "the disk is full"})


class Requests(unittest.TestCase):
    def test_an_address_without_a_scheme_is_refused_at_once(self) -> None:
        for address in ("127.0.0.1:8080", "localhost:8080", "ftp://127.0.0.1", "http://", ""):
            with self.assertRaisesRegex(ValueError, "must begin with http:// or https://"):
                Client(address)
        for address in ("http://[::1]:8080/", "https://gait.lab/tuning"):
            Client(address)

    def test_change_is_repeated_with_the_same_key(self) -> None:
        refused: Answer = (409, {"detail": "Both requests ran at the same time."}, {})
        with Service(None, refused, (503, {"detail": "not ready"}, {}), (200, {"id": "t"}, {})) as service:
            self.assertEqual(service.client.cancel_trial("t")["id"], "t")
        keys = {headers["idempotency-key"] for _, _, headers, _ in service.requests}
        self.assertEqual((len(service.requests), len(keys)), (4, 1))

    def test_request_whose_answer_breaks_off_in_the_headers_is_sent_again(self) -> None:
        with Service((200, BREAKS_OFF, {}), (200, {"id": "t"}, {})) as service:
            self.assertEqual(service.client.cancel_trial("t")["id"], "t")
        self.assertEqual(len(service.requests), 2)

    def test_another_program_at_the_address_is_named(self) -> None:
        with Service((200, b"<html>", {})) as service, self.assertRaisesRegex(ValueError, "not a Gaitwright service"):
            service.client.get_caller()

    def test_operation_that_returns_a_secret_is_sent_once_without_a_key(self) -> None:
        with Service(None) as service, self.assertRaises(OSError):
            service.client.create_token(name="rig", scopes=["read"])
        self.assertEqual(len(service.requests), 1)
        self.assertNotIn("idempotency-key", service.requests[0][2])

    def test_refusal_is_a_problem_with_its_field(self) -> None:
        document = {"type": "/problems/invalid-field", "status": 422, "detail": "Too tall.", "field": "height_m"}
        with Service((422, document, {})) as service, self.assertRaises(Problem) as caught:
            service.client.create_subject(pseudonym="S03", height_m=17.5, body_mass_kg=70)
        self.assertEqual((caught.exception.status, caught.exception.field), (422, "height_m"))
        self.assertEqual(len(service.requests), 1)

    def test_token_is_not_sent_to_the_target_of_a_redirect(self) -> None:
        with Service((200, {}, {})) as other, Service() as service:
            service.answers.append((302, {}, {"location": other.client.address}))
            with self.assertRaises(Problem) as caught:
                service.client.get_caller()
        self.assertEqual((caught.exception.status, other.requests), (302, []))

    def test_revision_is_sent_as_an_entity_tag(self) -> None:
        with Service((200, {}, {})) as service:
            service.client.update_study("a/b", revision=7, priority=3)
        verb, path, headers, body = service.requests[0]
        self.assertEqual((verb, path, json.loads(body)), ("PATCH", "/api/v1/studies/a%2Fb", {"priority": 3}))
        self.assertEqual(headers["if-match"], '"7"')


class Lists(unittest.TestCase):
    def test_every_page_is_read(self) -> None:
        pages: list[Answer] = [(200, {"items": [1, 2], "next": "aa"}, {}), (200, {"items": [3], "next": None}, {})]
        with Service(*pages) as service:
            self.assertEqual(list(service.client.list_trials("s", state="converged", page_size=2)), [1, 2, 3])
        path = "/api/v1/studies/s/trials?state=converged&limit=2"
        self.assertEqual([request[1] for request in service.requests], [path, f"{path}&cursor=aa"])

    def test_events_continue_after_the_last_one(self) -> None:
        first = b': alive\n\nevent: trial_ended\nid: 4\ndata: {"number":\ndata: 1}\n\nevent: progress\ndata: {}'
        second = b'event: progress\ndata: {"number": 2}\n\n'
        with Service((200, first, {}), (200, second, {})) as service:
            events = service.client.follow_study_events("s")
            self.assertEqual(next(events), ("trial_ended", 4, {"number": 1}))
            self.assertEqual(next(events), ("progress", None, {"number": 2}))
        self.assertEqual(service.requests[1][2]["last-event-id"], "4")


class Waiting(unittest.TestCase):
    def test_progress_is_called_after_each_change(self) -> None:
        states = ["queued", "queued", "running", "done"]
        seen: list[str] = []
        with Service(*((200, job(state), {}) for state in states)) as service:
            service.client.wait(job("queued"), progress=lambda now: seen.append(now["state"]), poll_s=0.01)
        self.assertEqual(seen, ["queued", "running", "done"])

    def test_failed_job_raises_its_reason(self) -> None:
        with Service((200, job("failed"), {})) as service, self.assertRaisesRegex(JobFailed, "the disk is full"):
            service.client.wait(job("queued"))

    def test_time_limit_ends_the_wait(self) -> None:
        with Service(*[(200, job("running"), {})] * 50) as service, self.assertRaises(TimeoutError):
            service.client.wait(job("queued"), timeout_s=0.05, poll_s=0.02)


class Recorder(Client):
    """Keeps requests instead of sending them."""

    sent: tuple[str, str]

    def request_bytes(self, verb: str, path: str, at: Any = None, **_: Any) -> bytes:
        for name in at or {}:
            assert f"{{{name}}}" in path
        self.sent = (verb, path)
        return b"{}"


class Description(unittest.TestCase):
    def test_every_operation_sends_the_request_that_the_description_has(self) -> None:
        document = json.loads(DESCRIPTION.read_text(encoding="utf-8"))
        for path, item in document["paths"].items():
            for verb, operation in item.items():
                client = Recorder()
                method = getattr(client, operation["operationId"])
                parameters = inspect.signature(method).parameters.values()
                needed = [one.name for one in parameters if one.default is one.empty and one.kind is not one.VAR_KEYWORD]
                answer = method(**{name: "x" for name in needed})
                # A list and a stream send nothing before the first entry is wanted.
                if isinstance(answer, Pages):
                    client.sent = ("GET", answer.path)
                elif inspect.isgenerator(answer):
                    client.sent = ("GET", inspect.getgeneratorlocals(answer)["path"])
                self.assertEqual(client.sent, (verb.upper(), path), operation["operationId"])

    def test_every_type_can_be_read_while_the_program_runs(self) -> None:
        document = json.loads(DESCRIPTION.read_text(encoding="utf-8"))
        operations = [operation for item in document["paths"].values() for operation in item.values()]
        for operation in operations:
            hints = typing.get_type_hints(getattr(Client, operation["operationId"]))
            self.assertIn("return", hints, operation["operationId"])


if __name__ == "__main__":
    unittest.main()

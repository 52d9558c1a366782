"""Requests over HTTP, repeated until they are answered."""

from __future__ import annotations

import http.client
import json
import ssl
import time
import urllib.error
import urllib.parse
import urllib.request
import uuid
from collections.abc import Mapping
from typing import Any, Optional

from .problem import Problem

# Statuses of a service, or of a proxy before it, that is not ready.
NOT_READY = (502, 503, 504)
CONFLICT = 409


class NoRedirects(urllib.request.HTTPRedirectHandler):
    """Reports a redirect as an error, because following it would send the token to another address."""

    def redirect_request(self, *_: Any) -> None:
        return None


class Transport:
    """Sends requests to one service.

    A request without an answer is sent again, up to `tries` times in all. Each attempt at a change has the same
    idempotency key, so the change is made once.
    """

    def __init__(
        self,
        address: str = "http://127.0.0.1:8080",
        token: Optional[str] = None,
        *,
        tries: int = 6,
        timeout_s: float = 60.0,
        context: Optional[ssl.SSLContext] = None,
    ) -> None:
        """Raises `ValueError` for an address that is not `http://HOST` or `https://HOST`, with a port or without."""
        parts = urllib.parse.urlsplit(address)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise ValueError(f"address: {address!r} must begin with http:// or https:// and name a host")
        self.address = address.rstrip("/")
        self.token = token
        self.tries = tries
        self.timeout_s = timeout_s
        handlers: list[urllib.request.BaseHandler] = [NoRedirects()]
        if context:
            handlers.append(urllib.request.HTTPSHandler(context=context))
        self.opener = urllib.request.build_opener(*handlers)

    def request_json(self, verb: str, path: str, at: Optional[Mapping[str, str]] = None, **more: Any) -> Any:
        content = self.request_bytes(verb, path, at, **more)
        try:
            return json.loads(content)
        except ValueError:
            raise ValueError(f"{self.address}{path} did not answer with JSON, so it is not a Gaitwright service") from None

    def request_text(self, verb: str, path: str, at: Optional[Mapping[str, str]] = None, **more: Any) -> str:
        return self.request_bytes(verb, path, at, **more).decode("utf-8-sig")

    def request_bytes(
        self,
        verb: str,
        path: str,
        at: Optional[Mapping[str, str]] = None,
        *,
        query: Optional[Mapping[str, object]] = None,
        body: Optional[Mapping[str, object]] = None,
        revision: Optional[int] = None,
        key: Optional[str] = None,
        repeatable: bool = True,
    ) -> bytes:
        """The body of the response to a request for `path`, in which `at` replaces the names in braces."""
        headers = {"accept": "*/*"}
        if revision is not None:
            headers["if-match"] = f'"{revision}"'
        if verb != "GET" and repeatable:
            headers["idempotency-key"] = key or str(uuid.uuid4())
        request = self.request(verb, path, at, query, headers)
        if body is not None:
            request.data = json.dumps(body).encode()
            request.add_header("content-type", "application/json")
        broken = False
        for attempt in range(1, self.tries + 1):
            last = attempt == self.tries
            try:
                with self.open(request) as answer:
                    # Every response of the service states its length; this one broke off before it did.
                    if answer.status != 204 and answer.length is None and not answer.chunked:
                        raise http.client.IncompleteRead(b"")
                    return answer.read()
            except Problem as problem:
                # After a broken connection, both attempts can have run at the same time, which is a conflict.
                again = problem.status in NOT_READY or (broken and problem.status == CONFLICT)
                if last or not (again and repeatable):
                    raise
            except (OSError, http.client.HTTPException):
                if last or not repeatable:
                    raise
                broken = True
            time.sleep(0.2 * 2 ** (attempt - 1))
        raise ValueError("`tries` must be 1 or more")

    def request(
        self,
        verb: str,
        path: str,
        at: Optional[Mapping[str, str]],
        query: Optional[Mapping[str, object]],
        headers: Mapping[str, str],
    ) -> urllib.request.Request:
        for name, value in (at or {}).items():
            path = path.replace(f"{{{name}}}", urllib.parse.quote(str(value), safe=""))
        given = {name: value for name, value in (query or {}).items() if value is not None}
        address = self.address + path + ("?" + urllib.parse.urlencode(given) if given else "")
        request = urllib.request.Request(address, headers=dict(headers), method=verb)
        if self.token:
            request.add_header("authorization", f"Bearer {self.token}")
        return request

    def open(self, request: urllib.request.Request) -> http.client.HTTPResponse:
        """The response. A refusal is a `Problem`."""
        try:
            answer: http.client.HTTPResponse = self.opener.open(request, timeout=self.timeout_s)
            return answer
        except urllib.error.HTTPError as error:
            with error:
                raise Problem.of(error.code, error.reason, error.read()) from None

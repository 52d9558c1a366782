"""Tunes for ten trials, and fetches the gait of the best trial from the service."""

import json
import subprocess
import time
import urllib.error
import urllib.request
from pathlib import Path

ADDRESS = "127.0.0.1:18931"
TRIALS = 10
LONGEST_START_S = 60.0


def _study(program: str, subject: int, seed: int, database: Path) -> dict:
    """The result of the study. A stopped study continues."""
    kept = database.with_suffix(".json")
    if not kept.exists():
        options = ["--subject", str(subject), "--trials", str(TRIALS), "--seed", str(seed), "--workers", "1"]
        command = [program, "tune", *options, "--database", str(database), "--json"]
        kept.write_text(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout)
    return json.loads(kept.read_text())


def _gait(program: str, database: Path, trial_id: str) -> bytes:
    """The gait of a trial, from a service that runs for this request only."""
    command = [program, "serve", "--database", str(database), "--no-sign-in", "--listen", ADDRESS]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as service:
        try:
            end = time.monotonic() + LONGEST_START_S
            while True:
                try:
                    with urllib.request.urlopen(f"http://{ADDRESS}/api/v1/trials/{trial_id}/gait") as answer:
                        return answer.read()
                except urllib.error.HTTPError:
                    raise
                except urllib.error.URLError:
                    if time.monotonic() > end:
                        raise
                    time.sleep(0.5)
        finally:
            service.terminate()


def tune(program: str, out: Path, subject: int, seed: int) -> None:
    """Writes the gait of the best trial to `out`. The record is kept in the folder `studies` next to it."""
    if out.exists():
        return
    database = out.parent / "studies" / f"{out.stem}.db"
    database.parent.mkdir(exist_ok=True)
    study = _study(program, subject, seed, database)
    [trial_id] = [trial["trial_id"] for trial in study["trials"] if trial["number"] == study["best_trial"]]
    out.write_bytes(_gait(program, database, trial_id))
    print(f"{out.stem}: trial {study['best_trial']}, certificate {study['best_certificate']}", flush=True)

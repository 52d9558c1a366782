"""Tables as columns of NumPy, the only part of the client that needs it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from typing import Any

import numpy
import numpy.typing

from .schemas import Trial

Column = numpy.typing.NDArray[Any]

# Figures of a trial that are numbers, or absent.
FIGURES = ("gait_rmse_rad", "cost_of_transport", "max_violation", "iterations", "seconds_total")


def csv_table(text: str) -> dict[str, Column]:
    """The columns of a CSV file of the service, by their names.

    A column of numbers and empty cells has 64-bit floats, with NaN for an empty cell. Any other column has text.
    """
    rows = csv.reader(io.StringIO(text))
    names = next(rows)
    cells = list(zip(*rows)) or [()] * len(names)
    return {name: column(values) for name, values in zip(names, cells)}


def column(cells: tuple[str, ...]) -> Column:
    try:
        return numpy.array([float(cell) if cell else numpy.nan for cell in cells], dtype=numpy.float64)
    except ValueError:
        return numpy.array(cells, dtype=str)


def trial_table(trials: Iterable[Trial]) -> dict[str, Column]:
    """Trials as columns: number, identifier, state, tuned bounds and figures, with NaN for an absent figure."""
    listed = list(trials)
    table: dict[str, Column] = {
        "number": numpy.array([trial["number"] for trial in listed], dtype=numpy.int64),
        "id": numpy.array([trial["id"] for trial in listed], dtype=str),
        "state": numpy.array([trial["state"] for trial in listed], dtype=str),
    }
    actions: list[dict[str, Any]] = [dict(trial["action"]) for trial in listed]
    for name in actions[0] if actions else ():
        table[name] = numpy.array([action[name] for action in actions], dtype=numpy.float64)
    for name in FIGURES:
        figures = [trial.get(name) for trial in listed]
        table[name] = numpy.array([numpy.nan if f is None else f for f in figures], dtype=numpy.float64)
    return table

"""A client of Gaitwright for Python 3.9 or newer. It needs the standard library; `tables` also needs NumPy."""

from .client import Client
from .events import Event
from .operations import VERSION as __version__
from .paging import Pages
from .problem import Problem
from .waiting import JobFailed

__all__ = ["Client", "Event", "JobFailed", "Pages", "Problem", "__version__"]

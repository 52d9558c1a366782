"""Every operation of the REST interface, in a file for each tag.

Made by generate.py from server/openapi.json.
"""

from .access import AccessMethods
from .blind import BlindMethods
from .devices import DevicesMethods
from .figures import FiguresMethods
from .health import HealthMethods
from .lab import LabMethods
from .operation import OperationMethods
from .preferences import PreferencesMethods
from .reference_gaits import ReferenceGaitsMethods
from .scripts import ScriptsMethods
from .studies import StudiesMethods
from .subjects import SubjectsMethods
from .trials import TrialsMethods

VERSION = "0.1.0"


class Operations(
    AccessMethods,
    BlindMethods,
    DevicesMethods,
    FiguresMethods,
    HealthMethods,
    LabMethods,
    OperationMethods,
    PreferencesMethods,
    ReferenceGaitsMethods,
    ScriptsMethods,
    StudiesMethods,
    SubjectsMethods,
    TrialsMethods,
):
    """Every operation as a method, named by its `operationId`."""

"""`Unpack`, which Python has since 3.11. Older ones need it for type checkers only."""

import sys
from typing import TYPE_CHECKING, Any

if sys.version_info >= (3, 11):
    from typing import Unpack
elif TYPE_CHECKING:
    from typing_extensions import Unpack
else:

    class Unpack:
        """Stands for the type in brackets."""

        def __class_getitem__(cls, item: Any) -> Any:
            return item


__all__ = ["Unpack"]

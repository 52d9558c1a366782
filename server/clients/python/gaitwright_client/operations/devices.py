"""Operations with the tag `devices`.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from typing import Optional, cast

from ..paging import Pages
from ..schemas import (
    Device,
    DeviceDefinition,
    DeviceId,
)
from ..transport import Transport
from ..unpack import Unpack


class DevicesMethods(Transport):
    """Operations with the tag `devices`."""

    def list_devices(self, *, page_size: Optional[int] = None) -> Pages[Device]:
        """List devices.

        Newest first.
        """
        return Pages(self, "/api/v1/devices", query={"limit": page_size})

    def create_device(self, *, idempotency_key: Optional[str] = None, **body: Unpack[DeviceDefinition]) -> Device:
        """Create a device from a data file.

        If a device with the same definition exists, the response contains it.

        Fields: adapter_gyration_radius_m, adapter_mass_kg, ankle_height_m, ankle_max_rad, ankle_min_rad,
        ankle_torque_limit_n_m, carried_limb, foot_com_down_m, foot_com_forward_m, foot_inertia_kg_m2, foot_mass_kg,
        heel_behind_m, joint_speed_limit_rad_s, knee_housing_inertia_kg_m2, knee_housing_mass_kg, knee_torque_limit_n_m,
        name, shank_com_fraction, shank_gyration_fraction, shank_length_m, shank_mass_kg, toe_ahead_m; optionally
        sources.
        """
        return cast(Device, self.request_json("POST", "/api/v1/devices", body=body, key=idempotency_key))

    def get_device(self, device_id: DeviceId) -> Device:
        """Get a device.

        With its whole definition: masses, lengths and limits of the prosthetic joints.
        """
        return cast(Device, self.request_json("GET", "/api/v1/devices/{id}", {"id": device_id}))

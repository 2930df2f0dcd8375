"""What every record of a file is."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Record(BaseModel):
    """Frozen; unknown names are errors, and so is what is not finite."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

"""The configuration of a run, as the server published it."""

import tomllib
from dataclasses import dataclass
from functools import cached_property
from typing import Any


@dataclass(frozen=True)
class Description:
    """The dragon, its route and how it is served."""

    run_id: int
    """The run that it belongs to."""
    toml: str
    """The whole configuration as TOML."""

    @cached_property
    def config(self) -> dict[str, Any]:
        """The configuration by table and key, such as `config["dragon"]["benches"]`; units are in the keys' names."""
        return tomllib.loads(self.toml)

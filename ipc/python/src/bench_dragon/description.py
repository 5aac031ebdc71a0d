"""Configuration of a run, as the server published it."""

import tomllib
from dataclasses import dataclass
from functools import cached_property
from typing import Any


@dataclass(frozen=True)
class Description:
    """Configuration of a run: the dragon, its route and the server's settings."""

    run_id: int
    """Run of the configuration."""
    toml: str
    """The complete configuration as TOML."""

    @cached_property
    def config(self) -> dict[str, Any]:
        """The configuration by table and key, such as `config["dragon"]["benches"]`; units are in the keys' names."""
        return tomllib.loads(self.toml)
